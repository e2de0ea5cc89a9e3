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

from derivations.entry import Entry
from derivations.ledger import (
    CHAPTERS,
    disagreements,
    entries,
    premises,
    proof_of,
)
from derivations.model import MODEL, PREMISES, Model
from derivations.proof import STANDINGS, Line, Proof

SYMBOLS = (
    "c, s: cosine and sine of alpha; T_n: tension of spring n, in m g; lengths in g m/k, times in "
    "sqrt(m/k); m = mu_d c - s, a = mu_s c - s, D = (mu_s - mu_d) c"
)


def _arguments(given: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m derivations",
        description="Derive every equation of the paper from the model, and say what holds.",
    )
    parser.add_argument("--json", action="store_true", help="print the ledger as a list of objects")
    parser.add_argument(
        "--only",
        metavar="LABEL",
        help="one entry (its label or name) or one chapter, with what backs it",
    )
    parser.add_argument(
        "--show", action="store_true", help="print the derivations in readable steps"
    )
    parser.add_argument(
        "--paper",
        metavar="FILE",
        type=Path,
        help="hold the ledger against a LaTeX source of the paper",
    )
    parser.add_argument(
        "--premise",
        choices=PREMISES,
        help="change one premise of the model, and list all that is refuted then",
    )
    parser.add_argument(
        "--premises", action="store_true", help="print which entries each premise carries"
    )
    return parser.parse_args(given)


def _wrapped(text: str, first: str, indent: int) -> list[str]:
    return textwrap.wrap(
        text, 100, initial_indent=first, subsequent_indent=" " * indent, break_long_words=False
    )


def _shown(proof: Proof, lines: Iterable[Line]) -> list[str]:
    """Return lines of a proof as one reads them."""
    text = [proof.title, "=" * len(proof.title), *_wrapped(SYMBOLS, "", 0)]
    text += _wrapped("assumed: " + "; ".join(proof.assumptions), "", 9)
    for number, line in enumerate(lines, 1):
        how = f" [{line.standing}{': ' + line.why if line.why else ''}]" if line.standing else ""
        text += _wrapped(line.text + ("" if line.form is not None else how), f"{number:3d}. ", 5)
        shown = line.value if line.form is None else line.form
        if shown is not None:
            ending = how if line.form is not None else ""
            text += _wrapped(sp.sstr(shown) + ending, " " * 9, 9)
    return text


def _leading_to(entry: Entry, model: Model) -> list[Line]:
    """Return the lines of a part up to the last one that an entry rests on."""
    proof = entry.derive(model)
    lines = proof.lines
    try:
        used = {id(line) for line in entry.backing(model)[1]} if entry.backed else set()
    except Exception:  # a changed premise leaves it nothing to rest on
        return lines
    last = max((k for k, line in enumerate(lines) if id(line) in used), default=-1)
    return lines[max(start for start in proof.starts if start <= max(last, 0)) : last + 1]


def _row(entry: Entry, whole: bool) -> Iterator[str]:
    loud = entry.verdict in ("misprint", "inconsistent")
    verdict = entry.verdict.upper() if loud else entry.verdict
    head = entry.label or f"({entry.name})"
    yield f"{verdict:14s} {head:38s} {entry.place:24s} {entry.standing}".rstrip()
    body = [
        ("printed", " ".join(entry.printed.split())),
        ("correct", " ".join((entry.corrected or "").split())),
        ("error", entry.error or ""),
        ("if", "; ".join(entry.assumptions)),
        ("by", entry.how),
    ]
    for name, text in body:
        if text and (whole or (loud and name in ("printed", "correct"))):
            yield from _wrapped(text, f"{name:>14s} ", 15)


def _table() -> Iterator[str]:
    """Yield the table of entries and premises."""
    for k, name in enumerate(PREMISES):
        yield "  " * k + f"+- {name}"
    for name, carried in premises().items():
        yield "".join("x " if premise in carried else ". " for premise in PREMISES) + name


def main(given: Sequence[str] | None = None) -> int:
    """Run the audit; return 0 if everything holds, 1 if something does not, 2 for bad input."""
    arguments = _arguments(given)
    only, everything = arguments.only, entries()
    named = [e for e in everything if only in (None, e.chapter, e.label, e.name)]
    if not named and only not in CHAPTERS:
        print(f"--only {only}: no label, name or chapter of the ledger", file=sys.stderr)
        return 2
    source = None
    if arguments.paper is not None:
        try:
            source = arguments.paper.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as trouble:
            print(f"--paper {arguments.paper}: {trouble}", file=sys.stderr)
            return 2
    if arguments.premises:
        print("\n".join(_table()))
        return 0
    started = time.process_time()
    model = PREMISES[arguments.premise] if arguments.premise else MODEL
    whole = only is None or only in CHAPTERS
    parts = (
        [
            (proof, proof.lines)
            for name in CHAPTERS
            if only in (None, name)
            for proof in [proof_of(name, model)]
        ]
        if whole
        else [(entry.derive(model), _leading_to(entry, model)) for entry in named]
    )
    faults = [
        f"{proof.title}: {line.text}: {line.fault}"
        for proof, lines in parts
        for line in lines
        if line.fault
    ]
    faults += [fault for entry in named for fault in entry.faults(model)]
    for fault in faults:
        print(f"refuted: {fault}", file=sys.stderr)
    if faults:
        print(f"{len(faults)} statements are refuted", file=sys.stderr)
        return 1
    problems = disagreements(source) if source is not None else []
    if arguments.json:
        print(json.dumps([entry.as_json() for entry in named], indent=1, ensure_ascii=False))
    else:
        if arguments.show or only is not None:
            print("\n\n".join("\n".join(_shown(*part)) for part in parts), end="\n\n")
        for entry in named:
            print("\n".join(_row(entry, whole=only is not None)))
        counts = Counter(entry.verdict for entry in named)
        standings = Counter(line.standing for _, lines in parts for line in lines)
        print(
            f"\n{len(named)} statements: "
            + ", ".join(f"{counts[verdict]} {verdict}" for verdict in sorted(counts))
            + "; claims: "
            + ", ".join(f"{standings[word]} {word}" for word in STANDINGS)
            + f"; {time.process_time() - started:.0f} s"
        )
    for problem in problems:
        print(problem, file=sys.stderr)
    if source is not None and not problems and not arguments.json:
        print(
            f"{arguments.paper}: every statement is verbatim, every labelled equation has an entry"
        )
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
