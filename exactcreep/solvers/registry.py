"""The solvers by name, and the two calls that need no drive: `rearrange` and `iterate`."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

from exactcreep.model.chain import Chain
from exactcreep.model.contact import Event
from exactcreep.model.disorder import valid_seed
from exactcreep.model.numbers import InputError, whole_number
from exactcreep.model.state import State
from exactcreep.solvers.auto import Auto
from exactcreep.solvers.certified import Certified
from exactcreep.solvers.exact import Exact
from exactcreep.solvers.reference import Mpmath, Reference
from exactcreep.solvers.sliding import Sliding
from exactcreep.solvers.solver import Rearrangement, Solver
from exactcreep.solvers.verlet import Verlet

SOLVERS: dict[str, type[Solver]] = {
    Exact.name: Exact,
    Reference.name: Reference,
    Mpmath.name: Mpmath,
    Certified.name: Certified,
    Sliding.name: Sliding,
    Verlet.name: Verlet,
    Auto.name: Auto,
}
"""Every solver class by its name."""


def solver_named(name: Any, options: dict[str, Any]) -> Solver:
    """Return the solver `name` with the given options.

    Raises
    ------
    InputError
        If there is no such solver, or it does not take one of the options.
    """
    if not isinstance(name, str) or name not in SOLVERS:
        raise InputError("solver", name, "must be one of " + ", ".join(SOLVERS))
    algorithm = SOLVERS[name]
    options_of: Any = algorithm  # every solver is a dataclass, which its base class cannot say
    known = [field.name for field in fields(options_of)]
    for option in options:
        if option not in known:
            near = difflib.get_close_matches(option, known, 1)
            hint = f" (did you mean {near[0]}?)" if near else ""
            takes = ", ".join(known) if known else "no options"
            raise InputError(
                "option", option, f"solver {name!r} does not take it{hint}; it takes {takes}"
            )
    return algorithm(**options)


def _valid(chain: Any, state: Any, direction: Any, seed: Any) -> tuple[int, int]:
    if not isinstance(chain, Chain):
        raise InputError("chain", chain, "must be a Chain")
    if not isinstance(state, State):
        raise InputError("state", state, "must be a State")
    if state.n != chain.n:
        raise InputError("state", state.n, f"must have the chain's {chain.n} sliders")
    return whole_number(direction, "direction", least=-1, most=1), valid_seed(seed)


def rearrange(
    chain: Chain,
    state: State,
    *,
    direction: int,
    seed: int = 0,
    solver: str = "exact",
    **options: Any,
) -> Rearrangement:
    """Ramp theta until a slider starts, and return the rearrangement that follows.

    Parameters
    ----------
    chain : Chain
    state : State
        At rest.
    direction : {+1, -1, 0}
        +1 dilates, -1 contracts, 0 leaves theta as it stands (no events if the state is stable).
    seed : int
        Keys the static coefficients that are drawn at stops.
    solver : str
        One of `SOLVERS`.
    **options
        The solver's own options.

    Raises
    ------
    InputError
        If an argument is out of range or an option is not the solver's.
    """
    way, key = _valid(chain, state, direction, seed)
    return solver_named(solver, options).rearrange(chain, state, way, key)


def iterate(
    chain: Chain,
    state: State,
    *,
    direction: int,
    seed: int = 0,
    solver: str = "exact",
    **options: Any,
) -> Iterator[Event]:
    """Return an iterator over the events of `rearrange`, one by one; same arguments."""
    way, key = _valid(chain, state, direction, seed)
    return solver_named(solver, options).iterate(chain, state, way, key)
