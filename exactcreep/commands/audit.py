"""``exactcreep audit``: re-check a finished run from its events."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exactcreep.commands.answer import FAILED, LIMIT, as_json
from exactcreep.commands.options import Json, MaxSeconds, argument, command
from exactcreep.display import Display


@command()
def audit(
    file: Annotated[Path, argument("RUN.nc", "A result that recorded its events.")],
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
    from exactcreep.studies.audits.audit import audit_file

    with Display(quiet=json) as display:
        audits = audit_file(file, max_seconds=max_seconds, progress=display.show)
    if json:
        summaries = [found.summary() for found in audits]
        typer.echo(as_json(summaries[0] if len(summaries) == 1 else {"members": summaries}))
    for number, found in enumerate(audits if not json else [], 1):
        name = f"member {number}: " if len(audits) > 1 else ""
        over = f"{found.reason}; " if found.reason else ""
        verdict = f"{len(found.findings)} findings" if found.findings else "nothing found"
        typer.echo(
            f"{name}{over}{verdict} in {found.rearrangements} rearrangements, {found.events} events"
            f" (times off by at most {found.summary()['largest_time_error']:.2g},"
            f" energy by {found.balance:.2g})"
        )
        for finding in found.findings:
            where = ""
            if finding.rearrangement is not None:
                event = "" if finding.number is None else f", event {finding.number}"
                where = f"rearrangement {finding.rearrangement}{event}: "
            typer.echo(f"  {where}{finding.sentence}")
    if any(found.findings for found in audits):
        raise typer.Exit(FAILED)
    if any(found.reason for found in audits):
        raise typer.Exit(LIMIT)
