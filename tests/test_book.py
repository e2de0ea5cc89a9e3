"""The README and the book: what they show runs, what they name is there, and the book builds."""

import doctest
import inspect
import re
import shlex
import sys
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from urllib.parse import unquote

import pytest

import exactcreep
from exactcreep.cli import status
from exactcreep.scene import Scene
from tests.processes import finished
from tests.test_architecture import ROOMS

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


@pytest.mark.parametrize("path", pages_with("python"), ids=lambda path: path.stem)
def test_the_python_of_a_page_runs_and_prints_what_it_says(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = "\n".join(blocks(path, "python"))
    example = doctest.DocTestParser().get_doctest(text, {}, path.stem, str(path), 0)
    assert doctest.DocTestRunner(verbose=False).run(example).failed == 0
    for text in blocks(path, "python"):
        if not text.startswith(">>>"):
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


@pytest.mark.parametrize("path", pages_with("sh", "exactcreep "), ids=lambda path: path.stem)
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
            assert status([*words, *shorter]) == 0, f"{line}: {capsys.readouterr()}"


def test_the_map_of_the_rooms_says_of_each_what_it_says_of_itself() -> None:
    text = (BOOK / "contributing.md").read_text(encoding="utf-8")
    told = re.findall(r"^\| `exactcreep/(\w+)` \| (.*) \|$", text, re.MULTILINE)
    folders = {path.parent.name for path in (ROOT / "exactcreep").glob("*/__init__.py")}
    assert [room for room, _ in told] == [
        room for rooms in ROOMS for room in rooms if room in folders
    ]
    for room, knows in told:
        said = inspect.getdoc(import_module(f"exactcreep.{room}")) or ""
        assert knows == said.partition("\n\n")[0]


def test_every_link_between_pages_leads_to_a_page() -> None:
    links = [
        (path, link)
        for path in PAGES
        for link in re.findall(r"\]\((?!https?:|#)([^)#\s]+)", path.read_text(encoding="utf-8"))
    ]
    assert links
    assert [(path, link) for path, link in links if not (path.parent / link).exists()] == []


def test_every_module_that_a_page_names_is_there() -> None:
    homes = (ROOT, ROOT / "exactcreep", BOOK)
    files = r"`([\w/]+\.(?:py|json|toml)|tests/[\w/]+)`"
    named = [
        (path.name, file)
        for path in PAGES
        for file in re.findall(files, path.read_text(encoding="utf-8"))
    ]
    assert named
    absent = [pair for pair in named if not any((home / pair[1]).exists() for home in homes)]
    assert absent == []


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


@pytest.mark.slow
def test_every_public_name_is_in_the_reference(built: Path) -> None:
    from sphinx.util.inventory import InventoryFile

    with (built / "objects.inv").open("rb") as file:
        inventory = InventoryFile.load(file, "", lambda base, uri: uri)
    known = {name for kind, names in inventory.items() if kind.startswith("py:") for name in names}
    public = {name for name in exactcreep.__all__ if not name.startswith("_")}
    modules = {name for name in public if inspect.ismodule(getattr(exactcreep, name))}
    offered = {name: getattr(exactcreep, name) for name in modules}
    inside = {  # a constant has no page
        f"{name}.{of}"
        for name, module in offered.items()
        for of in module.__all__
        if callable(getattr(module, of))
    }
    assert {f"exactcreep.{name}" for name in (public - modules) | inside} - known == set()


@pytest.mark.slow
def test_the_book_has_no_more_pages_than_a_reader_can_survey(built: Path) -> None:
    pages = [path for path in built.rglob("*.html") if "_static" not in path.parts]
    assert 40 < len(pages) <= MOST_PAGES


@pytest.mark.slow
def test_the_book_asks_nothing_of_the_network(built: Path) -> None:
    for path in built.rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        assert not re.findall(r"<(?:script|link|img)[^>]*(?:src|href)=\"(?:https?:)?//[^\"]*", text)


class Anchors(HTMLParser):
    """Where a page leads, what of it can be led to, and its pictures without words."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path, self.links, self.ids, self.wordless = path, set[str](), set[str](), list[str]()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        about = dict(attrs)
        self.ids.add(about.get("id") or "")
        href = about.get("href")
        if tag == "a" and href and not re.match(r"\w+:|#$", href):
            self.links.add(href)
        if tag == "img" and not about.get("alt"):
            self.wordless.append(f"{self.path.name}: {about.get('src')}")


@pytest.mark.slow
def test_links_of_the_built_book_lead_somewhere_and_pictures_have_words(built: Path) -> None:
    pages = {path: Anchors(path) for path in built.rglob("*.html")}
    assert [word for page in pages.values() for word in page.wordless] == []
    astray = []
    for path, page in pages.items():
        for link in page.links:
            file, _, anchor = link.partition("#")
            aim = (path.parent / unquote(file)).resolve() if file else path
            known = aim in pages and (not anchor or unquote(anchor) in pages[aim].ids)
            if not known and not (aim.exists() and not anchor):
                astray.append(f"{path.name}: {link}")
    assert astray == []
