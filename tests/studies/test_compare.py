"""The comparison of solvers: where they part, and how close the tie was there."""

from __future__ import annotations

import json
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exactcreep import Path as ThetaPath
from exactcreep import cli
from exactcreep.figures.comparison import draw_comparison
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.studies.compare import Comparison, compare


def six(cycles: int = 4) -> Experiment:
    chain = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    return Experiment.of(chain, Cycles("0.01", cycles), seed=0)


@lru_cache
def found(dt: str = "0.01") -> Comparison:
    return compare(six(), dt=dt, events=300)


class TestSixSliders:
    def test_the_kernel_makes_the_certified_events(self) -> None:
        exact = found().contestants[0]
        assert not exact.differs
        assert exact.agreed == found().events >= 300
        assert found().evidence is Evidence.PROVED

    def test_the_kernel_s_positions_agree_to_1e_12(self) -> None:
        exact = found().contestants[0]
        assert exact.errors.size == exact.compared >= 50
        assert 0 < exact.errors.max() < 1e-12

    def test_verlet_parts_from_it_at_an_event_that_is_named(self) -> None:
        verlet = found().contestants[1]
        assert verlet.differs
        assert verlet.agreed < found().events
        assert verlet.own is not None
        assert verlet.known is not None
        assert verlet.own.signature != verlet.known.signature

    def test_the_tie_is_as_close_as_verlet_s_errors_are_large(self) -> None:
        verlet = found().contestants[1]
        assert verlet.tie is not None
        assert verlet.tie.margin <= 10 * verlet.error_before

    def test_positions_are_off_by_much_more_after_than_before(self) -> None:
        verlet = found().contestants[1]
        assert verlet.errors[: verlet.compared].max() == verlet.error_before
        assert verlet.error_after > 3 * verlet.error_before

    def test_a_smaller_step_agrees_for_longer(self) -> None:
        coarse, fine = (found(dt).contestants[1] for dt in ("0.01", "0.0005"))
        assert fine.agreed > coarse.agreed
        shared = coarse.compared
        assert np.median(fine.errors[:shared]) < np.median(coarse.errors[:shared]) / 5


def told(comparison: Comparison) -> dict[str, Any]:
    """Return what a comparison says, but for the times it took."""
    summary = comparison.summary()
    for contestant in summary["contestants"]:
        del contestant["seconds"]
    return summary


class TestArguments:
    chain = Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    drive = Cycles("0.002", 2)

    def test_a_chain_and_a_drive_are_compared_like_their_experiment(self) -> None:
        start = State.prepared(self.chain, [Fraction(1, 8), 0], seed=3)
        given = Experiment.of(self.chain, self.drive, seed=3, start=start, solver="reference")
        one = compare(given, events=60)
        other = compare(self.chain, self.drive, seed=3, start=start, events=60)
        assert told(one) == told(other)
        for changed in ({"start": start}, {"seed": 3}):
            assert told(compare(self.chain, self.drive, events=60, **changed)) != told(one)

    @pytest.mark.parametrize("name", ["drive", "seed", "start"])
    def test_an_experiment_takes_no_other_drive_seed_or_start(self, name: str) -> None:
        given = {"drive": self.drive, "seed": 0, "start": State.relaxed(self.chain)}
        with pytest.raises(InputError) as refused:
            compare(Experiment.of(self.chain, self.drive), **{name: given[name]})
        assert refused.value.field == name

    @pytest.mark.parametrize("missing", ["chain", "drive"])
    def test_a_chain_needs_a_drive(self, missing: str) -> None:
        given = {"chain": self.chain, "drive": self.drive} | {missing: None}
        with pytest.raises(InputError) as refused:
            compare(given["chain"], given["drive"])
        assert refused.value.field == missing


def test_a_rearrangement_too_many_is_off_by_the_load_that_the_target_lacks() -> None:
    chain, reach = Chain(2, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25"), Fraction("0.001")
    verlet = compare(chain, Cycles(reach, 3), dt="0.3", events=40).contestants[1]
    assert verlet.own is not None
    assert verlet.known is not None
    assert verlet.tie is not None
    assert (verlet.own.half_cycle, verlet.known.half_cycle, verlet.own.number) == (3, 4, 0)
    assert (verlet.tie.condition, verlet.tie.time) == ("load", None)
    lacking = Fraction(verlet.tie.margin) / chain.l0
    short, enough = (
        creep(chain, ThetaPath([reach, -reach, reach + lacking * (1 + beside)]), solver="certified")
        for beside in (-Fraction(1, 10**6), Fraction(1, 10**6))
    )
    assert enough.rearrangements == short.rearrangements + 1 == verlet.own.rearrangement + 1


def test_a_runaway_is_compared_until_the_last_rest_before_it() -> None:
    steep = Chain(3, 1000, "0.5", "0.6", "0.05", tan_alpha="0.53")
    found = compare(steep, Cycles("0.0003", 30), seed=3)
    assert (found.rearrangements, found.events) == (1, 2)
    for standing in found.contestants:
        assert not standing.differs
        assert (standing.agreed, standing.compared) == (2, 1)
        assert standing.creep.outcome is Outcome.RUNAWAY


def test_a_chain_that_never_slips_cannot_be_compared() -> None:
    chain = Chain(6, 1000, "0.5", "0.6", tan_alpha="0.25")
    with pytest.raises(InputError, match="slips"):
        compare(Experiment.of(chain, Cycles("0.00001", 2)))


@pytest.mark.parametrize("option", ["dt", "digits", "events"])
def test_an_option_out_of_range_is_refused(option: str) -> None:
    with pytest.raises(InputError, match=option):
        compare(six(), **{option: 0})


def test_the_picture_is_drawn(tmp_path: Path) -> None:
    draw_comparison(found(), tmp_path / "parting.png", title="Six sliders")
    assert (tmp_path / "parting.png").stat().st_size > 20_000


def test_the_command_prints_one_object(capsys: pytest.CaptureFixture[str]) -> None:
    words = (
        "compare six-sliders-cycles --set drive.cycles=2 --events 100 --digits 20 --dt 0.05 --json"
    )
    assert cli.status(words.split()) == 0
    out = json.loads(capsys.readouterr().out)
    assert out["certified"]["evidence"] == "proved"
    exact, verlet = out["contestants"]
    assert exact["first_difference"] is None
    assert exact["events_agreed"] == out["certified"]["events"]
    assert verlet["first_difference"]["tie"]["margin"] >= 0
    assert verlet["options"] == {"dt": "0.05"}


def test_the_audit_command_tells_a_good_run_from_a_bad_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for solver, status in (("exact", 0), ("verlet", 1)):
        path = str(tmp_path / f"{solver}.nc")
        words = "run six-sliders-cycles --set drive.cycles=1 --set drive.amplitude=0.002"
        run = [*words.split(), "--solver", solver, "--record", "events", "--out", path]
        assert cli.status(run) == 0
        capsys.readouterr()
        assert cli.status(["audit", path, "--json"]) == status
        assert json.loads(capsys.readouterr().out)["passed"] is (status == 0)
