"""What a message recommends works, and gives what was asked for."""

from __future__ import annotations

from typing import Any

import pytest

from exactcreep import Chain, Cycles, Drive, InputError, Targets, creep

DRIVE = Cycles("0.0006", 20)


def three(*mu_s: Any, **more: Any) -> Chain:
    return Chain(3, 1000, "0.5", list(mu_s), tan_alpha="0.25", **more)


@pytest.mark.parametrize("solver", ["exact", "certified"])
def test_a_chain_with_a_slider_without_excess_moves_as_its_limit(solver: str) -> None:
    """Measured for an excess of 0.0003 and 0.0001 of slider 2; `sliding` is off by 15 %."""
    run = creep(three("0.6", "0.5", "0.6"), DRIVE, solver=solver)
    assert run.velocity == pytest.approx(0.410770, abs=1e-6)
    assert (run.known_until, run.report["undecided"]) == (40, 0)
    off = [abs(creep(three("0.6", 0.5 + k, "0.6"), DRIVE).velocity - run.velocity)
           for k in (1e-3, 3e-4, 1e-4)]  # fmt: skip
    assert off == sorted(off, reverse=True)
    assert off[-1] < 2e-7
    without = creep(three("0.6", "0.5", "0.6"), DRIVE, solver="sliding").velocity
    assert abs(without / run.velocity - 1) > 0.1


PATH = Targets([["0.001", "0.002"], ["-0.001", "0.001"]])


@pytest.mark.parametrize(
    ("sliding", "about", "drive"),
    [(0, {}, DRIVE), (2, {}, DRIVE), (1, {"expansion": [1, "1.2"]}, DRIVE), (1, {}, PATH)],
)
def test_a_slider_that_theta_drives_needs_an_excess(
    sliding: int, about: dict[str, Any], drive: Drive
) -> None:
    mu_s = ["0.6", "0.6", "0.6"]
    mu_s[sliding] = "0.5"
    with pytest.raises(InputError, match=rf"mu_s\[{sliding}\].*larger mu_s") as refused:
        creep(three(*mu_s, **about), drive)
    assert "sliding" not in str(refused.value)
    mu_s[sliding] = "0.51"
    assert creep(three(*mu_s, **about), drive).event_count > 0
