"""``exactcreep audit``: re-check a finished run from its events."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exactcreep.commands.options import Json, MaxSeconds
from exactcreep.commands.session import LIMIT_STATUS
from exactcreep.display import Display

FAILED_STATUS = 1


def audit(
    file: Annotated[
        Path, typer.Argument(metavar="RUN.nc", help="A result that recorded its events.")
    ],
    max_seconds: MaxSeconds = None,
    json: Json = False,
) -> None:
    """Re-check a finished run from its events: motion, contacts, static conditions, energy.

    Example:

        exactcreep run six-sliders-cycles --set drive.cycles=2 --record events --out run.nc

        exactcreep audit run.nc

    Exit status: 0 nothing was found, 1 the log contradicts the model, 2 bad input, 3 the time
    was over before everything was looked at.
    """
    from exactcreep.commands.answer import as_json
    from exactcreep.studies.audits.audit import audit_file

    with Display(quiet=json) as display:
        audits = audit_file(file, max_seconds=max_seconds, progress=display.show)
    if json:
        summaries = [found.summary() for found in audits]
        typer.echo(as_json(summaries[0] if len(summaries) == 1 else {"members": summaries}))
    else:
        for number, found in enumerate(audits, 1):
            name = f"member {number}: " if len(audits) > 1 else ""
            verdict = f"{len(found.findings)} findings" if found.findings else "nothing found"
            if found.reason:
                verdict = f"{found.reason}; {verdict}"
            known = found.summary()
            typer.echo(
                f"{name}{verdict} in {found.rearrangements} rearrangements, {found.events} events"
                f" (times off by at most {known['largest_time_error']:.2g},"
                f" energy by {found.balance:.2g})"
            )
            for finding in found.findings:
                typer.echo(f"  {_where(finding.rearrangement, finding.number)}{finding.sentence}")
    if any(found.findings for found in audits):
        raise typer.Exit(FAILED_STATUS)
    if any(found.reason for found in audits):
        raise typer.Exit(LIMIT_STATUS)


def _where(rearrangement: int | None, number: int | None) -> str:
    if rearrangement is None:
        return ""
    event = "" if number is None else f", event {number}"
    return f"rearrangement {rearrangement}{event}: "
