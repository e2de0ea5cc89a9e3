"""Have the code of a solver compiled, or loaded, before it is needed or timed."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from exactcreep import compiling
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.solvers.solver import Solver

TWO_SLIDERS = Chain(2, 10, "1/2", "3/5", "1/100", tan_alpha="1/4")
"""What is compiled depends on the number of sliders alone; see `Solver.compiles`."""
_COMPILED: set[tuple[str, int, tuple[str, ...]]] = set()


def compiled(
    solver: Solver,
    lengths: Sequence[int],
    record: tuple[str, ...] = (),
    say: Callable[[], None] | None = None,
) -> float:
    """Have a solver's code compiled, or loaded, once; return the seconds that it took just now.

    `say` is called if the compiler is at work: code found in its cache does not need it. What the
    solver's options cost, such as a short time step, is not paid for here.
    """
    left = [n for n in lengths if (solver.name, n, record) not in _COMPILED]
    if not left:
        return 0.0
    begin = time.perf_counter()
    with compiling.told(say):
        warm_up(type(solver)(), left, record)
    _COMPILED.update((solver.name, n, record) for n in left)
    return time.perf_counter() - begin


def warm_up(solver: Solver, lengths: Sequence[int], record: tuple[str, ...] = ()) -> None:
    """Have a solver's code compiled, or loaded, on two half-cycles of chains of these lengths."""
    for n in lengths:
        chain = replace(TWO_SLIDERS, n=n)
        simulation = solver.simulation(chain, State.relaxed(chain), 0, record)
        simulation.follow(Cycles("1/10", 1), 1, 2)
