"""The envelope: at every extreme a solver keeps its promise, or says by itself that it does not."""

from __future__ import annotations

import csv
import io
import json
import math
import time
from dataclasses import replace
from fractions import Fraction
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Cycles, InputError, Outcome, State, creep, rearrange
from exactcreep import Path as ThetaPath
from exactcreep.cli import status
from exactcreep.solvers.solver import Rearrangement
from exactcreep.studies.envelope import (
    BROKEN,
    FLAGGED,
    NO_TRUTH,
    REFUSED,
    STEPPED,
    WITHIN,
    Extreme,
    Trial,
    defects,
    envelope,
    extremes,
    remainder_error,
    to_csv,
    untold,
)

pytestmark = pytest.mark.xdist_group("envelope")  # they share `cells`

QUICK = {f"{one.quantity} = {one.value}": one for one in extremes(quick=True)}
SLOW = ("N = 30", "tan_alpha = mu_d + 1e-12 (sigma_mu = 0)", "slips at N = 2", "mu_d = 0 (tan_alpha"
        " = 0, sigma_mu = 0.01)", "l0 A", "energy of slips")  # fmt: skip


def one_cycle(extreme: Extreme) -> Extreme:
    """Return an extreme with no more cycles than show it."""
    drive = extreme.drive
    cycles = isinstance(drive, Cycles)
    return replace(extreme, drive=Cycles(drive.amplitude, 1)) if cycles else extreme


@pytest.fixture(scope="module")
def cells() -> list[Trial]:
    chosen = [one_cycle(one) for name, one in QUICK.items() if not name.startswith(SLOW)]
    return envelope(chosen=chosen, most_compared=10)


def test_every_promise_is_kept_or_flagged(cells: list[Trial]) -> None:
    assert len(cells) > 150
    assert defects(cells) == []


def test_float64_stays_within_its_promise_at_almost_every_extreme(cells: list[Trial]) -> None:
    exact = [cell for cell in cells if cell.solver == "exact"]
    flagged = {(cell.quantity, cell.value) for cell in exact if cell.verdict == FLAGGED}
    refused = {(cell.quantity, cell.value) for cell in exact if cell.verdict == REFUSED}
    # 1e-15 is below the last place of a force of order one: the comparison cannot be decided
    assert flagged == {("tan_alpha", "1e-15 (sigma_mu = 0)")}
    assert refused == {("mu_s - mu_d", "0")}


def test_a_rearrangement_astray_is_said_to_be_undecided(cells: list[Trial]) -> None:
    compared = [cell for cell in cells if cell.solver == "exact" and cell.compared]
    assert len(compared) > 30
    assert sum(cell.compared for cell in compared) > 300
    assert max(cell.worst for cell in compared if not math.isnan(cell.worst)) < 1e-12
    astray = {(cell.quantity, cell.value) for cell in compared if cell.astray}
    # each state handed on is rounded to float64, and there it is the rounding that decides
    assert astray <= {
        ("tie by numbers", "tan_alpha = 1/5"), ("tan_alpha", "1e-15 (sigma_mu = 0)"),
    }  # fmt: skip


def test_verlet_s_error_of_one_rearrangement_is_measured_from_the_same_rest(
    cells: list[Trial],
) -> None:
    sizes = [cell for cell in cells if cell.solver == "verlet" and cell.quantity == "N"]
    verlet = {cell.value: cell for cell in sizes}
    assert 1e-7 < verlet["2"].worst < 1e-5  # lone slips: of second order in dt = 0.01
    assert 1e-5 < verlet["3"].worst < 1e-2  # several sliders: of first order


@pytest.mark.parametrize(("most_events", "verdict"), [(1000, WITHIN), (20, NO_TRUTH)])
def test_a_single_rearrangement_off_its_promise_would_be_seen(
    monkeypatch: pytest.MonkeyPatch, most_events: int, verdict: str
) -> None:
    honest = rearrange

    def off(chain: Chain, state: State, **options: Any) -> Rearrangement:
        result = honest(chain, state, **options)
        if options.get("solver") != "reference":
            return result
        moved = result.state.displacements + 2e-12
        return replace(result, state=replace(result.state, displacements=moved))

    monkeypatch.setattr("exactcreep.studies.envelope.rearrange", off)
    cells = envelope(chosen=[QUICK["N = 2"]], most_events=most_events)
    verdicts = {cell.solver: cell.verdict for cell in cells}
    assert (verdicts["exact"], verdicts["reference"]) == (verdict, BROKEN)


def test_the_certified_solver_proves_every_extreme(cells: list[Trial]) -> None:
    certified = [cell for cell in cells if cell.solver == "certified"]
    assert len(certified) > 40
    for cell in certified:
        extreme = QUICK[f"{cell.quantity} = {cell.value}"]
        # a single cycle without disorder does not tell a transient from what lasts
        single = isinstance(extreme.drive, Cycles) and cell.half_cycles == 2
        unclear = single and extreme.chain.sigma_mu == 0 and cell.outcome != "at_rest"
        assert cell.evidence == "proved" or unclear, cell
        assert cell.verdict == WITHIN, cell


def test_a_promise_that_is_broken_would_be_seen(cells: list[Trial]) -> None:
    """Sabotage: the chain of the truth is another one than that of the contestants."""
    good = QUICK["sigma_mu = 0"]

    class Moved(ThetaPath):
        """A path whose exact targets are not its float ones."""

        def exact_target(self, q: int, seed: int = 0) -> Fraction:
            return super().exact_target(q, seed) * Fraction(6, 5)

    amplitude = Fraction("0.0021")
    bad = replace(good, drive=Moved([amplitude, -amplitude]))
    verdicts = {cell.solver: cell.verdict for cell in envelope(chosen=[bad])}
    assert verdicts["certified"] == WITHIN
    assert verdicts["exact"] == BROKEN


def test_a_run_too_long_for_the_certified_solver_is_no_one_s_fault() -> None:
    cells = envelope(chosen=[QUICK["N = 3"]], most_events=50, most_compared=5)
    verdicts = {cell.solver: cell.verdict for cell in cells}
    python = dict.fromkeys(("certified", "exact", "reference", "mpmath"), NO_TRUTH)
    assert verdicts == {**python, "verlet": STEPPED}
    for cell in cells:
        assert math.isnan(cell.error)
        assert cell.remark == "no truth: max_events = 50 was reached"
        assert 50 <= cell.events < 55
    assert defects(cells) == []
    compared = {cell.solver: cell.compared for cell in cells}
    assert compared["exact"] == compared["verlet"] > 0  # single ones are short enough


def test_what_the_certified_solver_refuses_gives_up_or_assumes_is_no_truth() -> None:
    chain = QUICK["N = 2"].chain
    result = creep(chain, Cycles("0.001", 1), solver="certified")
    assert untold(result) == ""
    assert untold(replace(result, undecided=2)) == "2 comparisons undecided"
    given_up = replace(result, outcome=Outcome.LIMIT, reason="too long")
    assert untold(given_up) == "too long"
    refusal = InputError("mu_s", 1, "must be another")
    assert untold(refusal) == str(refusal)


def test_a_law_that_cannot_tell_is_no_truth() -> None:
    unknown = replace(QUICK["N = 1000"], known=lambda result: math.nan)
    (cell,) = envelope(chosen=[unknown])
    assert (cell.solver, cell.verdict) == ("exact", NO_TRUTH)
    # what a law denies is a fault, unless the run itself says that it is undecided
    decided = QUICK["slips in one half-cycle = 1e+05"]
    (cell,) = envelope(chosen=[replace(decided, known=lambda result: math.inf)])
    assert cell.verdict == BROKEN
    (cell,) = envelope(chosen=[replace(unknown, known=lambda result: math.inf)])
    assert cell.verdict == FLAGGED


def test_no_clock_changes_anything_but_the_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = [one_cycle(QUICK[name]) for name in ("N = 2", "sigma_mu = 0.3", "mu_s - mu_d = 0")]
    usual = envelope(chosen=chosen, most_compared=5)
    for tick in (1e-9, 10.0):  # seconds between two looks at the clock
        ticks = count(1)
        with monkeypatch.context() as slowed:
            slowed.setattr(time, "perf_counter", lambda tick=tick, ticks=ticks: tick * next(ticks))
            found = envelope(chosen=chosen, most_compared=5)
        for one, other in zip(found, usual, strict=True):
            assert one.summary() | {"seconds": 0} == other.summary() | {"seconds": 0}


def test_the_table_is_regenerated_by_one_command(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    some = [QUICK["N = 2"], QUICK["mu_s - mu_d = 0"]]
    monkeypatch.setattr("exactcreep.studies.envelope.extremes", lambda *, quick: some)
    study = tmp_path / "some" / "study"
    assert status(["envelope", "--quick", "--json", "--out", str(study)]) == 0
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert told["broken"] == 0
    assert {cell["solver"] for cell in told["cells"]} >= {"certified", "exact", "verlet", "sliding"}
    table = study / "envelope.csv"
    assert len(table.read_text().splitlines()) == 1 + len(told["cells"])
    some.append(replace(QUICK["N = 1000"], known=lambda result: math.nan))
    assert status(["envelope", "--quick", "--out", str(study), "--force"]) == 0
    assert "1 no truth" in capsys.readouterr().out
    assert table.read_text().splitlines()[-1].split(",")[-2] == NO_TRUTH
    for out, reason in ((study, "exists"), (table, "must be a directory")):
        assert status(["envelope", "--quick", "--out", str(out)]) == 2
        assert reason in capsys.readouterr().err
    assert status(["envelope", "--quick", "--out", str(table / "below")]) == 2
    assert "Not a directory" in capsys.readouterr().err


def test_the_table_has_one_row_for_each_cell(cells: list[Trial]) -> None:
    rows = list(csv.DictReader(io.StringIO(to_csv(cells))))
    assert [row["remark"] for row in rows] == [cell.remark for cell in cells]
    assert [int(row["events"]) for row in rows] == [cell.events for cell in cells]
    assert any('"' in row["remark"] for row in rows)


def test_a_jump_of_a_hundred_thousand_slips_keeps_the_remainder() -> None:
    jump = QUICK["slips in one half-cycle = 1e+05"]
    result = creep(jump.chain, jump.drive, start=jump.experiment.start)
    assert result.slip_count > 99_000
    assert remainder_error(result) < 1e-12


@pytest.mark.parametrize("amplitude", ["1e-15", "1e-300", "0"])
def test_a_chain_that_is_not_driven_never_moves(amplitude: str) -> None:
    chain = Chain(5, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    result = creep(chain, Cycles(amplitude, 1000))
    assert result.outcome is Outcome.AT_REST
    assert (result.event_count, result.x_G, result.velocity) == (0, 0.0, 0.0)


def test_repeated_targets_change_no_bit() -> None:
    chain = Chain(4, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    once = ["0.001", "0.002", "-0.001", "0.0005"]
    often = [theta for theta in once for _ in range(7)]
    one, other = (creep(chain, ThetaPath(theta), seed=4) for theta in (once, often))
    assert np.array_equal(one.state.displacements, other.state.displacements)
    assert one.event_count == other.event_count > 20


@pytest.mark.slow
def test_the_whole_envelope_has_no_defect() -> None:
    whole = envelope(quick=True)
    assert defects(whole) == []
    slips = next(cell for cell in whole if cell.quantity == "slips at N = 2")
    assert slips.events > 10**7
    assert slips.error < 1e-9
    assert not math.isnan(slips.seconds)
