"""Run the audit: ``python -m derivations [--json] [--only LABEL] [--show] [--premise NAME]``."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import sympy as sp

from derivations.ledger import (
    CHAPTERS,
    Entry,
    by_number,
    disagreements,
    entries,
    gaps,
    premises,
    proof_of,
)
from derivations.model import MODEL, PREMISES, Model
from derivations.proof import STANDINGS, Line, Proof

SYMBOLS = (
    "c, s: cosine and sine of alpha; T_n: tension of spring n, in m g; lengths in g m/k, times in "
    "sqrt(m/k); m = mu_d c - s, a = mu_s c - s, D = (mu_s - mu_d) c"
)
HELP = {
    "--json": "print the ledger as a list of objects",
    "--show": "print the derivations in readable steps",
    "--premises": "print which entries each premise carries",
}


def _arguments(given: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m derivations",
        description="Derive every equation of the paper from the model, and say what holds.",
    )
    for name, text in HELP.items():
        parser.add_argument(name, action="store_true", help=text)
    text = "one entry (its number, label or name) or one chapter, with what backs it"
    parser.add_argument("--only", metavar="LABEL", help=text)
    text = "hold the ledger against a LaTeX source of the paper"
    parser.add_argument("--paper", metavar="FILE", type=Path, help=text)
    text = "change one premise of the model, and list all that is refuted then"
    parser.add_argument("--premise", choices=PREMISES, help=text)
    return parser.parse_args(given)


def _wrapped(text: str, first: str, indent: int) -> list[str]:
    return textwrap.wrap(
        text, 100, initial_indent=first, subsequent_indent=" " * indent, break_long_words=False
    )


def equations(proof: Proof) -> dict[int, str]:
    """Return the paper's equations that a line decides, by the identity of the line."""
    numbers = {entry.name: entry.number for entry in entries()}
    named: dict[int, list[int]] = {}
    for name, decision in proof.decisions.items():
        number = numbers.get(name)
        if number and decision.lines:
            named.setdefault(id(decision.lines[-1]), []).append(number)
    return {key: "Eq. " + ", ".join(map(str, decided)) for key, decided in named.items()}


def _shown(proof: Proof, lines: Sequence[Line]) -> Iterator[str]:
    """Yield lines of a proof as readable text, with the paper's equations that they decide."""
    decided = equations(proof)
    yield proof.title
    yield "=" * len(proof.title)
    yield from _wrapped(SYMBOLS, "", 0)
    yield from _wrapped("assumed: " + "; ".join(proof.assumptions), "", 9)
    for number, line in enumerate(lines, 1):
        standing = line.fault or ": ".join(filter(None, [line.standing, line.why]))
        how = f" [{standing}]" if standing else ""
        how += f"   {decided[id(line)]}" if id(line) in decided else ""
        value = line.value if line.form is None else line.form
        yield from _wrapped(by_number(line.text) + how * (value is None), f"{number:3d}. ", 5)
        if value is not None:
            yield from _wrapped(sp.sstr(value) + how, " " * 9, 9)
    yield ""


def _begun(entry: Entry, count: int) -> str:
    """Return what the lines of one entry show, and where the lines between them are."""
    equation = f"Eq. {entry.number}" if entry.number else "the statement"
    lines = "this line" if count == 1 else f"these {count} lines"
    return (
        f"The verdict on {equation} ({entry.label or entry.name}) is: {entry.verdict}. It follows "
        f"from {lines} of the chapter {entry.chapter}; --only {entry.chapter} shows the whole "
        "chapter."
    )


def _row(entry: Entry, whole: bool) -> Iterator[str]:
    loud = entry.verdict in ("misprint", "inconsistent")
    verdict = entry.verdict.upper() if loud else entry.verdict
    head = entry.label or f"({entry.name})"
    formula = "" if entry.judged else "in words"
    number = f"({entry.number})" if entry.number else ""
    yield f"{verdict:14s} {number:4s} {head:38s} {entry.standing:8s} {formula:8s} {entry.place}"
    body = {"printed": entry.printed, "correct": entry.corrected}
    if whole:
        measured = entry.measured and f"{entry.measured} ({entry.by})"
        body |= {"error": entry.error, "measured": measured, "if": "; ".join(entry.assumptions)}
        body["by"] = entry.how
    for name, text in body.items():
        if text and (whole or loud):
            yield from _wrapped(" ".join(text.split()), f"{name:>14s} ", 15)


def _table() -> Iterator[str]:
    """Yield the table of entries and premises."""
    for k, name in enumerate(PREMISES):
        yield "  " * k + f"+- {name}"
    for name, carried in premises().items():
        yield "".join("x " if premise in carried else ". " for premise in PREMISES) + name


def _summed(named: list[Entry], lines: Sequence[Line]) -> str:
    """Return the number of entries of each verdict, and of lines of each standing."""
    verdicts = Counter(entry.verdict for entry in named)
    said = ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in sorted(verdicts))
    of_entries = _counted(entry.standing for entry in named)
    words = sum(not entry.judged for entry in named)
    of_lines = _counted(line.standing for line in lines)
    count = f"{len(named)} statement{'s' * (len(named) != 1)}"
    return (
        f"\n{count}: {said}\nstanding: {of_entries}; {words} in words, with no "
        f"formula to judge\nlines: {of_lines}; {time.process_time():.0f} s"
    )


def _counted(standings: Iterable[str]) -> str:
    counts = Counter(standings)
    return ", ".join(f"{counts[word]} {word}" for word in STANDINGS if counts[word])


def _audit(named: list[Entry], arguments: argparse.Namespace, model: Model) -> int:
    """Print the selected entries, and return 1 if any of them is refuted under the model."""
    only = arguments.only
    chapters = [proof_of(name, model) for name in CHAPTERS if only in (None, name)]
    parts = [(proof, proof.lines) for proof in chapters] or [
        (proof_of(entry.chapter, model), entry.decision(model).shown) for entry in named
    ]
    lines = [line for _, shown in parts for line in shown]
    faults = [fault for entry in named for fault in entry.faults(model)]
    faults += gaps() if only is None else []
    # what an entry does not rest on cannot refute it
    if faults or chapters:
        faults += [f"{line.text}: {line.fault}" for line in lines if line.fault]
    for fault in faults:
        print(f"refuted: {fault}", file=sys.stderr)
    if faults:
        print(f"{len(faults)} statements are refuted", file=sys.stderr)
        return 1
    if arguments.json:
        print(json.dumps([entry.as_json() for entry in named], indent=1, ensure_ascii=False))
        return 0
    for place, (proof, shown) in enumerate(parts if arguments.show or only else []):
        if not chapters:
            print("\n".join(_wrapped(_begun(named[place], len(shown)), "", 0)), end="\n\n")
        print("\n".join(_shown(proof, shown)))
    for entry in named:
        print("\n".join(_row(entry, whole=only is not None)))
    print(_summed(named, lines))
    return 0


def main(given: Sequence[str] | None = None) -> int:
    """Run the audit; return 0 if everything holds, 1 if something does not, 2 for bad input."""
    arguments = _arguments(given)
    only, paper = arguments.only, arguments.paper
    names = {only, (only or "").removeprefix("Eq.").strip()}  # 22 and "Eq. 22" are equation 22
    named = [e for e in entries() if names & {None, e.chapter, e.label, e.name, f"{e.number}"}]
    if not named and only not in CHAPTERS:
        print(f"--only {only}: no label, name or chapter of the ledger", file=sys.stderr)
        return 2
    try:
        problems = disagreements(paper.read_text(encoding="utf-8")) if paper else []
    except (OSError, UnicodeDecodeError) as trouble:
        print(f"--paper {paper}: {trouble}", file=sys.stderr)
        return 2
    if arguments.premises:
        print("\n".join(_table()))
        return 0
    refuted = _audit(named, arguments, PREMISES.get(arguments.premise, MODEL))
    for problem in problems:
        print(problem, file=sys.stderr)
    if paper and not problems and not arguments.json:
        print(f"{paper}: every statement is verbatim, every numbered equation has an entry")
    return 1 if refuted or problems else 0


if __name__ == "__main__":
    sys.exit(main())
