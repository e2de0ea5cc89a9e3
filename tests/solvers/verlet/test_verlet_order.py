"""How fast velocity Verlet converges: to the first event, and across events."""

import numpy as np
import pytest

from exactcreep.model.state import State
from exactcreep.solvers.registry import rearrange
from tests.data.make_whole_rearrangements import load
from tests.paper import paper_chain

LADDER = [0.02 / 2**k for k in range(6)]


def fitted_order(steps: list[float], errors: list[float]) -> float:
    """Return the slope of log(error) over log(dt)."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def across_events(locate: bool) -> tuple[list[float], list[int]]:
    """Return the fitted orders of the final positions, and where paths part.

    That is the number of equal events before the first that differs, for every case and step
    whose itinerary is another.
    """
    orders, divergences = [], []
    enough = [pair for pair in zip(*load(), strict=True) if len(pair[1].times) >= 4]
    for case, found in enough[::5]:
        steps, errors = [], []
        for dt in LADDER:
            result = rearrange(
                case.chain,
                case.state,
                direction=case.direction,
                seed=case.seed,
                solver="verlet",
                dt=dt,
                locate=locate,
            )
            if list(result.itinerary) == found.itinerary:
                steps.append(dt)
                off = result.state.displacements - found.displacements
                errors.append(np.abs(off).max())
            else:
                pairs = zip(result.itinerary, found.itinerary, strict=False)
                divergences.append(next((k for k, (a, b) in enumerate(pairs) if a != b), -1))
        if len(steps) >= 4 and min(errors) > 1e-12:
            orders.append(fitted_order(steps, errors))
    return orders, divergences


@pytest.mark.parametrize(("locate", "order"), [(False, 1.0), (True, 2.0)])
def test_verlet_is_of_first_order_across_events_and_of_second_if_it_locates_them(locate, order):
    orders, divergences = across_events(locate)
    print(
        f"locate={locate}: {len(orders)} rearrangements, median order {np.median(orders):.3f},"
        f" quartiles {np.percentile(orders, [25, 75]).round(3)}; {len(divergences)} runs take"
        f" another path, the first after {min(divergences, default=None)} events, half of them"
        f" within {np.median(divergences) if divergences else None}"
    )
    assert len(orders) >= 40
    assert np.median(orders) == pytest.approx(order, abs=0.1)


def test_the_time_of_the_first_event_that_verlet_locates_is_of_second_order():
    """Sliders side by side start together, and nothing happens before."""
    orders = []
    rng = np.random.default_rng(7)
    for seed in range(60):
        n = int(rng.integers(2, 9))
        tan_alpha = ("0.1", "0.25", "0.4")[seed % 3]
        chain = paper_chain(n, tan_alpha=tan_alpha)
        state = State.prepared(chain, rng.uniform(-1.2, 1.2, n - 1), seed=seed)
        exact = rearrange(chain, state, direction=0, seed=seed, solver="exact")
        if len(exact.events) < 2:
            continue
        errors = []
        for dt in LADDER:
            about = {"seed": seed, "solver": "verlet", "dt": dt, "locate": True}
            verlet = rearrange(chain, state, direction=0, **about)
            assert verlet.itinerary[:2] == exact.itinerary[:2]
            errors.append(abs(verlet.events[1].time - exact.events[1].time))
        orders.append(fitted_order(LADDER, errors))
    print(f"first event: {len(orders)} rearrangements, median order {np.median(orders):.4f}")
    assert len(orders) >= 45
    assert np.median(orders) == pytest.approx(2.0, abs=0.02)
