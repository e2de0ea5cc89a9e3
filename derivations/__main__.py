"""Run the audit: ``python -m derivations [--json] [--only LABEL] [--show] [--premise NAME]``."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import sympy as sp

from derivations.ledger import CHAPTERS, Entry, disagreements, entries, premises, proof_of
from derivations.model import MODEL, PREMISES, Model
from derivations.proof import STANDINGS, Line

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
    text = "one entry (its label or name) or one chapter, with what backs it"
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


def _shown(title: str, assumptions: Sequence[str], lines: Sequence[Line]) -> Iterator[str]:
    """Yield lines of a proof as one reads them."""
    yield title
    yield "=" * len(title)
    yield from _wrapped(SYMBOLS, "", 0)
    yield from _wrapped("assumed: " + "; ".join(assumptions), "", 9)
    for number, line in enumerate(lines, 1):
        reason = f": {line.why}" if line.why else ""
        standing = line.fault or line.standing + reason
        how = f" [{standing}]" if standing else ""
        value = line.value if line.form is None else line.form
        yield from _wrapped(line.text + ("" if line.form is not None else how), f"{number:3d}. ", 5)
        if value is not None:
            yield from _wrapped(sp.sstr(value) + how * (line.form is not None), " " * 9, 9)
    yield ""


def _row(entry: Entry, whole: bool) -> Iterator[str]:
    loud = entry.verdict in ("misprint", "inconsistent")
    verdict = entry.verdict.upper() if loud else entry.verdict
    head = entry.label or f"({entry.name})"
    yield f"{verdict:14s} {head:38s} {entry.place:24s} {entry.standing}".rstrip()
    body = {"printed": entry.printed, "correct": entry.corrected}
    if whole:
        body |= {"error": entry.error, "if": "; ".join(entry.assumptions), "by": entry.how}
    for name, text in body.items():
        if text and (whole or loud):
            yield from _wrapped(" ".join(text.split()), f"{name:>14s} ", 15)


def _table() -> Iterator[str]:
    """Yield the table of entries and premises."""
    for k, name in enumerate(PREMISES):
        yield "  " * k + f"+- {name}"
    for name, carried in premises().items():
        yield "".join("x " if premise in carried else ". " for premise in PREMISES) + name


def _report(named: list[Entry], only: str | None, show: bool, model: Model) -> int:
    """Print what was asked for, and return 1 if anything of it is refuted under the model."""
    started = time.process_time()
    chapters = [name for name in CHAPTERS if only in (None, name)]
    faults = [fault for entry in named for fault in entry.faults(model)]
    if chapters:
        lines = [line for name in chapters for line in proof_of(name, model).lines]
    else:
        lines = [line for entry in named for line in entry.decision(model).shown]
    # what an entry does not rest on cannot refute it
    if faults or chapters:
        faults += [f"{line.text}: {line.fault}" for line in lines if line.fault]
    for fault in faults:
        print(f"refuted: {fault}", file=sys.stderr)
    if faults:
        print(f"{len(faults)} statements are refuted", file=sys.stderr)
        return 1
    for name in chapters if show or only else []:
        proof = proof_of(name, model)
        print("\n".join(_shown(proof.title, proof.assumptions, proof.lines)))
    for entry in [] if chapters else named:
        proof, shown = proof_of(entry.chapter, model), entry.decision(model).shown
        print("\n".join(_shown(proof.title, proof.assumptions, shown)))
    for entry in named:
        print("\n".join(_row(entry, whole=only is not None)))
    verdicts = Counter(entry.verdict for entry in named)
    standings = Counter(line.standing for line in lines)
    said = ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in sorted(verdicts))
    claims = ", ".join(f"{standings[word]} {word}" for word in STANDINGS)
    seconds = time.process_time() - started
    print(f"\n{len(named)} statements: {said}; claims: {claims}; {seconds:.0f} s")
    return 0


def main(given: Sequence[str] | None = None) -> int:
    """Run the audit; return 0 if everything holds, 1 if something does not, 2 for bad input."""
    arguments = _arguments(given)
    only = arguments.only
    named = [e for e in entries() if only in (None, e.chapter, e.label, e.name)]
    if not named and only not in CHAPTERS:
        print(f"--only {only}: no label, name or chapter of the ledger", file=sys.stderr)
        return 2
    try:
        source = arguments.paper.read_text(encoding="utf-8") if arguments.paper else None
    except (OSError, UnicodeDecodeError) as trouble:
        print(f"--paper {arguments.paper}: {trouble}", file=sys.stderr)
        return 2
    model = PREMISES.get(arguments.premise, MODEL)
    if arguments.premises:
        print("\n".join(_table()))
        return 0
    if arguments.json:
        faults = [fault for entry in named for fault in entry.faults(model)]
        print("\n".join(f"refuted: {fault}" for fault in faults), file=sys.stderr)
        if faults:
            return 1
        print(json.dumps([entry.as_json() for entry in named], indent=1, ensure_ascii=False))
    elif _report(named, only, arguments.show, model):
        return 1
    problems = disagreements(source) if source is not None else []
    for problem in problems:
        print(problem, file=sys.stderr)
    if source is not None and not problems and not arguments.json:
        said = "every statement is verbatim, every labelled equation has an entry"
        print(f"{arguments.paper}: {said}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
