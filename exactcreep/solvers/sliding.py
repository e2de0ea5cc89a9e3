"""The sliding limit: the chain without inertia and without the static excess (mu_s -> mu_d).

Without an excess every slider that reaches its threshold slides on continuously with theta, at
the friction ``b = mu_d c``, and the equations of motion become a balance of forces. Their solution
is closed. Adding up ``|F_k| <= b`` from either end of the chain bounds every tension,
``D_n <= T_n <= C_n`` with

    D_n = -min(n (b + s), (N - n) (b - s)),    C_n = min(n (b - s), (N - n) (b + s)),

and a ramp takes *each spring by itself* to its bound: a dilation by ``u = l0 d(theta)`` to
``max(T_n - u, D_n)``, a contraction to ``min(T_n + u, C_n)``. (Both keep ``|F_n| <= b``, because
the maximum and the minimum of two sequences with bounded steps have bounded steps.) The extension
``e_n = T_n + l0 theta`` is therefore the play operator of ``l0 theta``: pushed up by
``l0 theta + D_n``, down by ``l0 theta + C_n``, at rest in between; it cannot drift.

The springs at their bound form two fronts that grow inwards from the ends of the chain. They
meet at the *pivot*, which no dilation moves: slider i with ``0 < i - z < 1``,
``z = N (1 - tan_alpha/mu_d)/2``, and slider N + 1 - i for contractions. All displacements follow by
adding up extensions outwards from it: O(N) per half-cycle, whatever the amplitude. If z is an
integer, sliders z and z + 1 may both be the pivot and the limit is not unique: the balance of
forces leaves open how they share the extension of the spring between them. For
``|tan_alpha| > mu_d`` no balance of forces holds the chain; at equality friction takes exactly what
gravity gives, and one holds it wherever it is: there is no limit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import njit
from exactcreep.laws import pivots, prediction
from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.motion.cosine_field import CosineField, Quadratic
from exactcreep.solvers.relaxation import relaxed
from exactcreep.solvers.solver import (
    ONE_REARRANGEMENT,
    Rearrangement,
    Simulation,
    Solver,
    Stretch,
    Tally,
    refuse_records,
)

RECORDED = ("x_G", "x", "tension", "slips")
"""What the sliding limit can record: it has no events in time."""

_PAUSE = 10**7  # sliders times half-cycles between two looks at a clock: some ten milliseconds
_LAW_BITS = 256  # of the law beside an exact run
TIES = ("mean", "downhill", "uphill")
"""How two equally possible pivots are told apart; see `Sliding`."""


def _held(chain: Chain) -> bool:
    """Whether friction can hold the chain at all, as rationals."""
    return abs(chain.tan_alpha) < chain.mu_d or (chain.n == 1 and not _too_steep(chain))


def _too_steep(chain: Chain) -> bool:
    return abs(chain.tan_alpha) > chain.mu_d


def _not_held_because(chain: Chain) -> str:
    if _too_steep(chain):
        return "|tan_alpha| > mu_d: without a static excess no balance of forces holds the chain"
    return (
        "|tan_alpha| = mu_d: friction takes exactly what gravity gives; without a static excess any"
        " displacement of the whole chain is in balance"
    )


def _resting(chain: Chain) -> list[int]:
    """Return the slider that no dilation moves, or the two between which the limit is open."""
    return [1] if chain.n == 1 else [i - 1 for i in pivots(chain.n, chain.tan_alpha, chain.mu_d)]


def exact_cosine(chain: Chain) -> Fraction | Quadratic:
    """Return cos(alpha) exactly, a rational for Pythagorean slopes (3/4, 5/12)."""
    cosine = CosineField(chain.tan_alpha).times_cosine(Fraction(1))
    rational, multiple = cosine.rationals()
    return cosine if multiple else rational


def _ramp(way, place, bound, extension, above, below, share, x, carry, sliding, slips):
    """Push every spring to its bound and move the sliders outwards from the pivot.

    `place` is ``l0 theta``, ``bound[m] + place`` the least (way = +1) or largest (-1) extension of
    spring m. Springs below `above` end at sliders above the pivot, those from `below` on at
    sliders below it; if ``below = above + 1``, spring `above` lies between two pivots, and
    `share` of its extension goes to the lower one. Positions are kept with their rounding error
    (`carry`, zero in exact arithmetic). Returns how much the shared spring gave.
    """
    last = x.size - 1
    shared = place - place
    if below > above:
        edge = bound[above] + place
        change = edge - extension[above]
        if (way > 0 and change > 0) or (way < 0 and change < 0):
            extension[above] = edge
            shared = change
    shift = shared * share
    slider = below
    while slider <= last:
        if shift != 0:
            total = x[slider] + shift
            carry[slider] += (x[slider] - total) + shift
            x[slider] = total
            if sliding[slider] == 0:
                sliding[slider] = 1
                slips[slider] += 1
        if slider < last:
            edge = bound[slider] + place
            change = edge - extension[slider]
            if (way > 0 and change > 0) or (way < 0 and change < 0):
                extension[slider] = edge
                shift = shift + change
        slider += 1
    shift = shared * share - shared
    slider = above
    while slider >= 0:
        if shift != 0:
            total = x[slider] + shift
            carry[slider] += (x[slider] - total) + shift
            x[slider] = total
            if sliding[slider] == 0:
                sliding[slider] = 1
                slips[slider] += 1
        if slider > 0:
            edge = bound[slider - 1] + place
            change = edge - extension[slider - 1]
            if (way > 0 and change > 0) or (way < 0 and change < 0):
                extension[slider - 1] = edge
                shift = shift - change
        slider -= 1
    return shared


_ramp_float = njit(cache=True, nogil=True, error_model="numpy")(_ramp)


@njit(cache=True, nogil=True, error_model="numpy")
def _follow_float(
    places, start, way, low, high, groups, shares, extension, x, carry, sliding, slips,
    totals, x_g, x_rows, tension_rows, slip_rows,
):
    """Follow ``places = l0 theta`` from `start`; returns the direction of the last ramp.

    `totals` gathers the extension of the shared spring (0), the half-cycles in which it gave way
    (1), the starts (2) and the stops (3) of sliders.
    """
    n = x.size
    place = start
    for q in range(places.size):
        slips[:] = 0
        turn = 0
        if places[q] > place:
            turn = 1
        elif places[q] < place:
            turn = -1
        place = places[q]
        if turn != 0:
            if turn != way:
                for k in range(n):
                    totals[3] += sliding[k]
                    sliding[k] = 0
            way = turn
            row = 0 if way > 0 else 1
            shared = _ramp_float(
                way, place, low if way > 0 else high, extension, groups[row, 0], groups[row, 1],
                shares[row], x, carry, sliding, slips,
            )
            if shared != 0.0:
                totals[0] += abs(shared)
                totals[1] += 1.0
        total = 0.0
        rest = 0.0
        count = 0
        for k in range(n):
            total += x[k]
            rest += carry[k]
            count += slips[k]
        totals[2] += count
        x_g[q] = (total + rest) / n
        if x_rows.shape[0] > 0:
            for k in range(n):
                x_rows[q, k] = x[k] + carry[k]
        if tension_rows.shape[0] > 0:
            for k in range(n - 1):
                tension_rows[q, k] = extension[k] - place
        if slip_rows.shape[0] > 0:
            slip_rows[q, :] = slips
    return way


class SlidingSimulation(Simulation):
    """A chain in the sliding limit on its way along a drive."""

    def __init__(
        self,
        chain: Chain,
        state: State,
        seed: int,
        record: tuple[str, ...],
        exact: bool,
        pivot: str,
    ) -> None:
        refuse_records(
            record,
            RECORDED,
            ": without inertia there are no events in time; solver 'exact' has them",
        )
        self.chain, self.seed, self.record = chain, seed, record
        self.exact, self.pivot = exact, pivot
        self.tally = Tally()
        self._start = state
        self._relaxed = False
        self._way = 0
        self._theta = state.theta
        self._amplitude: Fraction | None = None  # of the cycles, if it is driven by cycles
        n = chain.n
        self._slips = np.zeros(n, dtype=np.int64)
        self._sliding = np.zeros(n, dtype=np.int8)
        self._totals: NDArray[Any] = np.zeros(4, dtype=object if exact else np.float64)
        if not _held(chain):
            return
        cosine: Any = exact_cosine(chain) if exact else None

        def force(value: Fraction) -> Any:
            return value * cosine if exact else chain.times_cosine(value)

        self._uphill = force(chain.mu_d + chain.tan_alpha)  # b + s, b - s
        self._downhill = force(chain.mu_d - chain.tan_alpha)
        rest = _resting(chain)
        across = [n - i for i in rest][::-1]
        # dilations: springs 1..i-1 feel the bound from above, the others the one from below
        self._low = self._array(
            [
                -(k * self._uphill) if k < rest[-1] else -((n - k) * self._downhill)
                for k in range(1, n)
            ]
        )
        self._high = self._array(
            [
                k * self._downhill if k <= across[0] else (n - k) * self._uphill
                for k in range(1, n)
            ]
        )
        self._groups = np.array(
            [[rest[0] - 1, rest[-1] - 1], [across[0], across[-1]]], dtype=np.int64
        )
        half = Fraction(1, 2)
        one, none = Fraction(1), Fraction(0)
        ways = {"mean": (half, half), "downhill": (one, none), "uphill": (none, one)}
        self._shares = self._array(list(ways[pivot]))
        given = [self._number(value) for value in state.tensions.tolist()]
        self._x = self._array([self._number(v) for v in state.displacements.tolist()])
        self._carry = self._x - self._x
        steps = np.diff(self._array([self._number(0), *given, self._number(0)]))
        slack = 0 if exact else 4 * np.spacing(max([abs(v) for v in given] + [self._uphill]))
        if np.any(steps > self._downhill + slack) or np.any(steps < -self._uphill - slack):
            given, shift = relaxed(given, self._uphill, self._downhill)
            self._x = self._x + self._array(shift)
            self._relaxed = True
        place = self._place(state.theta)
        self._extension = self._array([value + place for value in given])

    def _number(self, value: Any) -> Any:
        if not self.exact:
            return float(value)
        return value if isinstance(value, Quadratic) else exact_number(value, "state")

    def _array(self, values: list[Any]) -> NDArray[Any]:
        array = np.empty(len(values), dtype=object if self.exact else np.float64)
        array[:] = values
        return array

    def _place(self, theta: Any) -> Any:
        if self.exact:
            return self.chain.l0 * exact_number(theta, "theta")
        return nearest_float(self.chain.l0) * float(theta)

    def follow(
        self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS
    ) -> Stretch:
        """Take the chain to targets `first` .. `first + count - 1`; see `Simulation.follow`."""
        if not _held(self.chain):
            lost = Stop.RUNAWAY if _too_steep(self.chain) else Stop.LIMIT
            return Stretch(0, {}, lost, _not_held_because(self.chain))
        self._amplitude = drive.amplitude if isinstance(drive, Cycles) else None
        n = self.chain.n
        kind: Any = object if self.exact else np.float64

        def rows(name: str, width: int, dtype: Any = kind) -> NDArray[Any]:
            return np.empty((count if name in self.record else 0, width), dtype=dtype)

        x_g = np.empty(count, dtype=kind)
        x_rows, tension_rows = rows("x", n), rows("tension", n - 1)
        slip_rows = rows("slips", n, np.int64)
        before = self._totals.copy()
        done, events, most = 0, 0, 1
        stop: Stop | None = None
        while stop is None:
            if not self.exact:  # no slider starts or stops more than once in a half-cycle
                most = max(1, min(_PAUSE // n, (limits.events_left - events) // (2 * n)))
            part = slice(done, min(done + most, count))
            out = (x_g[part], x_rows[part], tension_rows[part], slip_rows[part])
            if self.exact:
                self._follow_exact(drive, first + done, *out)
            else:
                self._follow_compiled(drive, first + done, *out)
            done = part.stop
            _, gave_way, starts, stops = (self._totals - before).tolist()
            events = int(starts + stops)
            stop = Stop.DONE if done == count else limits.stop(events)
        self.tally.undecided += int(gave_way)
        self.tally.slips += int(starts)
        self.tally.events += events
        recorded: dict[str, NDArray[Any]] = {"x_G": x_g[:done]}
        for name, table in (("x", x_rows), ("tension", tension_rows), ("slips", slip_rows)):
            if name in self.record:
                recorded[name] = table[:done]
        return Stretch(done, recorded, stop, limits.reason(stop))

    def _follow_compiled(
        self, drive: Drive, first: int, x_g: NDArray[Any], x_rows: NDArray[Any],
        tension_rows: NDArray[Any], slip_rows: NDArray[Any],
    ) -> None:
        theta = drive.targets(first, x_g.size, self.seed)
        self._way = int(
            _follow_float(
                nearest_float(self.chain.l0) * theta, self._place(self._theta), self._way,
                self._low, self._high, self._groups, self._shares, self._extension, self._x,
                self._carry, self._sliding, self._slips, self._totals, x_g, x_rows,
                tension_rows, slip_rows,
            )
        )
        self._theta = float(theta[-1])

    def _follow_exact(
        self, drive: Drive, first: int, x_g: NDArray[Any], x_rows: NDArray[Any],
        tension_rows: NDArray[Any], slip_rows: NDArray[Any],
    ) -> None:
        """Do what the compiled `_follow_float` does, in exact arithmetic."""
        for q in range(x_g.size):
            theta = drive.exact_target(first + q, self.seed)
            turn = (theta > exact_number(self._theta, "theta")) - (
                theta < exact_number(self._theta, "theta")
            )
            self._theta = theta
            place = self._place(theta)
            self._slips[:] = 0
            if turn != 0:
                if turn != self._way:
                    self._totals[3] += int(self._sliding.sum())
                    self._sliding[:] = 0
                self._way = turn
                row = 0 if turn > 0 else 1
                shared = _ramp(  # type: ignore[no-untyped-call]
                    turn, place, self._low if turn > 0 else self._high, self._extension,
                    int(self._groups[row, 0]), int(self._groups[row, 1]), self._shares[row],
                    self._x, self._carry, self._sliding, self._slips,
                )
                if shared != 0:
                    self._totals[0] += abs(shared)
                    self._totals[1] += 1
            self._totals[2] += int(self._slips.sum())
            x_g[q] = sum(self._x.tolist(), Fraction(0)) / self.chain.n
            if len(x_rows):
                x_rows[q] = self._x
            if len(tension_rows):
                tension_rows[q] = self._extension - place
            if len(slip_rows):
                slip_rows[q] = self._slips

    def state(self) -> State:
        """Return the present state; coefficients and draws are those of the start."""
        if not _held(self.chain):
            return self._start
        return State(
            tensions=self._extension - self._place(self._theta),
            displacements=self._x + self._carry,
            coefficients=self._start.coefficients,
            draws=self._start.draws,
            theta=self._theta,
        )

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit: arrays, numbers and strings by name."""
        captured: dict[str, Any] = {
            "way": self._way, "theta": _written(self._theta), "slips": self.tally.slips,
            "events": self.tally.events,
            "amplitude": None if self._amplitude is None else str(self._amplitude),
            "undecided": self.tally.undecided, "relaxed": self._relaxed,
            "sliding": self._sliding.copy(), "coefficients": self._start.coefficients,
            "draws": self._start.draws,
        }
        if _held(self.chain):
            for name in ("extension", "x", "carry", "totals"):
                array = getattr(self, "_" + name)
                captured[name] = (
                    np.array([_written(v) for v in array.tolist()]) if self.exact else array.copy()
                )
        return captured

    def restore(self, captured: Mapping[str, Any]) -> None:
        """Take over what `capture` returned (for the same chain, seed and solver)."""
        self._way = int(captured["way"])
        self._theta = self._read(captured["theta"])
        self._relaxed = bool(captured["relaxed"])
        self._sliding = np.array(captured["sliding"], dtype=np.int8)
        self.tally.slips = int(captured["slips"])
        self.tally.events = int(captured["events"])
        amplitude = captured["amplitude"]
        self._amplitude = None if amplitude is None else Fraction(amplitude)
        self.tally.undecided = int(captured["undecided"])
        self._start = State(
            tensions=self._start.tensions,
            displacements=self._start.displacements,
            coefficients=np.array(captured["coefficients"]),
            draws=np.array(captured["draws"], dtype=np.int64),
            theta=self._start.theta,
        )
        if _held(self.chain):
            for name in ("extension", "x", "carry", "totals"):
                values = np.asarray(captured[name])
                if self.exact:
                    values = self._array([self._read(v) for v in values.tolist()])
                setattr(self, "_" + name, np.array(values))

    def _read(self, text: Any) -> Any:
        if not isinstance(text, str):
            return text
        parts = text.split(" ")
        if len(parts) == 1:
            return Fraction(text)
        return CosineField(self.chain.tan_alpha).number(Fraction(parts[0]), Fraction(parts[1]))

    @property
    def evidence(self) -> Evidence:
        """Proved in exact arithmetic, computed in float64; undecided if the limit is not unique."""
        if _too_steep(self.chain):
            return Evidence.PROVED
        if self.tally.undecided or not _held(self.chain):
            return Evidence.UNDECIDED
        return Evidence.PROVED if self.exact else Evidence.COMPUTED

    def report(self) -> dict[str, Any]:
        """Return the pivots and, where the limit is not unique, what it leaves open.

        ``x_G_low`` and ``x_G_high`` are the present values of x_G if the pivot had always been
        the one that lets the chain move least, or most, downhill; for Cycles ``velocity_low`` and
        ``velocity_high`` are the two velocities per half-cycle of the asymptotic cycle.
        """
        chain = self.chain
        report: dict[str, Any] = {
            "arithmetic": "exact" if self.exact else "float64",
            "static_excess_left_out": chain.mu_s > chain.mu_d or chain.sigma_mu > 0,
            "start_relaxed": self._relaxed,
        }
        if not _held(chain):
            report["reason"] = _not_held_because(chain)
            return report
        report["pivots"] = list(_resting(chain))
        report["unique"] = self.tally.undecided == 0
        if not report["unique"]:
            x_g = sum((self._x + self._carry).tolist(), Fraction(0)) / chain.n
            open_part = float(self._totals[0])
            below = {"mean": 0.5, "downhill": 1.0, "uphill": 0.0}[self.pivot] * open_part
            report["x_G_low"] = float(x_g) - below
            report["x_G_high"] = float(x_g) - below + open_part
            if self._amplitude is not None:
                law = prediction(chain, Cycles(self._amplitude, 1), bits=_LAW_BITS)
                assert law is not None
                report["velocity_low"], report["velocity_high"] = law.sliding[0], law.sliding[-1]
        return report


def _written(value: Any) -> Any:
    """Return an exact number as a string that `SlidingSimulation` can read, floats as they are."""
    if isinstance(value, Quadratic):
        return f"{value.a} {value.b}"
    return str(value) if isinstance(value, (Fraction, int)) else value


@dataclass(frozen=True)
class Sliding(Solver):
    """The sliding limit: no inertia, no static excess; `mu_s` and `sigma_mu` play no part.

    A start that friction cannot hold first goes to the rest state nearest in elastic energy. A
    slip is one slider's uninterrupted sliding; its start, and its stop where theta turns, are
    counted as events, but there are no rearrangements, and no events that could be recorded.

    Parameters
    ----------
    exact : bool
        Compute with exact numbers (rationals for Pythagorean slopes, ``a + b cos(alpha)``
        otherwise) in place of float64.
    pivot : {"mean", "downhill", "uphill"}
        What to take where two neighbours may both be the pivot and the limit is not unique: the
        one with which the chain moves further downhill, further uphill, or both in equal shares.
        The half-cycles in which it mattered are counted as undecided.

    Notes
    -----
    Guarantee: with ``exact=True`` every number is exact. In float64 each extension is the rounded
    exact one, without drift, and positions are sums kept with their rounding error.
    """

    exact: bool = False
    pivot: str = "mean"
    name: ClassVar[str] = "sliding"
    summary: ClassVar[str] = "no inertia, no static excess: piecewise linear in theta"

    def __post_init__(self) -> None:
        if not isinstance(self.exact, bool):
            raise InputError("exact", self.exact, "must be true or false")
        if self.pivot not in TIES:
            raise InputError("pivot", self.pivot, "must be one of " + ", ".join(TIES))

    def rearrange(
        self,
        chain: Chain,
        state: State,
        direction: int,
        seed: int,
        limits: Limits = ONE_REARRANGEMENT,
    ) -> Rearrangement:
        """Refuse: without inertia there are no rearrangements."""
        raise InputError(
            "solver",
            self.name,
            "has no rearrangements (sliders slide continuously with theta); use 'exact'",
        )

    def simulation(
        self, chain: Chain, state: State, seed: int, record: tuple[str, ...]
    ) -> SlidingSimulation:
        """Return a simulation that starts from `state`."""
        return SlidingSimulation(chain, state, seed, record, self.exact, self.pivot)
