"""Commands that are public functions: what they take, and their help, are those of the function."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import typer

import exactcreep
from exactcreep.commands.answer import (
    FAILED,
    LIMIT,
    Drawing,
    as_json,
    complain,
    say_summary,
    shown,
)
from exactcreep.commands.options import GROUPS, expanded, public


def start_of(*, start_tension: str | None = None) -> str | None:
    """Return the tension at the start.

    Parameters
    ----------
    start_tension : number
        Tension of every spring at the start; default the relaxed chain.
    """
    return start_tension


GROUPS["State | None"] = start_of


def question(name: str, draw: str, output: str, *examples: str) -> Callable[..., None]:
    """Return the command that asks a public function of a chain.

    Parameters
    ----------
    name : str
        Of the function.
    draw : str
        What draws the answer, as ``module:function`` of `exactcreep.figures`.
    output : str
        The group of options that says where the answer goes.
    *examples : str
        Options, as they are written.

    Notes
    -----
    Its exit status is 3 where the function gives up, or has a reason to come back early.
    """
    told = public(name)
    signature = inspect.signature(told)
    asked = inspect.Parameter("output", inspect.Parameter.KEYWORD_ONLY, annotation=output)
    told.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[*signature.parameters.values(), asked]
    )
    told.__doc__ = _with_examples(name, inspect.getdoc(told) or "", examples)
    timed = "max_seconds" in signature.parameters

    def ask(*, chain: Any, output: Drawing, start: str | None = None, **given: Any) -> None:
        words = {key: value for key, value in given.items() if value is not None}
        if start is not None:
            words["start"] = exactcreep.State.prepared(chain, [start] * (chain.n - 1))
        words |= {"max_seconds": given["max_seconds"]} if timed else {}
        try:
            found = output.answer(partial(getattr(exactcreep, name), chain, **words), draw)
        except exactcreep.GivenUp as limit:
            complain(str(limit))
            raise typer.Exit(LIMIT) from None
        limited = exactcreep.Outcome.LIMIT
        if found.outcome is limited if hasattr(found, "outcome") else found.reason:
            raise typer.Exit(LIMIT)

    return expanded(ask, told, pictures=True)


def _with_examples(name: str, text: str, examples: tuple[str, ...]) -> str:
    command = name.replace("_", "-")
    lines = "\n\n".join(f"    exactcreep {command} {line}" for line in examples)
    status = "Exit status: 0 answered, 2 bad input, 3 a limit was reached (what is known is shown)."
    said, parameters, rest = text.partition("\n\nParameters\n")
    return f"{said}\n\nExamples:\n\n{lines}\n\n{status}{parameters}{rest}"


def audit(run: Path, *, max_seconds: str | None = None, json: bool = False) -> None:
    """Re-check a finished run from its events: motion, contacts, static conditions, energy.

    Example:

        exactcreep audit run.nc

    Exit status: 0 nothing was found, 1 the log contradicts the model, 2 bad input, 3 the time
    was over before everything was looked at.

    Parameters
    ----------
    run : RUN.nc
        A result that recorded its events.
    """
    from exactcreep.studies.audit import audit_file

    with shown(quiet=json) as display:
        audits = audit_file(run, max_seconds=max_seconds, progress=display.show)
    summaries = [found.summary() for found in audits]
    if json:
        typer.echo(as_json(summaries[0] if len(summaries) == 1 else {"members": summaries}))
    for number, summary in enumerate(summaries if not json else [], 1):
        if len(summaries) > 1:
            typer.echo(f"member {number}")
        say_summary(summary)
    if any(found.findings for found in audits):
        raise typer.Exit(FAILED)
    if any(found.reason for found in audits):
        raise typer.Exit(LIMIT)


QUESTIONS: dict[str, tuple[str, ...]] = {
    "threshold": (
        "thresholds:draw_threshold",
        "Output",
        "--n 3 --digits 40",
        "--n 5 --after 20 --windows --refine 3 --json",
    ),
    "half-life": ("thresholds:draw_threshold", "Output", "--n 6 --plot survival.png"),
    "intercept": ("thresholds:draw_threshold", "Output", "--n 30 --sigma-mu 0.01 --fit 1.3 2"),
    "fate": (
        "fates:draw_fate",
        "Drawing",
        "--n 5 --amplitude 0.000765",
        "--n 6 --amplitude 0.000969 --solver exact --plot fate.png",
    ),
    "survival": (
        "fates:draw_survival",
        "Output",
        "--n 6 --amplitude 0.000969",
        "--n 6 --amplitude 0.000984 --cycles 50000 --plot lives.png",
    ),
}
"""The public functions that are commands: what draws their answers, and examples of options."""
