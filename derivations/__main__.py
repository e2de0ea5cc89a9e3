"""Run the audit: ``python -m derivations [--json] [--only LABEL] [--show] [--paper FILE]``."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import sympy as sp

from derivations.ledger import SUBJECTS, disagreements, entries, subject_of, verified
from derivations.proof import Derivation, Entry, Refuted, Verification


def _arguments(given: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m derivations",
        description="Derive every equation of the paper from the model, and say what holds.",
    )
    parser.add_argument("--json", action="store_true", help="print the ledger as a list of objects")
    parser.add_argument(
        "--only",
        metavar="LABEL",
        help="one entry (its label or name) or one subject, with what backs it",
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
    return parser.parse_args(given)


def _chosen(only: str | None) -> tuple[tuple[Entry, ...], tuple[str, ...]]:
    """Return the entries and subjects that are asked for."""
    everything = entries()
    if only is None:
        return everything, tuple(SUBJECTS)
    if only in SUBJECTS:
        return tuple(entry for entry in everything if subject_of(entry) == only), (only,)
    found = tuple(entry for entry in everything if only in (entry.label, entry.name))
    return found, tuple(dict.fromkeys(subject_of(entry) for entry in found))


def _shown(derivation: Derivation) -> str:
    lines = [derivation.title, "=" * len(derivation.title)]
    if derivation.assumptions:
        lines.append("Assumptions: " + "; ".join(derivation.assumptions))
    for number, step in enumerate(derivation.steps, 1):
        lines += textwrap.wrap(
            step.text, 96, initial_indent=f"{number:3d}. ", subsequent_indent=" " * 5
        )
        if step.expression is not None:
            lines += textwrap.wrap(
                sp.sstr(step.expression), 92, initial_indent=" " * 9, subsequent_indent=" " * 9
            )
    return "\n".join(lines)


def _claims(verification: Verification) -> str:
    lines = [f"{verification.subject}: " + "; ".join(verification.assumptions)]
    for claim in verification.claims:
        lines += textwrap.wrap(
            f"{claim.standing:8s} {claim.text} [{claim.how}]",
            98,
            initial_indent="  ",
            subsequent_indent=" " * 11,
        )
    return "\n".join(lines)


def _row(entry: Entry) -> str:
    head = entry.label or f"({entry.name})"
    loud = entry.verdict in ("misprint", "inconsistent")
    verdict = entry.verdict.upper() if loud else entry.verdict
    lines = [f"{verdict:14s}{head:44s}{entry.place}"]
    body = [("printed", " ".join((entry.formula or entry.printed).split()))]
    if entry.corrected:
        body.append(("correct", " ".join(entry.corrected.split())))
    if entry.error:
        body.append(("error", entry.error))
    if entry.assumptions:
        body.append(("if", "; ".join(entry.assumptions)))
    body.append(("by" if entry.proved else "by (verified)", entry.how))
    for name, text in body:
        lines += textwrap.wrap(
            f"{name:8s}{text}",
            98,
            initial_indent=" " * 14,
            subsequent_indent=" " * 22,
            break_long_words=False,
        )
    return "\n".join(lines)


def main(given: Sequence[str] | None = None) -> int:
    """Run the audit; return 0 if everything holds, 1 if something does not, 2 for bad input."""
    arguments = _arguments(given)
    chosen, subjects = _chosen(arguments.only)
    if not chosen and not subjects:
        print(f"--only {arguments.only}: no label, name or subject of the ledger", file=sys.stderr)
        return 2
    source = None
    if arguments.paper is not None:
        try:
            source = arguments.paper.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as trouble:
            print(f"--paper {arguments.paper}: {trouble}", file=sys.stderr)
            return 2
    started = time.perf_counter()
    verifications = []
    try:
        for name in subjects:
            verifications.append(verified(name))
        for entry in chosen:
            entry.check()
    except Refuted as refuted:
        print(f"refuted: {refuted}", file=sys.stderr)
        return 1
    problems = disagreements(source) if source is not None else []
    if arguments.json:
        print(json.dumps([entry.as_json() for entry in chosen], indent=1, ensure_ascii=False))
    else:
        if arguments.show:
            print("\n\n".join(_shown(SUBJECTS[name].derive()) for name in subjects), end="\n\n")
        print("\n".join(_claims(verification) for verification in verifications), end="\n\n")
        print("\n".join(_row(entry) for entry in chosen), end="\n\n")
        counts = Counter(entry.verdict for entry in chosen)
        standings = Counter(claim.standing for v in verifications for claim in v.claims)
        print(
            f"{len(chosen)} statements: "
            + ", ".join(f"{counts[verdict]} {verdict}" for verdict in sorted(counts))
            + f"; {standings['proved']} claims proved, "
            + f"{standings['verified']} verified over stated cases, "
            + f"{standings['argued']} argued from them; "
            + f"{time.perf_counter() - started:.0f} s"
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
