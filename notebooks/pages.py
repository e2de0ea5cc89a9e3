"""What the book says of the code, taken from the code: each function fills one kind of ``<<...>>``.

A line ``<<name argument>>`` of a page stands for what ``PARTS[name](argument)`` returns, which is
Markdown. So no list of names, columns, keys, commands or laws is written twice.
"""

import csv
import enum
import inspect
import json
import math
import os
import re
from dataclasses import fields
from hashlib import sha256
from pathlib import Path
from unittest.mock import patch

import sympy as sp
from numpydoc.docscrape import NumpyDocString

import exactcreep
from derivations.ledger import CHAPTERS, by_number, entries, premises, proof_of, value
from derivations.model import PREMISES
from exactcreep.cli import COMMANDS, program
from exactcreep.quasistatic.experiment import DRIVES
from exactcreep.scene import builtin_scenes, load_scene
from exactcreep.solvers.registry import SOLVERS
from exactcreep.solvers.tables import TABLES
from formulas import latex, with_formulas

BOOK = Path(__file__).parent
DERIVATIONS = BOOK.parent / "derivations"
KEPT_PREMISES = BOOK / "reference" / "premises.json"
"""What each premise carries, with a digest of the derivations that found it."""


def _cell(text):
    return " ".join(str(text).split()).replace("|", r"\|")


def _table(head, rows, kind=""):
    """Return a table; the cells are Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    body = "\n".join("| " + " | ".join(_cell(cell) for cell in line) + " |" for line in lines)
    return f"```{{table}}\n:class: {kind or 'plain'}\n\n{body}\n```\n"


# --- the public names ----------------------------------------------------------------------------


def _directive(name):
    """Return the directive that documents a public name, with its members."""
    value = _value(name)
    if isinstance(value, type):
        kind, options = "autoclass", ["members"]
        if issubclass(value, BaseException):
            kind = "autoexception"
        if issubclass(value, enum.Enum):
            options.append("undoc-members")
    else:
        kind, options = "autofunction", []
    lines = [f".. {kind}:: {name}", *(f"   :{option}:" for option in options)]
    return "\n".join(lines)


def _value(name):
    value = exactcreep
    for part in name.split(".")[1:]:
        value = getattr(value, part)
    return value


def api(short):
    """Return what the docstring of a public name says, and the picture that `drawings/api/NAME.py` draws."""
    name = f"exactcreep.{short}"
    return "\n\n".join([f"```{{eval-rst}}\n{_directive(name)}\n```", *_drawing(short)])


def _first_sentence(value):
    """Return what the docstring of a public name begins with, as Markdown."""
    said = " ".join((inspect.getdoc(value) or "").partition("\n\n")[0].split())
    said = re.sub(r"`exactcreep\.(?:\w+\.)*(\w+)`", r"`\1`", said.replace("``", "`"))
    return _prose(said)


def _drawing(short):
    """Return the script that draws a public name, and a line for the picture that it writes."""
    script = BOOK / "drawings" / "api" / f"{short}.py"
    if not script.exists():
        return []
    code = script.read_text(encoding="utf-8")
    (file,) = re.findall(r'savefig\("([\w.-]+)"\)', code)
    drawn = f"<<drawn {file}: What the code above draws of {short}>>"
    return [f"```python\n{code}```", drawn]


def readable(app, what, name, value, options, lines):
    """Keep what the docstrings mean by ``|theta|`` and ``l0**2`` from being read as markup."""
    literal = False
    for k, line in enumerate(lines):
        indented = line.startswith(" ") or not line.strip()
        literal = literal and indented
        if not literal and not line.lstrip().startswith((">>>", "...")):
            parts = re.split(r"(``.*?``|`[^`]*`)", line)
            parts[::2] = [re.sub(r"(\*+|\||(?<=\w)_(?!\w))", _escaped, p) for p in parts[::2]]
            lines[k] = "".join(parts)
        literal = literal or line.rstrip().endswith("::")


def _escaped(found):
    return "".join("\\" + sign for sign in found[0])


# --- tables, scenes, commands --------------------------------------------------------------------


def columns(_):
    """Return the variables of a dataset, table by table."""
    parts = []
    for table in TABLES:
        rows = [
            (f"`{name}`", f"`({', '.join([table.dimension, *c.across])})`", c.dtype, c.unit,
             c.meaning)
            for name, c in table.columns.items()
        ]  # fmt: skip
        parts += [f"## Per {table.dimension.replace('_', '-')}", inspect.getdoc(table.row),
                  _table(["variable", "dimensions", "type", "unit", "meaning"], rows)]  # fmt: skip
    return "\n\n".join(parts)


def _parameters(kind):
    """Return the rows of a class's parameters: name, type, meaning, from its docstring."""
    said = NumpyDocString(inspect.getdoc(kind) or "")
    listed = said["Parameters"] or said["Attributes"]
    return {
        name.strip(): (entry.type, " ".join(entry.desc))
        for entry in listed
        for name in entry.name.split(",")
    }


def keys(_):
    """Return the keys of a scene, table by table."""
    head = ["key", "type", "meaning"]
    parts = ["## `[chain]`", _table(head, _rows(exactcreep.Chain))]
    for word, kind in DRIVES.items():
        about = (inspect.getdoc(kind) or "").splitlines()[0]
        parts += [f'## `[drive]` with `kind = "{word}"`', about, _table(head, _rows(kind))]
    parts.append("## Options of the solvers, in `[run]`")
    for name, solver in SOLVERS.items():
        made = solver()
        if fields(made):
            parts += [f"### `{name}`", f"{made.summary[0].upper()}{made.summary[1:]}.",
                      _table(head, _rows(made))]  # fmt: skip
    return "\n\n".join(parts)


def _rows(kind):
    known = _parameters(kind)
    taken = [
        each.name
        for each in inspect.signature(kind).parameters.values()
        if each.default is not None
    ]
    return [(f"`{name}`", *known.get(name, ("", ""))) for name in taken]


def scenes(_):
    """Return the scenes that come with the program."""
    rows = [(f"`{name}`", load_scene(name).title) for name in builtin_scenes()]
    return _table(["scene", "what it is"], rows, "searchable")


def commands(_):
    """Return every command with its arguments and options, as ``--help`` has them."""
    wide = patch.dict(os.environ, COLUMNS="400")  # an example is one line: boxes wrap by themselves
    with wide, patch("sys.argv", ["exactcreep"]):  # usage repeats how the program was started
        text = program(COMMANDS).generate_docs().removeprefix("# exactcreep")
    text = re.sub(r"((?:^    exactcreep .*\n)+)", r"```sh\n\1```\n", text, flags=re.MULTILINE)
    text = re.sub(r"^    (?=exactcreep )", "", text, flags=re.MULTILINE)
    text = re.sub(r"(?<=\w)\*\*(?=\w)", r"\\*\\*", text)  # a power
    about, _, rest = text.partition("\n## Table of Contents")
    return f"## The program itself{about}\n" + rest[rest.index("**Commands**"):]


def benchmark(n):
    """Return the times and errors that `tests/benchmarks/run.py` measured with n sliders."""
    with (BOOK / "pictures" / "benchmark.csv").open(encoding="utf-8") as file:
        measured = [row for row in csv.DictReader(file) if row["n"] == n]
    rows = []
    for row in measured:
        wrong, after = f"in {row['parted']} of {row['seeds']} seeds", float(row["agreed"])
        wrong += f", in the median after {after:.0f} events" if after < math.inf else ""
        name = row["method"].capitalize() if "verlet" in row["method"] else f"`{row['method']}`"
        took = float(f"{1e3 * float(row['seconds']):.2g}")
        rows.append((name, f"{took:g} ms", wrong, f"{float(row['error']):.1e}"))
    head = ["method", "time per half-cycle", "wrong event", "largest error before it"]
    return _table(head, rows, "stacked")


# --- laws and proofs -----------------------------------------------------------------------------


def plain_latex(text):
    """Return a formula of the paper as one that stands alone: unnumbered, its lines aligned."""
    text = text.replace(r"\nonumber", "").strip()
    aligned = "&" in text and r"\begin" not in text
    return rf"\begin{{array}}{{rcl}}{text}\end{{array}}" if aligned else text


def _formula(text):
    """Return the text of the paper with its formulas as formulas: all of it, or marked parts."""
    text = " ".join((text or "").split()).replace("Eq.~(", "Eq. (")
    text = re.sub(r"\\ref\{(.*?)\}", r"\1", re.sub(r"\s*\\cite\{.*?\}", "", text))
    if "«" in text:
        return re.sub("«(.*?)»", r"$\1$", text)
    return text if "$" in text or not re.search(r"\\|^10\^", text) else f"${text}$"


def laws(_):
    """Return one table of all laws: formula, verdict with a link to its proof, and functions."""
    rows = []
    for entry in entries():
        code = entry.law
        if code:
            functions = "<br>".join(f"{form}: {_linked(name)}" for form, name in code.items())
            law = f"{_called(entry)}<br>[{entry.verdict}](#proof-{entry.chapter})"
            rows.append([law, f"${plain_latex(entry.formula)}$", functions])
    return _table(["law, verdict", "formula", "functions"], rows, "searchable laws")


def _linked(call):
    name, bracket, rest = call.partition("(")
    return f"{{py:obj}}`{name} <exactcreep.laws.{name}>`" + (f" `{bracket}{rest}`" if rest else "")


def law_functions(_):
    """Return what every function of `exactcreep.laws` says of itself."""
    return "\n\n".join(api(f"laws.{name}") for name in exactcreep.laws.__all__)


def law_parameters(_):
    """Return the parameters that laws share."""
    shared = NumpyDocString(exactcreep.laws.__doc__)["Parameters"]
    return _table(["parameter", "meaning"], [(f"`{one.name}`", " ".join(one.desc)) for one in shared])


def ledger(_):
    """Write every statement of the paper with its verdict as a CSV file, and return a link to it."""
    file = BOOK / "pictures" / "made" / "ledger.csv"
    with file.open("w", encoding="utf-8", newline="") as out:
        table = csv.writer(out)
        table.writerow(["statement", "place", "verdict", "standing", "as printed", "correct", "error", "measured", "proof"])
        for entry in entries():
            table.writerow([
                entry.label or entry.name, entry.place, entry.verdict, entry.standing,
                entry.formula or entry.printed, entry.corrected and entry.text("corrected"),
                entry.error, entry.measured, f"derivations/{entry.chapter}.py",
            ])  # fmt: skip
    return "{download}`The table of all statements of the paper (CSV) <../pictures/made/ledger.csv>`"


def _argument(entry):
    """Return after a colon why an entry is so, else the line that it rests on and what that finds."""
    lines = entry.decision().lines[-1:]
    said = _prose(entry.how.partition(": ")[2].rstrip(" ,"))
    if lines and not entry.text("why"):
        found = lines[0].value if lines[0].form is None else lines[0].form
        if isinstance(found, sp.Basic):
            equals = "= " if lines[0].text.rstrip().endswith("=") else ""
            said += f" ${equals}{latex(found)}$"
    return f": {said}" if said else ""


def _called(entry):
    """Return what a reader of the journal calls a statement: its number, else its name in words."""
    named = next(iter(entry.law.values()), entry.name)
    return f"Eq. {entry.number}" if entry.number else named.replace("_", " ").capitalize()


def _sentence(text):
    said = _prose(_numbered(text))
    return f"{said[0].upper()}{said[1:]}."  # a formula begins with a dollar sign


def _numbered(text):
    """Return a text with the numbers of equations in the place of the labels of the paper's source."""
    labels = {each.label: each.number for each in entries() if each.label and each.number}
    for label, number in labels.items():
        text = re.sub(rf"Eq\. \({label}\)", f"Eq. {number}", text)
        if "_" in label:
            text = re.sub(rf"`?\b{label}\b`?", f"Eq. {number}", text)
    return by_number(text)


def _equation(entry):
    return f"({entry.number})" if entry.number else _numbered(entry.place)


def right(_):
    """Return the numbered equations that follow from the model as they are printed."""
    rows = [
        (_equation(entry), f"${plain_latex(entry.formula)}$", f"[{entry.chapter}](#proof-{entry.chapter})")
        for entry in entries()
        if entry.number and entry.verdict in ("exact", "convention")
    ]
    return _table(["equation", "as printed, and right", "proof"], rows)


def corrected(verdicts):
    """Return the printed and the correct statements, and by how much they differ."""
    parts = []
    for entry in entries():
        if entry.verdict not in verdicts.split("_") or not (entry.corrected or entry.number):
            continue
        parts.append(f"### {_called(entry)}, {_numbered(entry.place)}")
        parts.append(f"**As printed:** {_numbered(_formula(entry.printed))}")
        if entry.corrected:
            parts.append(f"**Correct:** {with_formulas(_numbered(_formula(entry.text('corrected'))))}")
        printed, exact = value(entry), value(entry, corrected=True)
        if None not in (printed, exact) and printed != exact:
            parts.append(f"**In numbers:** {printed:.4g} as printed, {exact:.4g} correct.")
        if entry.error:
            parts.append(f"**Error:** {_sentence(entry.error)}")
        if entry.measured:
            parts.append(f"**Measured:** {_prose(_numbered(entry.measured))}.")
        parts.append(f"[Proof](#proof-{entry.chapter}){_argument(entry)}.")
    return "\n\n".join(parts)


def proofs(_):
    """Return the lines of every derivation."""
    parts = []
    for name in CHAPTERS:
        proof = proof_of(name)
        parts += [f"(proof-{name})=\n## {proof.title}", f"`derivations/{name}.py`"]
        if proof.assumptions:
            parts.append(f"Assumed: {_prose('; '.join(proof.assumptions))}.")
        for number, line in enumerate(proof.lines, 1):
            how = ": ".join(part for part in (line.standing, line.why) if part)
            parts.append(
                f"**{number}.** {_prose(line.text)}" + (f" *({_prose(how)})*" if how else "")
            )
            shown = line.value if line.form is None else line.form
            whole = isinstance(shown, int) and not isinstance(shown, bool)
            needed = whole and (shown or line.text.endswith((" is", " than", "by", "=", ",")))
            if needed or isinstance(shown, sp.Basic | sp.MatrixBase):
                parts.append(f"$$\n{latex(shown)}\n$$")
    return "\n\n".join(parts)


def carried(_):
    """Return which entries each premise of the model carries."""
    rows = [
        (f"`{name}`", *("x" if premise in refuting else "" for premise in PREMISES))
        for name, refuting in kept_premises().items()
    ]
    return _table(["refuted if", *PREMISES], rows, "searchable premises")


def kept_premises():
    """Return `derivations.ledger.premises`, from its file while the derivations stay as they were.

    All proofs under all changed premises take a minute; after a change they are made once, and kept.
    """
    sources = sorted([*DERIVATIONS.glob("*.py"), *DERIVATIONS.glob("*.toml")])
    digest = sha256("\0".join(path.read_text(encoding="utf-8") for path in sources).encode())
    kept = json.loads(KEPT_PREMISES.read_text(encoding="utf-8")) if KEPT_PREMISES.exists() else {}
    if kept.get("derivations") != digest.hexdigest():
        kept = {"derivations": digest.hexdigest(), "refuted without": premises()}
        KEPT_PREMISES.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    return kept["refuted without"]


def _prose(text):
    """Return a sentence with its formulas as LaTeX, and nothing else that Markdown would read."""
    parts = re.split(r"(\$.*?\$|`.*?`)", with_formulas(text))
    parts[::2] = [re.sub(r"([*_|<>\[\]])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


PARTS = {
    "api": api,
    "benchmark": benchmark,
    "columns": columns,
    "keys": keys,
    "scenes": scenes,
    "commands": commands,
    "laws": laws,
    "law_functions": law_functions,
    "law_parameters": law_parameters,
    "ledger": ledger,
    "proofs": proofs,
    "carried": carried,
    "right": right,
    "corrected": corrected,
}


def filled(text):
    """Return a page with its ``<<...>>`` lines filled, but not the lines of `shown`."""
    parts = "|".join(PARTS)
    return re.sub(
        rf"^<<({parts}) ?([\w.]*)>>$",
        lambda found: PARTS[found[1]](found[2]),
        text,
        flags=re.MULTILINE,
    )
