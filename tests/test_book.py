"""The README and the book: what they show runs, what they name is there, and the book builds."""

import doctest
import re
import shlex
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest

import exactcreep
from exactcreep.cli import status
from exactcreep.scene import Scene
from tests.processes import finished

ROOT = Path(__file__).parents[1]
BOOK = ROOT / "notebooks"
README = ROOT / "README.md"
MOST_PAGES = 60
PAGES = [README, *sorted(path for path in BOOK.rglob("*.md") if path.parent.name != "pictures")]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(path: Path, language: str) -> list[str]:
    found = BLOCK.findall(path.read_text(encoding="utf-8"))
    return [text for name, text in found if name == language]


def pages_with(language: str, holding: str = "") -> list[Path]:
    return [path for path in PAGES if any(holding in text for text in blocks(path, language))]


def runs_when_built(path: Path) -> bool:
    """Return whether the build of the book runs the blocks of a page, to show what they print."""
    return bool(re.search(r"^<<(printed|drawn)\b", path.read_text("utf-8"), re.MULTILINE))


@pytest.mark.filterwarnings("ignore::exactcreep.quasistatic.checkpoint.CheckpointWarning")
@pytest.mark.parametrize("path", pages_with("python"), ids=lambda path: path.stem)
def test_the_python_of_a_page_runs_and_prints_what_it_says(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = "\n".join(blocks(path, "python"))
    example = doctest.DocTestParser().get_doctest(text, {}, path.stem, str(path), 0)
    assert doctest.DocTestRunner(verbose=False).run(example).failed == 0
    for text in blocks(path, "python"):
        if not text.startswith(">>>") and not runs_when_built(path):
            exec(compile(text, str(path), "exec"), {})


@pytest.mark.parametrize("path", pages_with("toml"), ids=lambda path: path.stem)
def test_a_toml_block_is_a_scene(path: Path) -> None:
    for text in blocks(path, "toml"):
        assert list(Scene.from_text(text).members())


SHORTER = {
    "animate": ["--set", "drive.cycles=2"],
    "compare": ["--events", "20", "--dts", "0.1", "--seeds", "1"],
    "run": ["--set", "drive.cycles=3"],
}
"""What is asked for less than a reader does, by command."""


@pytest.mark.filterwarnings("ignore::exactcreep.quasistatic.checkpoint.CheckpointWarning")
@pytest.mark.parametrize(
    "path",
    [path for path in pages_with("sh", "exactcreep ") if not runs_when_built(path)],
    ids=lambda path: path.stem,
)
def test_the_commands_of_a_page_run(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for text in blocks(path, "toml"):
        Path("my-scene.toml").write_text(text, encoding="utf-8")
    for line in "\n".join(blocks(path, "sh")).splitlines():
        if line.startswith("exactcreep ") and "bristol-roof" not in line:  # see test_solid
            words = shlex.split(line, comments=True)[1:]
            shorter = SHORTER.get(words[0], [])
            limited = 3 if "--max-events" in words else 0
            assert status([*words, *shorter]) == limited, f"{line}: {capsys.readouterr()}"


def told(pattern: str) -> list[tuple[Path, str]]:
    """Return what pages say that has a form, with the page."""
    texts = [(path, path.read_text(encoding="utf-8")) for path in PAGES]
    found = [(path, said) for path, text in texts for said in re.findall(pattern, text)]
    assert found
    return found


def test_links_between_pages_lead_to_a_page_and_modules_that_they_name_are_there() -> None:
    links = told(r"\]\((?!https?:|#)([^)#\s]+)")
    assert [(path, link) for path, link in links if not (path.parent / link).exists()] == []
    homes = (ROOT, ROOT / "exactcreep", BOOK)
    files = told(r"`([\w/]+\.(?:py|json|toml)|tests/[\w/]+)`")
    absent = [pair for pair in files if not any((home / pair[1]).exists() for home in homes)]
    assert absent == []


def test_every_public_function_and_type_has_its_place_in_the_reference() -> None:
    pages = "".join(page.read_text(encoding="utf-8") for page in BOOK.glob("reference/*.md"))
    modules = {"": exactcreep, "results.": exactcreep.results, "disorder.": exactcreep.disorder}
    offered = [
        f"{place}{name}"
        for place, module in modules.items()
        for name in module.__all__
        if callable(getattr(module, name))
    ]
    assert sorted(offered) == sorted(re.findall("<<api (.*)>>", pages))


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the book, built with every warning an error."""
    pytest.importorskip("sphinx", reason="the extra `docs` is not installed")
    folder = tmp_path_factory.mktemp("book")
    options = ["-W", "-n", "-q", "-j", "auto", "-d", folder / "trees"]
    words = ["-m", "sphinx", *options, BOOK, folder / "html"]
    # a first build compiles the kernels, too; what hangs is ended by the limit of every test
    done = finished(sys.executable, *map(str, words), patience=None)
    assert done.returncode == 0, done.stderr
    return folder / "html"


ABROAD = re.compile(r'<(?:script|link|img)[^>]*(?:src|href)="(?:https?:)?//')
WORDLESS = re.compile(r'<img(?![^>]* alt="[^"])')
LINK = re.compile(r'<a\b[^>]* href="(?!\w+:|#")([^"#]*)#?([^"]*)"')


@pytest.mark.slow
def test_pages_are_few_ask_nothing_of_the_network_and_lead_somewhere(built: Path) -> None:
    pages = {path: path.read_text(encoding="utf-8") for path in built.rglob("*.html")}
    assert 40 < sum("_static" not in path.parts for path in pages) <= MOST_PAGES
    astray = []
    for path, text in pages.items():
        assert not ABROAD.search(text), path
        assert not WORDLESS.search(text), path
        for file, anchor in set(LINK.findall(text)):
            aim = (path.parent / unquote(file)).resolve() if file else path
            mark = f'id="{unquote(anchor)}"' if anchor else ""
            if not aim.exists() or mark not in pages.get(aim, mark):
                astray.append(f"{path.name}: {file}#{anchor}")
    assert astray == []
