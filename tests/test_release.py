"""What a release says of itself."""

import re
from pathlib import Path

import exactcreep

ROOT = Path(__file__).parents[1]


def test_the_version_is_the_same_wherever_it_is_said() -> None:
    told = re.findall(
        r"^## \[(\d.*?)\] - \d{4}-\d\d-\d\d$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M
    )
    cited = re.findall(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text("utf-8"), re.M)
    assert told[0] == exactcreep.__version__
    assert cited == [exactcreep.__version__]
