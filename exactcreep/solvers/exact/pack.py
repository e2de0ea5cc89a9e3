"""Convert a `State` to the arrays of the compiled loop and back, without losing a bit.

A number that float64 cannot hold is a sum of two floats.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import compiled
from exactcreep.model.chain import Chain, mean_mu_d, surplus
from exactcreep.model.drive import Leg
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.state import State
from exactcreep.solvers.exact import layout, rows
from exactcreep.solvers.exact.double_double import split, two_product, two_sum
from exactcreep.solvers.exact.draws import KEPT, excess_of
from exactcreep.solvers.exact.layout import CLOCKS, LADDER, NEVER, PAD, SERIES
from exactcreep.solvers.exact.loop import prepare
from exactcreep.solvers.exact.rows import HELD, HELD_LOW, PLACE, PLACE_LOW, TENSION, TENSION_LOW
from exactcreep.solvers.interface import longest_avalanche, require

_ROWS = 4099
"""Least rows of the log between two calls of the loop; not a multiple of a cache's ways."""
_ALONE = 2
"""Chains up to this length begin without `series`: most of their slips are of one slider."""
_NAIL = 16.0
"""A slider with more friction than this many times the median sets no scale for the others."""

_SUMS = "theta", "theta_low", "total", "total_low"


class Workspace(NamedTuple):
    """The arrays of the compiled loop; their rows and cells are named in `layout`."""

    cell: NDArray[np.float64]
    whole: NDArray[np.int64]
    deviate: NDArray[np.float64]
    clock: NDArray[np.float64] | None
    series: NDArray[np.float64] | None
    now: NDArray[Any]
    log: NDArray[Any]


class Origin(NamedTuple):
    """The start of a simulation.

    `numbers` (ndarray, shape (6, n)): tensions, displacements and coefficients, each as two floats;
    `theta`: the dilation of every spring, or of each; `of_chain` (ndarray, shape (8, n)): the rows
    of `layout.OF_CHAIN`; `expansion` (ndarray, shape (2, n - 1)): of each spring per ``l0 theta``,
    as two floats; `load`: ``l0 theta`` as two floats.
    """

    state: State
    numbers: NDArray[np.float64]
    theta: Sequence[Fraction]
    of_chain: NDArray[np.float64]
    expansion: NDArray[np.float64]
    load: tuple[float, float]

    @classmethod
    def of(cls, chain: Chain, state: State) -> Origin:
        """Return a state as two floats for each number."""
        numbers = np.zeros((6, chain.n))
        for row, values in (
            (TENSION, state.tensions), (PLACE, state.displacements), (HELD, state.coefficients)
        ):  # fmt: skip
            if values.dtype == np.float64:
                numbers[row, : values.size] = values
                continue
            for i, value in enumerate(values.tolist()):
                numbers[row : row + 2, i] = split(rational(value))
        if state.springs:  # forces without theta: see `turn`
            each = [*map(rational, state.theta.tolist())]
            return cls(state, numbers, each, *_of_chain(chain), (0.0, 0.0))
        theta = Fraction(state.theta) if type(state.theta) is float else rational(state.theta)
        return cls(state, numbers, [theta], *_of_chain(chain), split(chain.l0 * theta))

    def kept(self) -> dict[str, Any]:
        """Return what a simulation that goes on from a later state needs; see `went_on`."""
        load = np.array(self.load)
        return {"numbers": self.numbers, "theta": list(self.theta), "load": load}

    def went_on(self, kept: Mapping[str, Any]) -> Origin:
        """Return the start of the simulation that has led to the state of this one."""
        theta = kept["theta"]
        count = self.numbers.shape[1] - 1
        fits = [*map(type, theta)] in ([Fraction], [Fraction] * count)
        require(fits, f"it has not 1 or {count} dilations")
        load = tuple(kept["load"].tolist())
        return self._replace(numbers=kept["numbers"], theta=theta, load=load)

    @property
    def began(self) -> tuple[Any, ...]:
        """The data that determine tensions: `numbers`, `expansion` and `load`."""
        return self.numbers, self.expansion, *self.load

    def read(
        self, work: Workspace
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
        """Return the present tensions, displacements, coefficients and draws, new arrays."""
        n = self.numbers.shape[1]
        present = np.empty(n - 1), np.empty(n), np.empty(n), np.empty(n, dtype=np.int64)
        _read(work.cell, work.whole, work.now, self.began, self.state.draws, *present)
        return present

    def at_leg(self, chain: Chain, leg: Leg) -> Origin:
        """Return the start of a leg, with its tensions and its load."""
        springs = chain.n - 1
        start = tuple(self.theta) * (springs if len(self.theta) == 1 else 1)
        passed = Leg(start[:springs], leg.begin).expansion(chain)
        numbers, ramps = self.numbers.copy(), [split(chain.l0 * ramp) for ramp in passed]
        high, low = np.array([*ramps, (0.0, 0.0)]).T
        numbers[TENSION], error = two_sum.py_func(numbers[TENSION], -high)
        numbers[TENSION_LOW] += error - low
        shares = np.array([split(share) for share in leg.expansion(chain)]).T.copy()
        return self._replace(numbers=numbers, expansion=shares, load=(0.0, 0.0))


def rational(value: Any) -> Fraction:
    """Return a state's number (float, Fraction, mpmath or ball midpoint) as a rational."""
    try:
        return exact_number(value, "state")
    except InputError:
        return Fraction(float(value))


def dilation(chain: Chain, load: tuple[float, float]) -> float:
    """Return the float64 nearest to theta, from ``l0 theta``."""
    (high, below), (low, under) = (part.as_integer_ratio() for part in load)
    l0 = chain.l0
    return (high * under + low * below) * l0.denominator / (below * under * l0.numerator)


@lru_cache(maxsize=64)
def _of_chain(chain: Chain) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rows of `layout.OF_CHAIN` of its sliders, and the expansion of its springs."""
    most = None if "friction" in chain.unlike else 1  # of one slider if they are alike
    mu_d, mu_s = chain.each("mu_d")[:most], chain.each("mu_s")[:most]
    out, expansion = np.zeros((layout.CELLS, chain.n)), np.zeros((2, chain.n - 1))
    out[layout.FRICTION] = [chain.times_cosine(low) for low in mu_d]
    out[layout.WEIGHT] = chain.sin_alpha
    for end in {0, chain.n - 1}:
        out[layout.WEIGHT, end] += nearest_float(chain.pull(end))
    out[[layout.MU_D, layout.MU_D_LOW]] = np.transpose([split(low) for low in mu_d])
    out[layout.MEAN] = [nearest_float(high) for high in mu_s]
    excess = [chain.times_cosine(high - low) for low, high in zip(mu_d, mu_s, strict=True)]
    out[layout.MEAN_EXCESS] = excess
    for slider, rate in chain.rates.items():
        out[[layout.RATE, layout.RATE_LOW], slider] = split(rate)
    expansion[:] = np.transpose([split(share) for share in chain.expansion or (Fraction(1),)])
    return out[layout.OF_CHAIN], expansion


@lru_cache(maxsize=64)
def _constants(chain: Chain) -> NDArray[np.int64]:
    """Return the first fields of `Workspace.now` for all simulations of a chain, as bits."""
    made = np.zeros(1, dtype=layout.NOW)
    made["stage"], made["counts"]["target"] = layout.UNSTABLE, 1
    constants = made["chain"][0]
    friction = _of_chain(chain)[0][0]
    constants["friction"] = friction[friction <= _NAIL * np.median(friction)].max()
    constants["least_friction"] = friction.min()
    constants["mean_friction"] = chain.times_cosine(mean_mu_d(chain))
    pull = sum(chain.end_forces, Fraction(0)) / chain.n
    constants["mean_weight"] = chain.sin_alpha + nearest_float(pull)
    constants["cosine"] = chain.cos_alpha
    constants["width"] = nearest_float(chain.sigma_mu)
    constants["n"] = chain.n
    constants["constant"] = chain.sigma_mu == 0
    constants["even"] = not chain.expansion
    constants["downhill"] = next((way for way in (1, -1) if surplus(chain, way) >= 0), 0)
    constants["longest"] = longest_avalanche(chain)
    return made.view(np.int64)


def placed(
    chain: Chain, origin: Origin, seed: int, logging: bool, used: Workspace | None = None
) -> Workspace:
    """Return the arrays of a simulation that begins at rest; `logging`: whether it logs events.

    It reuses the arrays `used`, if given, of a chain of the same length and logging.
    """
    work = _room(chain.n, logging) if used is None else used
    now = work.now
    now.view(np.int64)[:] = _constants(chain)  # by fields it takes longer
    now["theta"], now["theta_low"] = origin.load
    now["total"] = origin.numbers[PLACE].sum()
    now["chain"]["logging"] = logging
    now["chain"]["seed"] = seed if seed < 2**63 else seed - 2**64
    place(work.cell, work.whole, work.now, origin.numbers, origin.of_chain, origin.state.draws)
    prepare(work.cell, work.whole, work.deviate, work.now)
    return work


def _room(n: int, logging: bool) -> Workspace:
    m = layout.columns(n)
    cell, deviate = _aligned((layout.CELLS, m), (m, KEPT))
    return Workspace(
        cell=cell,
        whole=np.zeros((layout.WHOLES, m), dtype=np.int64),
        deviate=deviate,
        clock=_clock(n) if n > layout.LONGEST_SHORT else None,
        series=series_of(n) if n > _ALONE else None,
        now=np.empty(1, dtype=layout.NOW),
        log=np.empty((4 * n + _ROWS) * logging, dtype=layout.LOGGED_EVENT),
    )


def _clock(n: int) -> NDArray[np.float64]:
    strips = layout.columns(n) // 8
    clock = _aligned((CLOCKS * strips + layout.keys(n), 8))[0]
    clock[layout.KEY : CLOCKS * strips : CLOCKS] = NEVER
    clock[CLOCKS * strips :] = NEVER
    return clock


def series_of(n: int) -> NDArray[np.float64]:
    """Return room for the series of a chain of `n` sliders, which have no memory."""
    return _aligned((SERIES * (layout.columns(n) // 8) + LADDER, 8))[0]


def _aligned(*shapes: tuple[int, int]) -> list[NDArray[np.float64]]:
    """Return tables that begin at a multiple of 64 bytes; their sizes are multiples of 8."""
    room = np.zeros(sum(height * columns for height, columns in shapes) + 8)
    begin = -room.ctypes.data % 64 // 8
    tables = []
    for height, columns in shapes:
        tables.append(room[begin : begin + height * columns].reshape(height, columns))
        begin += height * columns
    return tables


def turn(chain: Chain, leg: Leg, work: Workspace) -> None:
    """Let ``l0 theta`` go from 0 to l0 along a leg on which each spring has its own dilation.

    The effect of theta so far becomes part of the forces at rest.
    """
    now, own = work.now, slice(PAD, PAD + chain.n)
    rows_here = layout.RATE, layout.RATE_LOW, layout.FORCE, layout.FORCE_LOW, layout.REST
    rate, rate_low, force, low, rest = (work.cell[row, own] for row in rows_here)
    theta, theta_low = now["theta"], now["theta_low"]
    by, lost = two_product(theta, rate)
    total, rounded = two_sum.py_func(force, by)
    low += rounded + (lost + rate * theta_low + rate_low * theta)
    force[:], low[:] = two_sum.py_func(total, low)
    rest[:] = force
    rate[:] = rate_low[:] = 0.0
    for slider, change in leg.rates(chain).items():
        rate[slider], rate_low[slider] = split(change)
    find_driven(work.cell, work.whole, now)
    now["theta"] = now["theta_low"] = 0.0
    now["chain"]["even"] = 0


def at_rest(work: Workspace) -> dict[str, NDArray[Any]]:
    """Return a copy of the numbers of a chain at rest from which `go_on` goes on bit for bit."""
    now = work.now[0]
    own = slice(PAD, PAD + int(now["chain"]["n"]))
    return {
        "numbers": work.cell[layout.AT_REST_ROWS, own],
        "whole": work.whole[: layout.EVENT, own].copy(),
        "sums": np.array(now[list(_SUMS)].tolist()),
    }


def go_on(work: Workspace, kept: Mapping[str, Any]) -> None:
    """Place a chain at rest as it was when `at_rest` returned `kept`."""
    own = slice(PAD, PAD + kept["numbers"].shape[1])
    work.cell[layout.AT_REST_ROWS, own] = kept["numbers"]
    work.cell[layout.REST, own] = work.cell[layout.FORCE, own]
    work.whole[: layout.EVENT, own] = kept["whole"]
    for name, value in zip(_SUMS, kept["sums"].tolist(), strict=True):
        work.now[name] = value
    work.now["stage"] = layout.AT_REST
    find_driven(work.cell, work.whole, work.now)
    prepare(work.cell, work.whole, work.deviate, work.now)


@compiled
def find_driven(cell, whole, scalars):
    """List the sliders whose force depends on theta."""
    now = scalars[0]
    now.chain.driven = 0
    for i in range(PAD, PAD + now.chain.n):
        if cell[layout.RATE, i] != 0.0:
            whole[layout.DRIVEN, now.chain.driven] = i
            now.chain.driven += 1


@compiled
def place(cell, whole, scalars, numbers, of_chain, draws):
    """Fill in forces, displacements and contacts, but not the draws, which `prepare` makes."""
    now = scalars[0]
    n = now.chain.n
    cell[:] = 0.0
    whole[:] = 0
    before, before_low = 0.0, 0.0
    for k in range(n):
        i = k + PAD
        for row in range(len(of_chain)):
            cell[layout.FRICTION + row, i] = of_chain[row, k]
        after = numbers[TENSION, k] if k < n - 1 else 0.0
        after_low = numbers[TENSION_LOW, k] if k < n - 1 else 0.0
        force, low = two_sum(after, -before)
        low += after_low - before_low
        force, error = two_sum(force, cell[layout.WEIGHT, i])
        low += error
        by, by_low = rows.of_theta(cell, now, i)
        force, low = rows.increased((force, low), -by, -by_low)  # without theta
        cell[layout.FORCE, i] = force
        cell[layout.REST, i] = force
        cell[layout.FORCE_LOW, i] = low
        cell[layout.TRAVEL, i] = numbers[PLACE, k]
        cell[layout.TRAVEL_LOW, i] = numbers[PLACE_LOW, k]
        before, before_low = after, after_low
    find_driven(cell, whole, scalars)
    for i in range(cell.shape[1]):
        cell[layout.STIFFNESS, i] = 2.0
        cell[layout.EXCESS, i] = NEVER
    for k in range(n):
        i = k + PAD
        held = numbers[HELD, k]
        above = ((held - cell[layout.MU_D, i]) - cell[layout.MU_D_LOW, i]) + numbers[HELD_LOW, k]
        cell[layout.EXCESS, i] = excess_of(now, above)
        if now.chain.constant == 1 and held == cell[layout.MEAN, i]:
            cell[layout.EXCESS, i] = cell[layout.MEAN_EXCESS, i]
        cell[layout.COEFFICIENT, i] = held
        whole[layout.DRAWS, i] = draws[k]
    cell[layout.STIFFNESS, PAD] = 1.0 if n > 1 else 0.0
    cell[layout.STIFFNESS, PAD + n - 1] = cell[layout.STIFFNESS, PAD]


@compiled
def _read(
    cell, whole, scalars, began, drawn, tensions, displacements, coefficients, draws
):  # fmt: skip
    """Write the present state to the last four; without disorder coefficients do not change."""
    now = scalars[0]
    for k in range(draws.size):
        i = k + PAD
        displacements[k] = rows.displacement(cell, i)
        draws[k] = whole[layout.DRAWS, i]
        renewed = now.chain.constant == 1 and draws[k] > drawn[k]
        coefficients[k] = cell[layout.MEAN, i] if renewed else cell[layout.COEFFICIENT, i]
    for k in range(tensions.size):
        tensions[k] = rows.tension(cell, now, began, k)
