"""How fast velocity Verlet converges: to the first event, and across events."""

import numpy as np
import pytest

from exactcreep.solvers.registry import rearrange
from tests.data.make_whole_rearrangements import load

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
