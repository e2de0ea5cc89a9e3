"""What a release says of itself."""

import re
import tomllib
from pathlib import Path

import exactcreep

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def test_the_version_is_the_same_wherever_it_is_said() -> None:
    told = re.findall(
        r"^## \[(\d.*?)\] - \d{4}-\d\d-\d\d$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M
    )
    cited = re.findall(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text("utf-8"), re.M)
    assert told[0] == exactcreep.__version__
    assert cited == [exactcreep.__version__]


def test_an_extra_that_the_readme_or_the_book_names_exists() -> None:
    pages = [ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "notebooks").rglob("*.md")]
    text = "\n".join(page.read_text("utf-8") for page in pages)
    named = set(re.findall(r"\.\[(\w+)\]|extra `(\w+)`", text))
    assert named
    assert {one or other for one, other in named} <= set(PROJECT["optional-dependencies"])
