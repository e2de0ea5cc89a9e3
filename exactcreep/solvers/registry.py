"""The solvers by name, and `rearrange`, which needs no drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any

from exactcreep import solvers
from exactcreep.model.chain import Chain
from exactcreep.model.keyed_disorder import valid_seed
from exactcreep.model.names import did_you_mean, one_of
from exactcreep.model.numbers import InputError, whole_number
from exactcreep.model.state import State, require_finite
from exactcreep.moved import SOLVERS as MOVED
from exactcreep.solvers.interface import MOST_EVENTS, Solver
from exactcreep.solvers.rearrangement import Rearrangement
from exactcreep.watch.limits import Limits
from exactcreep.watch.preparation import preparing

_DIRECTIONS = {"up": 1, "down": -1}  # of theta
SOLVERS: dict[str, Callable[[], type[Solver]]] = {
    "exact": lambda: solvers.Exact,
    "certified": lambda: solvers.Certified,
    "sliding": lambda: solvers.Sliding,
    "verlet": lambda: solvers.Verlet,
}
"""Every solver by its name: a function that imports and returns its class."""


@cache
def _class_of(load: Callable[[], type[Solver]]) -> type[Solver]:
    """Return the class of a solver; the time to load it counts as preparation, once."""
    with preparing():
        return load()


def _options_of(name: str) -> list[str]:
    solver: Any = _class_of(SOLVERS[name])  # a dataclass; its base class cannot say so
    return [option.name for option in fields(solver)]


def solver_named(name: Any, options: dict[str, Any]) -> Solver:
    """Return the solver `name` with the given options, or raise `InputError`."""
    if not isinstance(name, str) or name not in SOLVERS:
        moved = MOVED.get(name) if isinstance(name, str) else None
        raise InputError("solver", name, moved or one_of(name, SOLVERS))
    algorithm: Any = _class_of(SOLVERS[name])
    options_taken = _options_of(name)
    for option in (name for name in options if name not in options_taken):
        own = next((each for each in SOLVERS if option in _options_of(each)), "")
        hint = did_you_mean(option, options_taken) or (f" (an option of {own})" if own else "")
        takes = f"it takes {', '.join(options_taken) or 'no options'}"
        raise InputError("option", option, f"solver {name!r} does not take it{hint}; {takes}")
    return algorithm(**options)  # type: ignore[no-any-return]


def _valid(chain: Any, state: Any, direction: Any, seed: Any) -> tuple[int, int]:
    for field, value, kind in (("chain", chain, Chain), ("state", state, State)):
        if not isinstance(value, kind):
            raise InputError(field, value, f"must be a {kind.__name__}")
    if state.n != chain.n:
        raise InputError("state", state.n, f"must have the chain's {chain.n} sliders")
    require_finite(state)
    sign = _DIRECTIONS.get(direction, direction) if isinstance(direction, str) else direction
    return whole_number(sign, "direction", least=-1, most=1), valid_seed(seed)


def rearrange(
    chain: Chain,
    state: State,
    *,
    direction: int | str,
    seed: int = 0,
    solver: str = "exact",
    max_events: int = MOST_EVENTS,
    max_seconds: float | None = None,
    **options: Any,
) -> Rearrangement:
    """Ramp theta until a slider starts, and return the rearrangement that follows.

    Parameters
    ----------
    chain : Chain
        Sliders, springs and friction.
    state : State
        Initial state. A state that is not at rest is rearranged at its own theta.
    direction : {+1, -1, 0, "up", "down"}
        +1 or "up" raises theta: the chain dilates; -1 or "down" contracts it; 0 leaves
        theta unchanged (no events if the state is stable).
    seed : int
        Seed of the static coefficients drawn at stops.
    solver : str
        ``exact`` (float64, compiled), ``certified`` (balls: proved; options `digits`,
        `most_digits`) or ``verlet`` (fixed steps; options `dt`, `locate`). ``sliding`` has no
        inertia, hence no rearrangements.
    max_events : int
        Stop after this number of events, at least 1; a few more if they are simultaneous.
    max_seconds : number, optional
        Stop after this wall time.
    **options
        Options of the solver.

    Returns
    -------
    Rearrangement
        Its `events`, its `itinerary`, and the final `state` for the next call; the motion `sol(t)`
        between the first event and the last; `outcome` and `evidence`. After a limit the outcome is
        `LIMIT`, with a `reason`, and the result is partial.

    Raises
    ------
    InputError
        If an argument is out of range, the solver lacks an option, or the chain has no slips
        (mu_s = mu_d with sigma_mu = 0).

    Notes
    -----
    Guarantee: ``exact`` and ``certified`` miss no event; `undecided` counts undecided comparisons.
    Source: Eqs. 5-10.

    Examples
    --------
    The first slip of the lowest of three relaxed sliders takes half a period, pi:

    >>> chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> slip = rearrange(chain, State.relaxed(chain), direction=+1)
    >>> [(event.kind.value, event.sliders, round(event.time, 6)) for event in slip.events]
    [('start', (3,), 0.0), ('stop', (3,), 3.141593)]
    """
    limits = Limits.of(whole_number(max_events, "max_events", least=1), max_seconds)
    way, key = _valid(chain, state, direction, seed)
    return solver_named(solver, options).rearrange(chain, state, way, key, limits)
