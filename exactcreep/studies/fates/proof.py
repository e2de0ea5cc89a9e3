"""Prove what a chain does for ever, by following the certified solver until it returns.

*Lone slips.* A slip of a slider alone, from its threshold, moves an end by 2 D and an inner slider
by D, whatever the state is. If the lone slips since an avalanche have moved all sliders alike, the
tensions have returned exactly.

*Avalanches.* A state at the end of a cycle consists of a *shape* f, which no ramp changes, and a
*load* u, how far a ramp has taken it (see `solvers.field.tangent`). Every rearrangement begins at a
slider that theta drives, so a change of u only shifts the theta at which it happens. Along one
itinerary the shape therefore evolves independently, f -> G(f), and u -> u + tau(f). The load never
contracts: the direction of a ramp is neutral. But a symmetry can bring u back. Exchanging the ends
of the chain and replacing theta by -theta turns u into -u, and leaves the equations unchanged if
sliders at equal distances from the ends are alike. End forces do not matter, as they act by their
sum. Nor does dynamical friction that differs, if such a pair slips in one direction S only and has
equal mu_s - mu_d: the forces that are exchanged then differ by S c times the difference of mu_d.
Suppose the second half of a period is the mirror image of the first, in its avalanches and in the
sums of the lone slips between them. In the mirrored frame each half is f -> H(f),
u -> tau(f) + constant - u, with G = H H, and a period moves u by ``tau(H(f)) - tau(f)``. Where G
contracts by rho over a period, these moves are bounded by a geometric series: the load stays within
``|dtau| |H(f) - f|/(1 - rho)`` for ever, and converges.

The balls prove that all states of a joint set of shapes and loads share one itinerary over a
period, and enclose the derivatives of G and tau over it. Shapes are measured in the norm of a
discrete Lyapunov equation, in which a map contracts according to its spectrum. If a period contains
avalanches and lacks this symmetry, the load in general drifts from period to period, until the
itinerary changes; what the chain does for ever remains undecided.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from itertools import chain as joined
from itertools import pairwise
from typing import Any, NamedTuple

import flint
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov

from exactcreep.model.chain import Chain, no_advance
from exactcreep.model.contacts import Itinerary
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import Enclosure, enclosure, exact_value
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Undecided, balls_of
from exactcreep.motion.cosine_field import Quadratic
from exactcreep.solvers.field.certified import Certified
from exactcreep.solvers.field.simulation import CertifiedSimulation
from exactcreep.solvers.field.tangent import Frame, TangentMechanics
from exactcreep.solvers.interface import Start, simulate
from exactcreep.solvers.tables import LoggedRearrangement, rearrangements
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

Bracket = tuple[Fraction, Fraction]
HalfCycle = tuple[Itinerary, ...]
"""The itineraries of the rearrangements of one half-cycle."""
_MOST_PERIOD = 1000  # cycles: the longest period that is detected
_DIGITS = 38  # initially
_PROOF_BITS = 128  # precision of conclusions from the derivatives
_CLOSE = 2.0**-40  # distance at which a shape has returned well enough for a proof
_BETTER = 2.0**-8  # required gain of this distance over a shorter period
_CLOSER = 0.25  # required gain of this distance before the next attempt
_LEAST = 2.0**-100  # least half width of the joint set
_ROOM = 4.0  # factor by which the joint set is larger than necessary
_SQUARINGS = 12  # of a matrix, for a bound of its norm


class Leaping(CertifiedSimulation):
    """A certified simulation that notes which amplitudes have the same events.

    It raises its precision in large steps, since transients cost it.
    """

    leap = 4
    gap: Any = None
    """How far beyond all targets so far ``l0 theta`` could have gone without another event."""
    kept: Any = None
    """The same at the anchor."""

    def _arrive(self, target: Fraction) -> None:
        mechanics = self.mechanics
        for n, rate in mechanics.rates.items():
            sign = self.way if rate > 0 else -self.way
            gap = mechanics.room(n, sign) if sign else mechanics.field.rational(Fraction(0))
            if mechanics.rest.set is not None:
                gap = gap + flint.arb(0, 2 * mechanics.slack * mechanics.stretches[n])
            self.gap = gap if self.gap is None else smaller(gap, self.gap)
        super()._arrive(target)

    def _drop_anchor(self, target: int | None) -> None:
        super()._drop_anchor(target)
        self.kept = self.gap

    def _go_back(self) -> None:
        super()._go_back()
        self.gap = self.kept

    def same_events(self, amplitude: Fraction, log: list[LoggedRearrangement]) -> Bracket | None:
        """Return the range of amplitudes with these events so far, rounded inward.

        The itinerary and theta_c do not depend on the amplitude as long as theta reaches the same
        theta_c. So the range ends at the largest theta_c reached, and at the least at which another
        event would have followed. None: theta drives no slider, or is ramped back from the start.
        """
        if self.gap is None or abs(exact_value(self.start.state.theta)) > amplitude:
            return None  # the smaller the amplitude, the further the way back
        with self.mechanics.arithmetic.active():
            further = self.mechanics.arithmetic.number(self.gap / self.mechanics.l0)
            middle, radius = enclosure(further)
        thetas = (enclosure(one.theta) for one in log)
        reached = max((abs(x.middle) + x.radius for x in thetas), default=Fraction(0))
        return reached, amplitude + middle - radius


def quiet(*_: Any) -> Any:
    """Say nothing."""


class ProvedFate(NamedTuple):
    """A fate, the events until it was known, and the amplitudes with the same events until then.

    The times of events are the midpoints of their enclosures.
    """

    fate: Fate
    log: list[LoggedRearrangement]
    between: Bracket | None

    @property
    def shared(self) -> bool:
        """Whether the chain has the same fate at all these amplitudes."""
        known = self.fate.evidence is Evidence.PROVED and self.fate.settled_after is not None
        # tensions that only approach a cycle depend on the amplitude
        return known and "contraction" not in self.fate.report


def proved_fate(
    chain: Chain,
    drive: Cycles,
    start: State,
    limits: Limits = NO_LIMITS,
    say: Callable[..., None] = quiet,
    digits: int = 1,
) -> ProvedFate:
    """Follow a chain until its fate is proved, with `digits` digits at least."""
    proof = _Proof(chain, drive, start, limits, digits)
    fate = proof.fate(say)
    return ProvedFate(fate, proof.log, proof.simulation.same_events(drive.amplitude, proof.log))


class _Proof:
    """One certified trajectory, examined after every cycle."""

    def __init__(
        self, chain: Chain, drive: Cycles, start: State, limits: Limits, digits: int
    ) -> None:
        self.chain, self.drive, self.start, self.limits = chain, drive, start, limits
        solver = Certified(digits=max(_DIGITS, digits), most_digits=30_000)
        self.simulation = Leaping(Start(chain, start, 0), ("events",), solver)
        self.halves: list[HalfCycle] = []
        self.names: dict[tuple[HalfCycle, ...], int] = {}  # number of each cycle by its itineraries
        self.cycles: list[int] = []
        self.log: list[LoggedRearrangement] = []
        self.travel: list[Enclosure] = []  # x_G at the ends of cycles, beginning with the start
        self.shapes: list[NDArray[np.float64]] = []  # there
        self.known: dict[Any, int] = {}  # since the last avalanche: moves of each slider -> cycle
        self.frame = Frame.of(chain)
        self.moves = [Fraction(0)] * chain.n
        self.lengths = _lengths(chain)
        # for a period that was not proved: the distance, or the cycle, at which it is tried again
        self.again: dict[int, tuple[float, int]] = {}
        self.tried = 0
        self.doubt = ""

    def fate(self, say: Callable[..., None]) -> Fate:
        self._look()
        ends = range(2, 2 * self.drive.cycles + 1, 2)
        cycles = simulate(self.simulation, self.drive, ends, self.limits)
        for cycle, stretch in enumerate(cycles, 1):
            if stretch.stop is not Stop.DONE:
                runaway = stretch.stop is Stop.RUNAWAY
                outcome = Outcome.RUNAWAY if runaway else Outcome.LIMIT
                return self._fate(outcome, cycle - 1, stretch.reason)
            log = logged(stretch.recorded)
            self.log += log
            self.halves += _half_cycles(log, 2 * cycle - 1, 2 * cycle)
            self.cycles.append(self.names.setdefault(tuple(self._cycle(cycle)), cycle))
            self._look()
            say("cycles", cycle, 0, "cycles")
            if (known := self._returned(cycle) or self._contracted(cycle)) is not None:
                return known
        reason = self.doubt or f"not settled within {self.drive.cycles} cycles"
        return self._fate(Outcome.LIMIT, self.drive.cycles, reason)

    def _look(self) -> None:
        mechanics = self.simulation.mechanics
        with mechanics.arithmetic.active():
            x_g = enclosure(sum(mechanics.state().displacements.tolist()) / self.chain.n)
            shape = self.frame.shape_of(mechanics.rest.forces)
        self.travel.append(x_g)
        self.shapes.append(np.array([float(x) for x in shape]))

    def _cycle(self, cycle: int) -> list[HalfCycle]:
        return self.halves[2 * cycle - 2 : 2 * cycle]

    def _returned(self, cycle: int) -> Fate | None:
        """Return the fate if lone slips have restored the tensions."""
        for one in joined.from_iterable(self._cycle(cycle)):
            if not lone(one):
                self.known.clear()
                break
            _, sliders, signs = one[0]
            for n, sign in zip(sliders, signs, strict=True):
                self.moves[n - 1] += sign * self.lengths[n - 1]
        held = self.simulation.mechanics.rest.coefficients.tolist()
        # the tensions return if all sliders have moved alike
        key = (tuple(b - a for a, b in pairwise(self.moves)), tuple(held))
        before = self.known.setdefault(key, cycle)
        if not any(self._cycle(cycle)):  # theta has covered its whole range
            before = cycle - 1
        if before == cycle:
            return None
        slips = joined.from_iterable(self.halves[2 * before : 2 * cycle])
        ways = joined.from_iterable(zip(one[0][1], one[0][2], strict=True) for one in slips)
        moved = sum((sign * self.lengths[n - 1] for n, sign in ways), Fraction(0)) / self.chain.n
        arithmetic = self.simulation.mechanics.arithmetic
        with arithmetic.active():
            advance = enclosure(arithmetic.times_cosine(self.chain, moved) if moved else 0)
        return self._settled(before, cycle - before, advance)

    def _contracted(self, cycle: int) -> Fate | None:
        held = self.simulation.mechanics.rest.coefficients - self.chain.floats("mu_s")
        if self.chain.sigma_mu != 0 or len(set(held.tolist())) > 1:
            return None
        best = math.inf
        for period in range(1, min(_MOST_PERIOD, cycle // 2) + 1):
            if self.cycles[-1] != self.cycles[-1 - period]:
                continue
            apart = abs(self.shapes[-1] - self.shapes[-1 - period]).max(initial=0.0)
            near, later = self.again.get(period, (_CLOSE, cycle + 1))
            if apart > near and cycle < later:
                best = min(best, apart)
                continue
            # an approach that alternates comes somewhat closer after several periods
            if apart > best * _BETTER:
                continue
            last, ago = self.halves[-2 * period :], self.halves[-4 * period : -2 * period]
            if last != ago or all(map(lone, joined.from_iterable(last))):
                continue
            if reason := obstacle(self.chain):
                reason = f"the last {2 * period} cycles had the same events twice; {reason}"
                return self._fate(Outcome.LIMIT, cycle, reason)
            if (word := _Word.of(last, self.chain)) is None:
                continue
            self.tried += 1
            try:
                moved, contraction = self._invariant(word)
            except Undecided as doubt:
                self.doubt = str(doubt)
                self.again[period] = (_CLOSER * apart, cycle + max(period, cycle // 4))
                return None
            before = cycle
            while before >= period and self._repeats(before - period, last, moved):
                before -= period
            return self._settled(before, period, moved, contraction=contraction)
        return None

    def _repeats(self, begin: int, halves: list[HalfCycle], moved: Enclosure) -> bool:
        """Return whether the period after cycle `begin` has these events and this advance."""
        a, b = (self.travel[cycle] for cycle in (begin, begin + len(halves) // 2))
        off = abs(b.middle - a.middle - moved.middle) + a.radius + b.radius
        return self.halves[2 * begin :][: len(halves)] == halves and off <= moved.radius

    def _invariant(self, word: _Word) -> tuple[Enclosure, float]:
        """Return advance and contraction of an invariant set, or raise `Undecided`."""
        inner = self.chain.n - 2
        point = self._followed(word, np.zeros((inner, inner)), 0.0)
        first, second = _floats(point.first), _floats(point.second)
        whole = second @ first
        radius = float(max(abs(np.linalg.eigvals(whole)), default=0.0))
        if not radius < 1 - 2.0**-10:
            doubt = f"over a period the shape does not contract (spectral radius {radius:.4g})"
            raise Undecided(doubt)
        goal = (1 + radius) / 2
        norm = _norm(whole / goal)
        inverse = np.asarray(np.linalg.inv(norm), dtype=np.float64)
        d, unsure = (
            float(np.linalg.norm(to @ np.array(way, dtype=np.float64)))
            for to, way in ((norm, point.moved), (abs(norm), point.radii))
        )
        reach = _ROOM * (2 * d / (1 - goal) + d + 4 * unsure) + _LEAST
        row = np.array(point.load_row, dtype=np.float64)
        drift = float(np.linalg.norm(row @ inverse)) * d / (1 - goal)
        load = _ROOM * (drift + float(point.load_radius)) + _LEAST
        joint = self._followed(word, inverse * reach, load)
        with balls_of(_PROOF_BITS).active():
            return joint.advance, contraction(joint, point, norm, inverse, reach, load)

    def _followed(self, word: _Word, spread: NDArray[np.float64], load: float) -> Passed:
        """Follow all states around the present state over one period.

        Raises `Undecided` if not all of them have the given itinerary.
        """
        present, n, doubt = self.simulation.mechanics, self.chain.n, "they part"
        arithmetic, start = present.arithmetic, Start(self.chain, self.simulation.state(), 0)
        with arithmetic.active():
            mechanics = TangentMechanics(start, arithmetic)
            mechanics.begin(spread, load)
            mechanics.half, mechanics.limits = word.half, self.limits
            begin, where = mechanics.known_forces(), sum(mechanics.rest.displacements.tolist())
            forces = present.known_forces()
            radii = [x.rad() for x in self.frame.shape_of(forces)]
            load_radius = 2 * self.frame.load_of(forces).rad()
            try:
                halves = mechanics.follow(self.drive.amplitude, len(word.halves))
            except Undecided as parting:
                halves, doubt = [], str(parting)
        if halves != word.halves or mechanics.at_half is None:
            raise Undecided(f"nearby states do not share the itinerary: {doubt}")
        with arithmetic.active():
            shape, rows = mechanics.at_half
            *first, load_row = [row[: n - 2] for row in rows]
            second = [row[: n - 2] for row in mechanics.derivative()[:-1]]
            end = mechanics.known_forces()
            shifts = [arithmetic.times_cosine(self.chain, shift) for shift in word.shifts]
            begun, ended, shift = (self.frame.shape_of(forces) for forces in (begin, end, shifts))
            # both halves in the frame of a chain at its lower end of theta
            shape = [x + y for x, y in zip(reversed(shape), shift, strict=True)]
            return Passed(
                flint.arb_mat(first[::-1]) if first else flint.arb_mat(0, 0),
                flint.arb_mat([row[::-1] for row in second]) if second else flint.arb_mat(0, 0),
                load_row,
                [x - y for x, y in zip(shape, begun, strict=True)],
                [x - y for x, y in zip(ended, begun, strict=True)],
                radii,
                load_radius,
                enclosure((sum(mechanics.state().displacements.tolist()) - where) / n),
            )

    def _settled(self, before: int, period: int, moved: Enclosure, **proof: float) -> Fate:
        """Return the fate of a chain whose period `period` begins after cycle `before`."""
        last = self.halves[-2 * period :]  # ends a whole number of periods after `before`
        itinerary = tuple((q, one) for q, half in enumerate(last, start=1) for one in half)
        outcome, reason = Outcome.CREEPING, ""
        if not itinerary:
            outcome = Outcome.AT_REST
        elif moved.middle == 0 == moved.radius:
            outcome = Outcome.CYCLING
        elif abs(moved.middle) <= moved.radius:
            reason = "the advance over a period is not told from none"
        known = {"settled_after": before, "period": period, "itinerary": itinerary}
        known |= {"advance": nearest_float(moved.middle), "advance_enclosure": moved}
        return self._fate(outcome, before, reason, proof, **known)

    def _fate(
        self, outcome: Outcome, until: int, reason: str,
        proof: Mapping[str, float] | None = None, **known: Any,
    ) -> Fate:  # fmt: skip
        """Return the fate as far as it is known; search the last advance up to cycle `until`."""
        simulation, last = self.simulation, 0
        for cycle, (a, b) in enumerate(pairwise(self.travel[: until + 1]), 1):
            if abs(b.middle - a.middle) > max(a.radius + b.radius, no_advance(self.chain)):
                last = cycle
        certain = not reason or outcome is Outcome.RUNAWAY
        report = {
            "events": simulation.tally.events,
            "bits": simulation.mechanics.arithmetic.bits,
            "restarts": simulation.restarts,
            "proofs_tried": self.tried,
            **(proof or {}),
        }
        return Fate(
            self.chain, self.drive.amplitude, self.start, "certified", outcome,
            simulation.evidence if certain else Evidence.UNDECIDED,
            cycles=len(self.halves) // 2, advanced_until=last, reason=reason, report=report,
            **known,
        )  # fmt: skip


def logged(recorded: Mapping[str, NDArray[Any]]) -> list[LoggedRearrangement]:
    """Return the events of a run, with midpoints of enclosed times, which need no bound."""
    times = recorded["event_time"]
    if times.dtype == object:
        recorded = {**recorded, "event_time": np.frompyfunc(exact_value, 1, 1)(times)}
    return rearrangements(recorded)


def smaller(x: Any, y: Any) -> Any:
    """Return the smaller of two numbers, exactly if both are exact."""
    if isinstance(x, Quadratic) and isinstance(y, Quadratic):
        return min(x, y)
    return flint.arb.min(*(z.ball() if isinstance(z, Quadratic) else z for z in (x, y)))


def _half_cycles(log: list[LoggedRearrangement], first: int, last: int) -> list[HalfCycle]:
    return [
        tuple(one.itinerary for one in log if one.half_cycle == q) for q in range(first, last + 1)
    ]


def lone(itinerary: Itinerary) -> bool:
    """Return whether it is a slip of one end alone, or of both ends at once far apart."""
    if len(itinerary) != 2:
        return False
    (start, sliders, signs), (stop, stopped, ways) = itinerary
    alike = sliders == stopped and signs == ways
    apart = all(b - a > 1 for a, b in pairwise(sliders))
    return (start, stop) == ("start", "stop") and alike and apart


def mirrored(one: Itinerary, n: int) -> Itinerary:
    """Return an itinerary with the ends of the chain exchanged."""
    return tuple(
        (kind, tuple(n + 1 - m for m in reversed(sliders)), signs[::-1])
        for kind, sliders, signs in one
    )


def _lengths(chain: Chain) -> list[Fraction]:
    """Return the length of a lone slip of each slider from its threshold, over cos(alpha)."""
    excesses = _excesses(chain)
    return [excess * (2 if k in (0, chain.n - 1) else 1) for k, excess in enumerate(excesses)]


def _excesses(chain: Chain) -> list[Fraction]:
    return [high - low for high, low in zip(chain.each("mu_s"), chain.each("mu_d"), strict=True)]


def mirrors(chain: Chain) -> bool:
    """Return whether a half-cycle of the chain can mirror the one before it."""
    excesses, rates = _excesses(chain), [chain.rates.get(k, 0) for k in range(chain.n)]
    return excesses == excesses[::-1] and rates == [-rate for rate in rates[::-1]]


def obstacle(chain: Chain) -> str:
    """Return why no period with avalanches of a chain can be proved; "" if a proof may come."""
    needs = "the same mu_s - mu_d of sliders, and the same expansion of springs, at equal distances"
    needs = f"a proof that avalanches go on alike needs {needs} from the two ends"
    return "" if mirrors(chain) else needs


class _Word(NamedTuple):
    """The rearrangements of a period whose second half mirrors the first.

    Lone slips commute, so only the sum of each slider between two avalanches counts.
    """

    halves: list[HalfCycle]
    half: int  # rearrangements up to the last avalanche of the first half
    shifts: list[Fraction]  # what the mirrored forces lack there, over cos(alpha)

    @classmethod
    def of(cls, halves: list[HalfCycle], chain: Chain) -> _Word | None:
        """Return the word of a period, None if it lacks this symmetry."""
        n = chain.n
        avalanches: list[Itinerary] = []
        places: list[int] = []
        between: list[list[int]] = [[0] * n]
        ways: dict[int, set[int]] = {}  # directions in which each slider starts
        for number, one in enumerate(joined.from_iterable(halves), start=1):
            for _, sliders, signs in one:
                for m, sign in zip(sliders, signs, strict=True):
                    ways.setdefault(m - 1, set()).add(sign)
            if lone(one):
                _, sliders, signs = one[0]
                for m, sign in zip(sliders, signs, strict=True):
                    between[-1][m - 1] += sign
            else:
                avalanches.append(one)
                places.append(number)
                between.append([0] * n)
        k = len(avalanches) // 2
        if k == 0 or len(avalanches) % 2:
            return None
        late = between.pop()
        around = [[a + b for a, b in zip(between[0], late, strict=True)], *between[1:]]
        pairs = zip(avalanches, avalanches[k:], strict=False)
        if not all(early == mirrored(late_one, n) for early, late_one in pairs):
            return None
        if [x[::-1] for x in around[k:]] != around[:k]:
            return None
        shifts, friction = [Fraction(0)] * n, chain.each("mu_d")
        for m, directions in ways.items():
            differs = friction[m] - friction[-1 - m]
            if differs and len(directions) > 1:
                return None
            shifts[m] = min(directions) * differs
        # the lone slips that follow the last avalanche, in the mirrored frame
        moves = [slips * length for slips, length in zip(late, _lengths(chain), strict=True)]
        for m, (a, b) in enumerate(pairwise(moves)):
            shifts[m] += b - a
            shifts[m + 1] -= b - a
        return cls(halves, places[k - 1], shifts)


class Passed(NamedTuple):
    """A set of states after one period, both halves in the frame of the first."""

    first: Any  # derivative of the shape over the first half, and over the second
    second: Any
    load_row: list[Any]  # derivative of the load over the first half, except for its sign
    moved: list[Any]  # change of the shape in half a period
    returned: list[Any]  # change of the shape in a period
    radii: list[Any]  # of the present shape
    load_radius: Any
    advance: Enclosure


def contraction(
    joint: Passed,
    point: Passed,
    norm: NDArray[np.float64],
    inverse: NDArray[np.float64],
    reach: float,
    load: float,
) -> float:
    """Return rho; raise `Undecided` unless the balls prove that the joint set is never left."""
    inner = len(point.moved)
    # L in exact floats, and a ball for its inverse
    to = _matrix(norm)
    back = to.inv()
    rho = two_norm(to * joint.second * joint.first * back)
    if not rho < 1:
        raise Undecided(f"the contraction {float(rho):.4g} is not proved")
    # largest length of a vector whose entries lie in these balls, or between the balls and their
    # negatives, where signs must not cancel
    d, returned, unsure = (
        _length((by * flint.arb_mat(inner, 1, way)).entries())
        for by, way in ((to, point.moved), (to, point.returned), (_matrix(abs(norm)), point.radii))
    )
    away = (2 * unsure + returned / (1 - rho) + d).upper()
    row = flint.arb_mat(1, inner, joint.load_row) * back
    drift = (_length(row.entries()) * d / (1 - rho)).upper()
    # the cube that was followed, `spread` times [-1, 1]^inner, contains a ball of radius `reach` in
    # this norm, except for the rounding errors of L^-1 reach
    gap = to * _matrix(inverse * reach) - _matrix(np.eye(inner) * reach)
    lacking = sum(map(abs, gap.entries()), flint.arb(0))
    if inner and not away < reach - 2 * lacking:
        raise Undecided("the shapes may leave the set that was followed")
    if not drift + point.load_radius < load:
        raise Undecided("the load may leave the set that was followed")
    return float(rho.upper())


def _matrix(values: NDArray[np.float64]) -> Any:
    """Return floats as an arb_mat, exactly."""
    return flint.arb_mat(values.shape[0], values.shape[1], values.ravel().tolist())


def _floats(matrix: Any) -> NDArray[np.float64]:
    return np.array([float(x) for x in matrix.entries()]).reshape(matrix.nrows(), matrix.ncols())


def _norm(map_: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return L such that ``|L map_ y| <= |L y|`` for a map of spectral radius below 1."""
    if not map_.size:
        return map_
    form = solve_discrete_lyapunov(map_.T, np.eye(len(map_)))
    return np.linalg.cholesky((form + form.T) / 2).T


def _length(entries: Sequence[Any]) -> Any:
    return sum((abs(x).upper() ** 2 for x in entries), flint.arb(0)).upper().sqrt().upper()


def two_norm(matrix: Any) -> Any:
    """Return a bound of the largest singular value of a matrix of balls.

    It uses ``|A|^2 = |A^T A|`` and ``|B|^(2^k) = |B^(2^k)|`` for symmetric B. The Frobenius norm is
    an upper bound, and its ratio to the largest singular value tends to 1 after the root.
    """
    power = matrix.transpose() * matrix
    for _ in range(_SQUARINGS):
        power = power * power
    bound = _length(power.entries())
    return bound.root(2 ** (_SQUARINGS + 1)).upper() if bound > 0 else bound
