"""What a message recommends works, and gives what was asked for."""

from __future__ import annotations

from typing import Any

import pytest

from exactcreep import (
    Chain,
    Cycles,
    Experiment,
    InputError,
    Targets,
    compare,
    creep,
    fate,
    survival,
    threshold,
)  # fmt: skip

DRIVE = Cycles("0.0006", 40)


def three(*mu_s: Any, **more: Any) -> Chain:
    return Chain(3, 1000, "0.5", list(mu_s), tan_alpha="0.25", **more)


@pytest.mark.parametrize("solver", ["exact", "certified"])
def test_a_chain_with_a_slider_without_excess_moves_as_its_limit(solver: str) -> None:
    """Measured for an excess of 0.0003 and 0.0001 of slider 2; `sliding` is off by 15 %."""
    run = creep(three("0.6", "0.5", "0.6"), DRIVE, solver=solver)
    assert run.velocity == pytest.approx(0.410770, abs=1e-6)
    assert (run.known_until, run.report["undecided"]) == (80, 0)
    off = [abs(creep(three("0.6", 0.5 + k, "0.6"), DRIVE).velocity - run.velocity)
           for k in (1e-3, 3e-4, 1e-4)]  # fmt: skip
    assert off == sorted(off, reverse=True)
    assert off[-1] < 2e-7
    without = creep(three("0.6", "0.5", "0.6"), DRIVE, solver="sliding").velocity
    assert abs(without / run.velocity - 1) > 0.1


def test_a_chain_without_slips_is_told_to_use_the_solver_that_is_its_limit() -> None:
    with pytest.raises(InputError, match='use solver="sliding"'):
        creep(three("0.5", "0.5", "0.5"), DRIVE)
    right = creep(three("0.5", "0.5", "0.5"), DRIVE, solver="sliding").velocity
    near = creep(three("0.5001", "0.5001", "0.5001"), DRIVE).velocity
    assert near == pytest.approx(right, rel=1e-3)


def compared(chain: Chain, amplitude: str) -> Any:
    return compare(Experiment(chain, Cycles(amplitude, 2)))


@pytest.mark.parametrize("which", [0, 2])
@pytest.mark.parametrize("question", [creep, fate, survival, threshold, compared])
def test_no_chain_whose_end_alone_slides_is_sent_to_a_solver_that_changes_the_others(
    which: int, question: Any
) -> None:
    mu_s = ["0.6", "0.6", "0.6"]
    mu_s[which] = "0.5"
    told = {creep: [DRIVE], threshold: []}.get(question, ["0.0006"])
    with pytest.raises(InputError, match=r"must exceed|larger mu_s") as refused:
        question(three(*mu_s), *told)
    assert "sliding" not in str(refused.value)
    mu_s[which] = "0.51"
    assert creep(three(*mu_s), DRIVE).velocity > 0


def test_a_slider_between_the_ends_that_theta_drives_needs_an_excess() -> None:
    chain, path = three("0.6", "0.5", "0.6"), Targets([["0.001", "0.002"], ["-0.001", "0.001"]])
    for driven, drive in ((three("0.6", "0.5", "0.6", expansion=[1, "1.2"]), DRIVE), (chain, path)):
        with pytest.raises(InputError, match=r"mu_s\[1\].*larger mu_s"):
            creep(driven, drive)
    assert creep(three("0.6", "0.51", "0.6"), path).half_cycles == 2
