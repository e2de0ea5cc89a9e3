"""What a chain without disorder does in the end, as float64 finds it."""

from collections import Counter
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, Outcome, State, creep, fate
from exactcreep.studies.fates.fate_result import Fate
from tests.paper import captions


def tensions(found: Fate, cycles: int) -> np.ndarray:
    run = creep(found.chain, Cycles(found.amplitude, cycles), start=found.start, record="tension")
    return run.recorded["tension"][1::2]


@pytest.mark.parametrize(
    ("n", "amplitude"), [(3, "0.00085"), (4, "0.0011"), (5, "0.000759"), (6, "0.000969")]
)
def test_tensions_repeat_from_settled_after_on_and_not_before(n: int, amplitude: str) -> None:
    found = fate(captions(n), amplitude, solver="exact")
    assert found.evidence is Evidence.COMPUTED
    settled, period = found.settled_after, found.period
    at_ends = tensions(found, settled + 2 * period)
    assert np.array_equal(at_ends[settled - 1 : -period], at_ends[settled - 1 + period :])
    if settled > 1:
        assert not np.array_equal(at_ends[settled - 2], at_ends[settled - 2 + period])
    for shorter in range(1, period):
        assert not np.array_equal(at_ends[settled - 1], at_ends[settled - 1 + shorter])
    run = creep(found.chain, Cycles(amplitude, settled + period), record=("x_G", "slips"))
    x_g = run.recorded["x_G"][1::2]
    advances = np.diff(x_g, prepend=0.0)[:settled]
    assert found.last_advance == np.flatnonzero(advances > 1e-12)[-1] + 1
    assert found.advance == pytest.approx(x_g[-1] - x_g[settled - 1], rel=1e-12, abs=1e-12)
    assert found.velocity == found.advance / (2 * period)
    kinds = Counter(kind for _, events in found.itinerary for kind, *_ in events)
    assert kinds["stop"] == kinds["start"] == run.recorded["slips"][2 * settled :].sum()


@pytest.mark.parametrize("solver", ["certified", "exact"])
@pytest.mark.parametrize("scale", [1, Fraction(1, 10**12), Fraction(1, 10**40)])
def test_a_chain_with_hardly_any_friction_advances_as_others_do(
    solver: str, scale: Fraction
) -> None:
    friction = [Fraction(one) * scale for one in ("0.5", "0.6", "0.25")]
    chain = Chain(2, 1000, *friction[:2], tan_alpha=friction[2])
    assert fate(chain, Fraction("0.0004") * scale, solver=solver).last_advance == 1


@pytest.mark.parametrize(
    ("n", "tan_alpha", "amplitude", "outcome", "settled", "said"),
    [
        (30, "0.25", "0.0045", Outcome.LIMIT, None, "60 cycles"),
        (4, "0.25", "0", Outcome.AT_REST, 0, ""),
        (4, "0", "0.001", Outcome.CYCLING, 1, ""),
        (3, "0.55", "0.001", Outcome.RUNAWAY, None, "stop ever again"),
    ],
)
def test_chains_that_rest_lock_run_away_and_do_not_settle(
    n: int, tan_alpha: str, amplitude: str, outcome: Outcome, settled: int | None, said: str
) -> None:
    found = fate(captions(n, tan_alpha=tan_alpha), amplitude, cycles=60, solver="exact")
    assert found.outcome is outcome
    assert found.settled_after == settled
    assert (found.advance == 0) == (settled is not None)
    assert said in found.reason


def test_a_start_that_is_not_at_rest_is_first_rearranged() -> None:
    chain = captions(2)
    found = fate(chain, 0, start=State.prepared(chain, ["1.5"]), solver="exact")
    assert (found.outcome, found.settled_after, found.last_advance) == (Outcome.AT_REST, 1, 1)
    assert found.report["events"] > 0
