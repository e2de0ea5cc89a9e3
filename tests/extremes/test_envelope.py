"""The envelope: at every extreme a solver keeps its promise, or says by itself that it does not."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, Outcome, State, creep
from exactcreep import Path as ThetaPath
from exactcreep.cli import status
from exactcreep.studies.envelope import (
    BROKEN,
    FLAGGED,
    REFUSED,
    WITHIN,
    Cell,
    defects,
    envelope,
    extremes,
    remainder_error,
    to_csv,
)

QUICK = {f"{one.quantity} = {one.value}": one for one in extremes(quick=True)}
SLOW = ("N = 30", "tan_alpha = mu_d + 1e-12 (sigma_mu = 0)", "slips at N = 2", "mu_d = 0 (tan_alpha"
        " = 0, sigma_mu = 0.01)", "l0 A")  # fmt: skip


@pytest.fixture(scope="module")
def cells() -> list[Cell]:
    chosen = [one for name, one in QUICK.items() if not name.startswith(SLOW)]
    return envelope(quick=True, chosen=chosen)


def test_every_promise_is_kept_or_flagged(cells: list[Cell]) -> None:
    assert len(cells) > 150
    assert defects(cells) == []


def test_float64_stays_within_its_promise_at_almost_every_extreme(cells: list[Cell]) -> None:
    exact = [cell for cell in cells if cell.solver == "exact"]
    flagged = {(cell.quantity, cell.value) for cell in exact if cell.verdict == FLAGGED}
    refused = {(cell.quantity, cell.value) for cell in exact if cell.verdict == REFUSED}
    # 1e-15 is below the last place of a force of order one: the comparison cannot be decided
    assert flagged == {("tan_alpha", "1e-15 (sigma_mu = 0)")}
    assert refused == {("mu_s - mu_d", "0")}


def test_the_certified_solver_proves_every_extreme(cells: list[Cell]) -> None:
    certified = [cell for cell in cells if cell.solver == "certified"]
    assert len(certified) > 40
    for cell in certified:
        proved = cell.evidence == "proved" or cell.verdict == REFUSED
        assert proved or cell.outcome == "limit", cell


def test_a_promise_that_is_broken_would_be_seen(cells: list[Cell]) -> None:
    """Sabotage: the chain of the truth is another one than that of the contestants."""
    good = QUICK["sigma_mu = 0"]

    class Moved(ThetaPath):
        """A path whose exact targets are not its float ones."""

        def exact_target(self, q: int, seed: int = 0) -> Fraction:
            return super().exact_target(q, seed) * Fraction(6, 5)

    amplitude = Fraction("0.0021")
    bad = replace(good, drive=Moved([amplitude, -amplitude]))
    verdicts = {cell.solver: cell.verdict for cell in envelope(chosen=[bad], most_seconds=5)}
    assert verdicts["certified"] == WITHIN
    assert verdicts["exact"] == BROKEN


def test_the_table_is_regenerated_by_one_command(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    some = [QUICK["N = 2"], QUICK["mu_s - mu_d = 0"]]
    monkeypatch.setattr("exactcreep.studies.envelope.extremes", lambda *, quick: some)
    assert status(["envelope", "--quick", "--json", "--out", str(tmp_path)]) == 0
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert told["broken"] == 0
    assert {cell["solver"] for cell in told["cells"]} >= {"certified", "exact", "verlet", "sliding"}
    rows = (tmp_path / "envelope.csv").read_text().splitlines()
    assert len(rows) == 1 + len(told["cells"])
    assert status(["envelope", "--quick", "--out", str(tmp_path)]) == 2
    assert "exists" in capsys.readouterr().err


def test_the_table_has_one_row_for_each_cell(cells: list[Cell]) -> None:
    assert len(to_csv(cells).splitlines()) == 1 + len(cells)


def test_a_jump_of_a_hundred_thousand_slips_keeps_the_remainder() -> None:
    jump = QUICK["slips in one half-cycle = 1e+05"]
    result = creep(jump.chain, jump.drive, start=jump.start(0))
    assert result.slips > 99_000
    assert remainder_error(result) < 1e-12


@pytest.mark.parametrize("amplitude", ["1e-15", "1e-300", "0"])
def test_a_chain_that_is_not_driven_never_moves(amplitude: str) -> None:
    chain = Chain(5, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    result = creep(chain, Cycles(amplitude, 1000))
    assert result.outcome is Outcome.AT_REST
    assert (result.events, result.x_G, result.velocity) == (0, 0.0, 0.0)


def test_repeated_targets_change_no_bit() -> None:
    chain = Chain(4, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    once = ["0.001", "0.002", "-0.001", "0.0005"]
    often = [theta for theta in once for _ in range(7)]
    one, other = (creep(chain, ThetaPath(theta), seed=4) for theta in (once, often))
    assert np.array_equal(one.state.displacements, other.state.displacements)
    assert one.events == other.events > 20


@pytest.mark.slow
def test_a_billion_slips_keep_the_remainder() -> None:
    chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    start = State.prepared(chain, [Fraction(1, 32)])
    result = creep(
        chain, Cycles(Fraction(chain.excess) / 10, 5 * 10**6), start=start, record=(),
        max_events=2 * 10**9,
    )  # fmt: skip
    assert result.slips > 9 * 10**8
    assert remainder_error(result) < 1e-9
    assert result.evidence is Evidence.COMPUTED


@pytest.mark.slow
def test_the_whole_envelope_has_no_defect() -> None:
    whole = envelope(quick=True)
    assert defects(whole) == []
    slips = next(cell for cell in whole if cell.quantity == "slips at N = 2")
    assert slips.events > 10**7
    assert slips.error < 1e-9
    assert not math.isnan(slips.seconds)
