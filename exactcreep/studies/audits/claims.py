"""What a run says about itself, held against what its events make.

Rows at targets and of tables, counts, outcome, evidence and velocities follow from the motion: a
`Measurement` is made again, of the motion that the auditor has followed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.enclosure import as_claimed, enclosure, floats, quantity
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.runaway import NEVER_RESTS, NEVER_STOPS, never_rests
from exactcreep.quasistatic.measurement import NEARLY, Measurement
from exactcreep.quasistatic.result import Creep
from exactcreep.solvers.auto import concluded
from exactcreep.solvers.solver import Stretch
from exactcreep.solvers.tables import (
    COLUMNS,
    ENERGY,
    EVENT_TABLE,
    LOGS,
    NUMBER,
    REARRANGEMENT_TABLE,
    SLIP_TABLE,
    Schema,
    record_arrays,
    rows_of,
)
from exactcreep.studies.audits.motion import ACCURACY, ROUNDING, Auditor, exact
from exactcreep.studies.trajectory import LoggedRearrangement

Columns = Mapping[str, NDArray[Any]]


def check_tables(auditor: Auditor, result: Creep) -> None:
    """Check that what was recorded is there, whole, and the same in floats and in decimals."""
    recorded, n = result.recorded, result.chain.n
    asked = dict.fromkeys(result.experiment.record, ())
    expected = {quantity(name) for name in record_arrays(asked, n)}
    for name in sorted(expected ^ {quantity(name) for name in recorded}):
        auditor.find("state", f"{name} was recorded, or was not, against what was asked for")
    if not 0 <= result.half_cycles <= result.drive.half_cycles:
        auditor.find("claim", f"the drive has no target {result.half_cycles}")
    lengths = {
        name: len(recorded.get(next(iter(table.columns)), ()))
        for table in LOGS.values()
        for name in table.columns
    }
    sizes = {"slider": n, "spring": n - 1}
    for name, values in recorded.items():
        length = lengths.get(quantity(name), result.half_cycles)
        shape = (length, *(sizes[across] for across in COLUMNS[quantity(name)].across))
        if values.shape != shape:
            auditor.find("state", f"{name} has the shape {values.shape} instead of {shape}")
    if auditor.findings:
        return
    for name, known in as_claimed(recorded).items():
        if known.dtype == object:
            near, given = floats(known).ravel(), recorded[name].ravel()
            room = np.array([float(x.radius) for x in known.ravel().tolist()])
            if (np.abs(near - given) > room + 2.0**-50 * np.abs(near)).any():
                auditor.find("state", f"{name} and its decimals are not the same numbers")


def check_order(auditor: Auditor, columns: Columns, log: Sequence[LoggedRearrangement]) -> None:
    """Check that events are numbered in order, and say the same of all their sliders."""
    rows = [
        row
        for number, one in enumerate(log)
        for place, event in enumerate(one.events)
        for row in rows_of(event, one.half_cycle, number, place, one.theta)
    ]
    for name, made in zip(EVENT_TABLE.columns, zip(*rows, strict=True), strict=False):
        one, other = list(made), columns[name].tolist()
        if name == "event_theta":  # which certified encloses anew, wider, in mid-rearrangement
            one, other = list(map(exact, one)), list(map(exact, other))
        if one != other:
            auditor.find("order", f"{name} is not what events in order have")


def follow(
    auditor: Auditor, result: Creep, columns: Columns, log: Sequence[LoggedRearrangement],
    say: Callable[..., None],
) -> None:  # fmt: skip
    """Take the auditor along the drive of a run, and a measurement with it; then compare."""
    arithmetic, partial = auditor.arithmetic, result.outcome in (Outcome.RUNAWAY, Outcome.LIMIT)
    measured = Measurement(result.experiment)
    followed = SimpleNamespace(
        tally=auditor.tally, state=lambda: auditor.state, evidence=result.evidence, report=dict,
        twin=lambda: None, capture=dict,
    )  # fmt: skip
    measured.simulation = followed  # type: ignore[assignment]
    tables: dict[Schema[Any], list[Any]] = {REARRANGEMENT_TABLE: auditor.rows,
                                            SLIP_TABLE: auditor.slip_rows}  # fmt: skip
    r = 0
    for q in range(1, min(result.half_cycles + partial, result.drive.half_cycles) + 1):
        target = arithmetic.number(result.drive.exact_target(q, result.seed))
        auditor.slips[:] = 0
        while r < len(log) and log[r].half_cycle == q:
            one = log[r]
            auditor.place = (r, None)
            say("auditing", r, len(log), "rearrangements")
            theta, radius = enclosure(one.theta)
            error = float(radius * result.chain.l0)
            if arithmetic is FLOAT64:
                error += 4 * 2.0**-52 * max(auditor.load, abs(float(theta * result.chain.l0)))
            auditor.room = auditor.floor() + error
            ramped = r > 0 or auditor.stable()
            auditor.ramp(arithmetic.number(theta), target, auditor.room, "a rearrangement")
            auditor.way *= ramped
            ended = r + 1 < len(log) or not partial
            auditor.rearrangement(one.events, error, ended=ended, half_cycle=q)
            for table, rows in tables.items():
                if not table.columns.keys() & columns.keys():
                    rows.clear()  # nobody has recorded them
            r += 1
        auditor.place = (None, None)
        if q <= result.half_cycles:
            auditor.ramp(target, target, auditor.room, "a target")
            auditor.rests(f"theta reaches target {q}")
            state = auditor.state
            x_G = np.array([sum(state.displacements.tolist()) / result.chain.n])
            made = {
                "x": state.displacements, "tension": state.tensions, "x_G": x_G,
                "slips": auditor.slips,
            }  # fmt: skip
            for name in sorted(made.keys() & columns.keys()):
                text = f"recorded {name} at target {q}"
                _same(auditor, text, made[name], columns[name][q - 1 : q].ravel())
            measured.take(Stretch(1, {"x_G": x_G, "x": state.displacements[None, :]}))
    if r < len(log):
        auditor.find("order", f"{len(log) - r} rearrangements belong to no half-cycle")
    for table, rows in tables.items():
        last_may_lack = partial and table is REARRANGEMENT_TABLE
        _compare_table(auditor, table, rows, columns, partial=last_may_lack)
    if result.outcome is not Outcome.RUNAWAY:  # it goes on moving until that is proved
        compare_end(auditor, result.state)
    _compare_claims(auditor, result, measured)


def _compare_table(
    auditor: Auditor, table: Schema[Any], rows: Sequence[Any], columns: Columns, *, partial: bool
) -> None:
    """Compare a table; of a run that ends early it may or may not have the last rearrangement."""
    made = table.from_rows(rows)
    for name, column in table.columns.items():
        if name not in columns or name == "rearrangement_undecided":
            continue
        whole = min(len(rows), len(columns[name])) if partial else len(rows)
        if abs(len(columns[name]) - whole) > partial:
            auditor.find("state", f"{name} has {len(columns[name])} rows instead of {whole}")
        scale = 1.0
        if column.unit == ENERGY:  # products of tensions and displacements
            scale += float(np.abs(floats(made[name])).max(initial=0.0))
        elif column.unit == NUMBER:  # theta and coefficients, which no error of events touches
            scale = 0.0
        _same(auditor, name, made[name][:whole], columns[name][:whole], scale)


def _same(
    auditor: Auditor, what: str, made: NDArray[Any], given: NDArray[Any], scale: float = 1.0
) -> None:
    """Compare numbers; whole ones exactly, others as well as errors of events add up."""
    if made.dtype.kind == "i":
        if not np.array_equal(made, given):
            auditor.find("state", f"{what} is not what the events make")
        return
    for here, there in zip(made.tolist(), given.tolist(), strict=True):
        known, value = enclosure(there), exact(here)
        allowed = max(ACCURACY if isinstance(there, float) else 0.0, auditor.accuracy)
        room = allowed * (1 + len(auditor.radii)) ** 0.5 * auditor.scale + auditor.room
        room = room * scale + 2.0**-50 * abs(float(value)) * (auditor.arithmetic is FLOAT64)
        text = f"{what} is not what the events make"
        error = float(abs(value - known.middle))
        auditor.within("state", text, error, room + float(known.radius))


def compare_end(auditor: Auditor, state: State) -> None:
    """Compare the final state."""
    present = auditor.state
    _same(auditor, "the final tension", present.tensions, state.tensions)
    _same(auditor, "the final displacement", present.displacements, state.displacements)
    off = abs(exact(present.theta) - exact(state.theta)) * auditor.chain.l0
    rounding = 2.0**-49 * auditor.load + auditor.accuracy * (auditor.arithmetic is not FLOAT64)
    text = "the final theta is not where the drive took it"
    auditor.within("state", text, float(off), rounding)
    if not np.array_equal(present.draws, state.draws):
        auditor.find("state", "the number of draws is not what the stops make")
    elif not np.array_equal(present.coefficients, state.coefficients):
        auditor.find("state", "the final coefficients are not those of the last draws")


def _compare_claims(auditor: Auditor, result: Creep, measured: Measurement) -> None:
    """Compare what a run says about itself with what `measured` finds on the same way."""
    auditor.tally.undecided = result.undecided
    whole = result.half_cycles == result.drive.half_cycles
    in_motion = auditor.replay is not None and bool(auditor.replay.flow.signs.any())
    if result.solver not in ("exact", "auto"):
        auditor.tally.long_rearrangements = 0
    elif in_motion and auditor.tally.long_rearrangements:
        auditor.tally.long_rearrangements -= auditor.long  # it has not ended
    if not whole or in_motion:
        measured.outcome, measured.reason = result.outcome, result.reason
    # the solver saw whether tensions came back exactly; here they are rounded anew
    measured.unseen = ROUNDING * auditor.scale * (1 + len(auditor.radii))
    own = measured.result()
    if whole and not in_motion:
        doubtful = _behaves(auditor, result, measured)
    else:
        doubtful = False
        _ends_early(auditor, result)
    solver, since = str(result.report.get("chosen", result.solver)), result.undecided_from
    long = solver == "exact" and bool(own.long_rearrangements or (in_motion and auditor.long))
    counted = int(result.undecided) + int(long) + since
    best = Evidence.PROVED if solver == "certified" else Evidence.COMPUTED
    evidence = Evidence.of(counted + doubtful, best)
    made: dict[str, Any] = {
        name: count for name, count in own.counts.items() if not name.startswith("undecided")
    }
    claimed: dict[str, Any] = {name: result.counts[name] for name in made}
    made |= {"warnings": dict(own.warnings), "evidence": evidence.value}
    claimed |= {"warnings": dict(result.warnings), "evidence": result.evidence.value}
    concluding = concluded(result.report, result.velocity, result.velocity_error)
    if "ties_assumed" in result.report:
        concluding = {"ties_assumed": result.undecided, **concluding}
    made |= concluding
    claimed |= {name: result.report.get(name) for name in concluding}
    for name, found in made.items():
        if claimed[name] != found:
            auditor.find("claim", f"{name} is {claimed[name]}, and the events make it {found}")
    if not 0 <= since <= result.half_cycles + 1 or (counted > 0 and since == 0):
        auditor.find("claim", f"the run is {evidence.value}, from {since} on")
    trusted = result.trusted_half_cycles
    if trusted is not None and not 0 <= trusted <= result.half_cycles:
        auditor.find("claim", f"{trusted} half-cycles are trusted of {result.half_cycles}")
    if result.undecided < 0:
        auditor.find("claim", f"undecided is {result.undecided}")
    _compare_velocities(auditor, result, own)


def _behaves(auditor: Auditor, result: Creep, measured: Measurement) -> bool:
    """Check what a run to the end of its drive says of the end; return if that is undecided."""
    measured.outcome = None
    exactly = measured.behaviour(auditor.state)
    measured.unseen = 0.0
    nearly = result.reason.startswith(NEARLY)
    claimed = result.outcome, result.since
    for found in (exactly, measured.behaviour(auditor.state)):
        settled = nearly and found.velocity is not None
        if claimed == (found.outcome, found.since) and (result.reason == found.reason or settled):
            return found.doubtful or nearly
    sentence = f"the outcome {result.outcome.value} ({result.reason!r}) is not the run's"
    auditor.find("claim", sentence)
    return False


def _ends_early(auditor: Auditor, result: Creep) -> None:
    """Check why a run says that it ended before its drive."""
    proofs = (NEVER_STOPS, NEVER_RESTS)
    if result.outcome is Outcome.RUNAWAY:
        if result.reason not in proofs or not _runs_away(auditor):
            auditor.find("claim", "nothing proves that the chain runs away")
    elif result.outcome is not Outcome.LIMIT or result.reason in ("", *proofs):
        auditor.find("claim", f"the run ends early, and calls it {result.outcome.value}")


def _runs_away(auditor: Auditor) -> bool:
    """Return whether a chain in motion can be one that never comes to rest."""
    if auditor.replay is None:
        return False
    chain, state, flow = auditor.chain, auditor.state, auditor.replay.flow
    down = 1 if chain.tan_alpha >= 0 else -1
    if chain.may_run_away and (flow.signs == down).all():
        return True
    largest = max(map(auditor.contacts.acting, state.coefficients.tolist()))
    return never_rests(
        auditor.arithmetic, chain, state.tensions, flow.velocities, flow.signs, largest,
        auditor.floor(),
    )  # fmt: skip


def _compare_velocities(auditor: Auditor, result: Creep, own: Creep) -> None:
    """Compare the mean velocity and its standard error."""
    room = auditor.accuracy * (1 + len(auditor.radii)) ** 0.5 * auditor.scale + auditor.room
    room += 2.0**-48 * (1 + abs(float(exact(auditor.state.displacements[0]))))
    for name, claimed, found, allowed in (
        ("velocity", result.velocity, own.velocity, room),
        ("velocity_error", result.velocity_error, own.velocity_error, room / 2),
    ):
        if claimed != found and not (math.isnan(claimed) and math.isnan(found)):
            error, text = abs(claimed - found), f"{name} is not what the events make"
            auditor.within("claim", text, math.inf if math.isnan(error) else error, allowed)
    known, other = result.velocity_enclosure, own.velocity_enclosure
    if (known is None) != (other is None):
        auditor.find("claim", "the velocity has an exact value, or has none, against the digits")
    elif known is not None and other is not None:
        error = float(abs(known.middle - other.middle))
        text = "the exact velocity is not what the events make"
        auditor.within("claim", text, error, room + float(known.radius))
        if result.velocity != float(known.middle):
            auditor.find("claim", "the velocity is not the float nearest to its exact value")
