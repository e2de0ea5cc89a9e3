"""What a chain does for ever, proved: the certified solver followed until it comes back.

*Lone slips.* The slip of an end alone, from its threshold, moves it by 2 D whatever the state is.
When the lone slips since an avalanche add up to nothing, the tensions have returned exactly.

*Avalanches.* States at the end of a cycle have a *shape* f (the forces of sliders 2 .. N - 1) and a
*load* u = (F_1 - F_N)/2. Every rearrangement begins with an end at its threshold; a change of u
therefore only shifts the theta at which it happens: along one itinerary the shape goes on by
itself, f -> G(f), and u -> u + tau(f). No contraction ever acts on u: the direction in which all
tensions change alike is neutral, whatever happens. What can bring u back is a symmetry. To exchange
the ends of the chain, with theta -> -theta, leaves the equations as they are and turns u into -u.
Let the second half of a period be the mirror image of the first: the avalanches are, and so are
the sums of the lone slips between them. In the mirror's frame each half then is f -> H(f), u ->
tau(f) - u, with G = H H, and a period moves u by ``tau(H(f)) - tau(f)``. Where G contracts, by rho
over a period, these moves are bounded by a geometric series: the load stays within ``|dtau| |H(f) -
f|/(1 - rho)`` for ever, and tends to a limit.

The balls prove, for all states of a joint set of shapes and loads at once, that they share one
itinerary over a period, and enclose the derivatives of G and tau over it. The shapes are measured
in the norm of a discrete Lyapunov equation, in which a map contracts as its spectrum does. A
period that avalanches take part in and that has no such symmetry leaves the load undecided.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from typing import Any, NamedTuple

import flint
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Itinerary
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, Undecided, balls_of
from exactcreep.quasistatic.decimals import Enclosure, enclosure
from exactcreep.solvers.field.certified import Certified, CertifiedSimulation
from exactcreep.solvers.field.nearby import NearbySimulation
from exactcreep.studies.eventlog import LoggedRearrangement, rearrangements

HalfCycle = tuple[Itinerary, ...]
"""The itineraries of the rearrangements of one half-cycle."""
MOST_PERIOD = 1000
"""Cycles: a longer period is not found."""
BITS = 192
"""To begin with."""
PROOF_BITS = 128
"""Of what is concluded from the derivatives."""
_CLOSE = 2.0**-40  # how nearly a shape has to return before a proof is tried
_BETTER = 2.0**-8  # how much more nearly it has to return than after a shorter period
_CLOSER = 0.25  # how much more nearly before it is tried once more
_LEAST = 2.0**-100  # half width of the joint set
_ROOM = 4.0  # how much larger than needed the joint set is


@dataclass(frozen=True)
class Recurrence:
    """How a chain goes on for ever, or what was known when the search ended.

    Attributes
    ----------
    outcome : Outcome
    evidence : Evidence
    cycles : int
        That were followed.
    settled_after, period, last_advance : int or None
    advance : Enclosure or None
        Of x_G over a period.
    itinerary : tuple of (int, Itinerary)
        Of one period, each rearrangement with its half-cycle, from 1.
    log : tuple of LoggedRearrangement
        All rearrangements; the times of events are the middles of their enclosures.
    reason : str
    report : dict
    """

    outcome: Outcome
    evidence: Evidence
    cycles: int
    settled_after: int | None = None
    period: int | None = None
    last_advance: int = 0
    advance: Enclosure | None = None
    itinerary: tuple[tuple[int, Itinerary], ...] | None = None
    log: tuple[LoggedRearrangement, ...] = ()
    reason: str = ""
    report: dict[str, Any] = field(default_factory=dict)

    def summary(self) -> dict[str, Any]:
        """Return it by names, ready for JSON; without the itinerary."""
        advance = self.advance
        return {
            "outcome": self.outcome.value,
            "evidence": self.evidence.value,
            "settled_after": self.settled_after,
            "period": self.period,
            "advance": None if advance is None else nearest_float(advance.middle),
            "reason": self.reason,
        }


class _Course(CertifiedSimulation):
    """A certified simulation that raises its precision in leaps: most of a transient is lost."""

    leap = 4


def recurrence(
    chain: Chain,
    drive: Cycles,
    start: State,
    limits: Limits = NO_LIMITS,
    say: Any = None,
) -> Recurrence:
    """Follow a chain without disorder until it is proved what it does for ever.

    Parameters
    ----------
    chain : Chain
    drive : Cycles
    start : State
    limits : Limits
    say : callable, optional
        Told how many cycles have been followed.

    Returns
    -------
    Recurrence
    """
    return _Search(chain, drive, start, limits, say).found()


class _Search:
    """One certified course, looked at after every cycle."""

    def __init__(self, chain: Chain, drive: Cycles, start: State, limits: Limits, say: Any) -> None:
        self.chain, self.drive, self.limits, self.say = chain, drive, limits, say
        digits = max(1, math.floor((BITS - 64) / BITS_PER_DIGIT))
        solver = Certified(digits=digits, most_digits=30_000)
        self.simulation = _Course(chain, start, 0, ("events",), solver)
        self.halves: list[HalfCycle] = []
        self.log: list[LoggedRearrangement] = []
        self.travel = [self._middle()]  # x_G at the ends of half-cycles
        self.shapes = [self._shape()]  # there, too
        self.known: dict[Any, int] = {}  # since the last avalanche: slips of each slider -> cycle
        self.slips = [0] * chain.n
        # of periods that were not proved: how nearly the shape has to return, or the cycle from
        # which on it is tried in any case
        self.again: dict[int, tuple[float, int]] = {}
        self.tried = 0
        self.doubt = ""

    # -- the course ------------------------------------------------------------------------------

    def found(self) -> Recurrence:
        """Return what the chain does for ever, or which limit came first."""
        for cycle in range(1, self.drive.cycles + 1):
            for q in (2 * cycle - 1, 2 * cycle):
                stop, reason = self._half_cycle(q)
                if stop is Stop.RUNAWAY:
                    return self._ended(Outcome.RUNAWAY, cycle - 1, reason)
                if stop is not Stop.DONE:
                    return self._ended(Outcome.LIMIT, cycle - 1, reason)
            if self.say is not None:
                self.say("cycles", cycle, self.drive.cycles, "cycles")
            known = self._returned(cycle) or self._contracted(cycle)
            if known is not None:
                return known
        reason = self.doubt or f"not settled within {self.drive.cycles} cycles"
        return self._ended(Outcome.LIMIT, self.drive.cycles, reason)

    def _half_cycle(self, q: int) -> tuple[Stop, str]:
        parts = []
        while True:
            stretch = self.simulation.follow(self.drive, q, 1, self.limits)
            parts.append(stretch.recorded)
            if stretch.stop is not Stop.BUDGET:
                break
            if self.limits.events is not None:
                break
        if stretch.stop is Stop.DONE:
            joined = {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
            times = [enclosure(time).middle for time in joined["event_time"].tolist()]
            joined["event_time"] = np.array([*times, None], dtype=object)[:-1]
            log = rearrangements(joined)
            self.log += log
            self.halves.append(tuple(tuple(e.signature for e in one.events) for one in log))
            self.travel.append(self._middle())
            self.shapes.append(self._shape())
        return stretch.stop, stretch.reason

    def _middle(self) -> Enclosure:
        mechanics = self.simulation.mechanics
        with mechanics.arithmetic.active():
            return enclosure(sum(mechanics.state().displacements.tolist()) / self.chain.n)

    def _shape(self) -> NDArray[np.float64]:
        """Return the forces of the inner sliders."""
        return np.array([float(x) for x in self.simulation.mechanics.forces[1:-1]])

    def _proved(self) -> Evidence:
        return self.simulation.evidence

    # -- lone slips ------------------------------------------------------------------------------

    def _note(self, cycle: int) -> int | None:
        """Keep the slips up to this cycle; return the cycle that had the same, None: none had."""
        most = min(self.slips) if self.chain.n == 2 else 0  # both ends alike change no tension
        held = self.simulation.mechanics.coefficients.tolist()
        key = (tuple(k - most for k in self.slips), tuple(held))
        before = self.known.get(key)
        self.known.setdefault(key, cycle)
        return before

    def _returned(self, cycle: int) -> Recurrence | None:
        """Return the recurrence if lone slips have brought back the tensions."""
        for one in (one for half in self.halves[-2:] for one in half):
            if not lone(one):
                self.known.clear()
                break
            _, sliders, signs = one[0]
            for n, sign in zip(sliders, signs, strict=True):
                self.slips[n - 1] += sign
        before = self._note(cycle)
        if not any(self.halves[-2:]):  # theta has been everywhere it will ever be
            before = cycle - 1
        if before is None:
            return None
        return self._settled(before, cycle - before, self._advance(before, cycle))

    def _advance(self, before: int, cycle: int) -> Enclosure:
        """Return how x_G has moved between the ends of two cycles between which slips are lone."""
        steps = 0
        for half in self.halves[2 * before : 2 * cycle]:
            for one in half:
                steps += sum(one[0][2])
        if steps == 0:
            return Enclosure(Fraction(0), Fraction(0))
        arithmetic = self.simulation.mechanics.arithmetic
        with arithmetic.active():
            excess = arithmetic.times_cosine(self.chain, self.chain.mu_s - self.chain.mu_d)
            return enclosure(excess * (2 * steps) / self.chain.n)

    # -- avalanches ------------------------------------------------------------------------------

    def _contracted(self, cycle: int) -> Recurrence | None:
        """Return the recurrence if a set of states is proved to be taken into itself."""
        held = self.simulation.mechanics.coefficients.tolist()
        if self.chain.sigma_mu != 0 or len(set(held)) > 1:
            return None
        best = math.inf
        for period in range(1, min(MOST_PERIOD, cycle // 2) + 1):
            if self._cycle(cycle) != self._cycle(cycle - period):
                continue
            apart = abs(self.shapes[-1] - self.shapes[-1 - 2 * period]).max(initial=0.0)
            near, later = self.again.get(period, (_CLOSE, cycle + 1))
            if apart > near and cycle < later:
                best = min(best, apart)
                continue
            # what comes to a period in turns returns somewhat better after several
            word = self._symmetric(cycle, period) if apart <= best * _BETTER else None
            if word is None:
                continue
            proof = _Joint.of(self.simulation, self.drive, word, self.limits)
            self.tried += 1
            if isinstance(proof, str):
                self.doubt = proof
                self.again[period] = (_CLOSER * apart, cycle + max(period, cycle // 4))
                return None
            before = cycle - period
            while before > 0 and self._cycle(before) == self._cycle(before + period):
                before -= 1
            return self._settled(before, period, proof.advance, contraction=proof.contraction)
        return None

    def _cycle(self, cycle: int) -> list[HalfCycle]:
        return self.halves[2 * cycle - 2 : 2 * cycle]

    def _symmetric(self, cycle: int, period: int) -> _Word | None:
        """Return the word of the last period, if it is that of the one before, with a symmetry."""
        for ago in range(1, period):
            if self._cycle(cycle - ago) != self._cycle(cycle - ago - period):
                return None
        return _Word.of(self.halves[-2 * period :], self.chain.n)

    # -- results ---------------------------------------------------------------------------------

    def _settled(self, before: int, period: int, advance: Enclosure, **report: Any) -> Recurrence:
        last = self.halves[len(self.halves) - 2 * period :]
        itinerary = tuple((k + 1, one) for k, half in enumerate(last) for one in half)
        # a period that begins at `before`
        shift = (len(self.halves) // 2 - before) % period
        itinerary = tuple(((k - 1 + 2 * shift) % (2 * period) + 1, one) for k, one in itinerary)
        itinerary = tuple(sorted(itinerary, key=lambda pair: pair[0]))
        evidence = self._proved()
        reason = ""
        if not itinerary:
            outcome = Outcome.AT_REST
        elif advance.middle == 0 == advance.radius:
            outcome = Outcome.CYCLING
        else:
            outcome = Outcome.CREEPING
            if abs(advance.middle) <= advance.radius:
                evidence = Evidence.UNDECIDED
                reason = "the advance over a period is not told from none"
        return Recurrence(
            outcome,
            evidence,
            len(self.halves) // 2,
            before,
            period,
            self._last_advance(before),
            advance,
            itinerary,
            tuple(self.log),
            reason,
            self._report() | report,
        )

    def _ended(self, outcome: Outcome, cycle: int, reason: str) -> Recurrence:
        evidence = self._proved()
        if outcome is Outcome.LIMIT and evidence is Evidence.PROVED:
            evidence = Evidence.UNDECIDED
        return Recurrence(
            outcome,
            evidence,
            cycle,
            last_advance=self._last_advance(cycle),
            log=tuple(self.log),
            reason=reason,
            report=self._report(),
        )

    def _last_advance(self, until: int) -> int:
        """Return the last cycle up to `until` in which x_G advanced down the incline."""
        tangent = self.chain.tan_alpha
        for cycle in range(until, 0, -1):
            a, b = self.travel[2 * cycle - 2], self.travel[2 * cycle]
            moved, doubt = b.middle - a.middle, a.radius + b.radius
            way = abs(moved) if tangent == 0 else moved if tangent > 0 else -moved
            if way > doubt and way > Fraction(1, 2**40):
                return cycle
        return 0

    def _report(self) -> dict[str, Any]:
        return {
            "events": self.simulation.tally.events,
            "bits": self.simulation.mechanics.arithmetic.bits,
            "restarts": self.simulation.restarts,
            "proofs_tried": self.tried,
        }


def lone(itinerary: Itinerary) -> bool:
    """Return whether it is a slip of one end alone, or of both at once far apart."""
    if len(itinerary) != 2:
        return False
    (start, sliders, signs), (stop, stopped, ways) = itinerary
    alike = sliders == stopped and signs == ways
    apart = all(b - a > 1 for a, b in pairwise(sliders))
    return (start, stop) == ("start", "stop") and alike and apart


def mirrored(one: Itinerary, n: int) -> Itinerary:
    """Return an itinerary with the ends of the chain exchanged."""
    events = []
    for kind, sliders, signs in one:
        pairs = sorted((n + 1 - m, sign) for m, sign in zip(sliders, signs, strict=True))
        events.append((kind, tuple(m for m, _ in pairs), tuple(sign for _, sign in pairs)))
    return tuple(events)


class _Word(NamedTuple):
    """The rearrangements of a period whose second half mirrors the first.

    Lone slips commute: between two avalanches only their sums count, for each end.
    """

    halves: list[HalfCycle]
    half: int  # rearrangements up to the last avalanche of the first half
    late: tuple[int, int]  # lone slips of sliders 1 and N after the last avalanche

    @classmethod
    def of(cls, halves: list[HalfCycle], n: int) -> _Word | None:
        """Return the word of a period, None if it has no such symmetry."""
        avalanches: list[Itinerary] = []
        places: list[int] = []
        between: list[list[int]] = [[0, 0]]
        for number, one in enumerate((one for half in halves for one in half), start=1):
            if lone(one):
                _, sliders, signs = one[0]
                for m, sign in zip(sliders, signs, strict=True):
                    between[-1][m == n] += sign
            else:
                avalanches.append(one)
                places.append(number)
                between.append([0, 0])
        k = len(avalanches) // 2
        if k == 0 or len(avalanches) % 2:
            return None
        late = between.pop()
        around = [[a + b for a, b in zip(between[0], late, strict=True)], *between[1:]]
        images = [mirrored(one, n) for one in avalanches[k:]]
        if images != avalanches[:k] or [x[::-1] for x in around[k:]] != around[:k]:
            return None
        return cls(halves, places[k - 1], (late[0], late[1]))


class _Joint(NamedTuple):
    """A set of shapes and loads that is never left."""

    advance: Enclosure
    contraction: float

    @classmethod
    def of(
        cls,
        course: CertifiedSimulation,
        drive: Cycles,
        word: _Word,
        limits: Limits,
    ) -> _Joint | str:
        """Return a set around the present state, or why none was found."""
        n = course.chain.n
        try:
            point = _followed(course, drive, word, np.zeros((n - 2, n - 2)), 0.0, limits)
            inner = n - 2
            first = np.array([[float(x) for x in row] for row in point.first.table()])
            second = np.array([[float(x) for x in row] for row in point.second.table()])
            whole = second[:inner, :inner] @ first[:inner, :inner]
            radius = float(max(abs(np.linalg.eigvals(whole)), default=0.0)) if inner else 0.0
            if not radius < 1 - 2.0**-10:
                return f"over a period the shape does not contract (spectral radius {radius:.4g})"
            goal = (1 + radius) / 2
            norm = _norm(whole / goal)
            inverse = np.asarray(np.linalg.inv(norm), dtype=np.float64) if inner else norm
            d = float(np.linalg.norm(norm @ point.moved)) if inner else 0.0
            slope = first[inner, :inner] @ inverse if inner else np.zeros(0)
            radii = np.array([float(x) for x in point.radii])
            unsure = float(np.linalg.norm(norm @ radii)) if inner else 0.0
            reach = _ROOM * (2 * d / (1 - goal) + d + 4 * unsure) + _LEAST
            drift = float(np.linalg.norm(slope)) * d / (1 - goal)
            load = _ROOM * (drift + float(point.load_radius)) + _LEAST
            joint = _followed(course, drive, word, inverse * reach, load, limits)
        except Undecided as doubt:
            return f"nearby states do not share the itinerary: {doubt}"
        with balls_of(PROOF_BITS).active():
            return cls._checked(joint, point, norm, inverse, reach, load, n - 2)

    @classmethod
    def _checked(
        cls,
        joint: _Passed,
        point: _Passed,
        norm: NDArray[np.float64],
        inverse: NDArray[np.float64],
        reach: float,
        load: float,
        inner: int,
    ) -> _Joint | str:
        """Return the set if the balls prove that it is never left; see the module."""
        ball = flint.arb
        rho = drift = ball(0)
        away = ball(0)
        if inner:
            # L, and its inverse as a ball: L is what it is, exactly, in floats
            to, back = flint.arb_mat(norm.tolist()), flint.arb_mat(norm.tolist()).inv()
            first = _part(joint.first, inner)
            second = _part(joint.second, inner)
            rho = _two_norm(to * second * first * back)
            if not rho < 1:
                return f"the contraction {float(rho):.4g} is not proved"
            # the norm of the distance between the states at both halves of a period
            moved = to * flint.arb_mat(inner, 1, point.moved_balls)
            d = _length(moved.entries())
            returned = to * flint.arb_mat(inner, 1, point.returned_balls)
            a = _length(returned.entries()) / (1 - rho)
            unsure = _length((to * flint.arb_mat(inner, 1, point.radii)).entries())
            away = 2 * unsure + a + d
            row = flint.arb_mat(1, inner, [joint.first[inner, k] for k in range(inner)]) * back
            drift = _length(row.entries()) * d / (1 - rho)
            away, drift = away.upper(), drift.upper()
            # the cube that was followed holds a ball of radius `reach` of the norm, if the
            # inverse in floats, with which it was made, is one
            gap = to * flint.arb_mat(inverse.tolist())
            defect = ball(0)
            for i in range(inner):
                defect += sum(
                    (abs(gap[i, k] - (1 if i == k else 0)) for k in range(inner)), ball(0)
                )
            if not away < reach * (1 - 2 * defect):
                return "the shapes may leave the set that was followed"
        if not drift + point.load_radius < load:
            return "the load may leave the set that was followed"
        return cls(joint.advance, float(rho.upper()))


class _Passed(NamedTuple):
    """What a set of states has come to over one period."""

    first: Any
    second: Any
    moved_balls: list[Any]  # shape after half a period, mirrored, less that at the beginning
    returned_balls: list[Any]  # shape after a period, less that at the beginning
    radii: list[Any]
    load_radius: Any
    advance: Enclosure

    @property
    def moved(self) -> NDArray[np.float64]:
        """How the shape moves in half a period."""
        return np.array([float(x) for x in self.moved_balls])


def _followed(
    course: CertifiedSimulation,
    drive: Cycles,
    word: _Word,
    spread: NDArray[np.float64],
    load: float,
    limits: Limits,
) -> _Passed:
    """Follow the states around the present one over one period.

    Raises
    ------
    Undecided
        If they do not all follow the given itinerary.
    """
    arithmetic = course.mechanics.arithmetic
    simulation = NearbySimulation(course.chain, course.state(), drive, arithmetic)
    mechanics = simulation.mechanics
    n = course.chain.n
    with arithmetic.active():
        mechanics.begin(spread, load)
        begin = list(mechanics.forces)
        present = list(course.mechanics.known_forces())
        where = sum(mechanics.displacements.tolist()) / n
        mechanics.half = word.half
    stretch = simulation.follow(drive, 1, len(word.halves), limits)
    if stretch.stop is not Stop.DONE:
        raise Undecided(stretch.reason)
    log: list[list[Itinerary]] = [[] for _ in word.halves]
    for one in rearrangements(stretch.recorded):
        log[one.half_cycle - 1].append(tuple(event.signature for event in one.events))
    if [tuple(one) for one in log] != word.halves or mechanics.at_half is None:
        raise Undecided("they part")
    with arithmetic.active():
        shape, first = mechanics.at_half
        second = mechanics.derivative()
        shape.reverse()  # in the mirror
        # as many lone slips later as after the last avalanche
        slip = 2 * arithmetic.times_cosine(course.chain, course.chain.mu_s - course.chain.mu_d)
        for place, count in zip((0, -1), word.late, strict=True):
            if shape:
                shape[place] = shape[place] + count * slip
        moved = [x - y for x, y in zip(shape, begin[1 : n - 1], strict=True)]
        end = mechanics.forces[1 : n - 1]
        returned = [x - y for x, y in zip(end, begin[1 : n - 1], strict=True)]
        radii = [x.rad() for x in present[1 : n - 1]]
        x = sum(mechanics.displacements.tolist()) / n - where
        # the halves in one frame, that of a chain at its lower end of theta
        return _Passed(
            _mirrored_rows(first, n),
            _mirrored_columns(second, n),
            moved,
            returned,
            radii,
            present[0].rad() + present[-1].rad(),
            enclosure(x),
        )


def _mirrored_rows(matrix: Any, n: int) -> Any:
    """Return the derivative of the mirror image of shape and load."""
    size = n - 1
    out = flint.arb_mat(size, size)
    for k in range(size):
        for i in range(n - 2):
            out[i, k] = matrix[n - 3 - i, k]
        out[n - 2, k] = -matrix[n - 2, k]
    return out


def _mirrored_columns(matrix: Any, n: int) -> Any:
    """Return the derivative with respect to the mirror image of shape and load."""
    size = n - 1
    out = flint.arb_mat(size, size)
    for i in range(size):
        for k in range(n - 2):
            out[i, k] = matrix[i, n - 3 - k]
        out[i, n - 2] = -matrix[i, n - 2]
    return out


def _part(matrix: Any, inner: int) -> Any:
    return flint.arb_mat([[matrix[i, k] for k in range(inner)] for i in range(inner)])


def _norm(map_: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return L such that ``|L map_ y| <= |L y|`` for a map of spectral radius below 1."""
    if not map_.size:
        return map_
    form = solve_discrete_lyapunov(map_.T, np.eye(len(map_)))
    return np.linalg.cholesky((form + form.T) / 2).T


def _length(entries: list[Any]) -> Any:
    """Return a bound of the Euclidean length of a vector of balls."""
    return sum((abs(x).upper() ** 2 for x in entries), flint.arb(0)).upper().sqrt().upper()


def _two_norm(matrix: Any) -> Any:
    """Return a bound of the largest singular value of a matrix of balls."""
    size = matrix.nrows()
    near = np.array([[float(matrix[i, k]) for k in range(size)] for i in range(size)])
    guess = float(np.linalg.norm(near, 2)) * (1 + 2.0**-20) + 2.0**-40
    for _ in range(60):
        if _positive(flint.arb(guess) ** 2, matrix):
            return flint.arb(guess)
        guess *= 1 + 2.0**-6
    return flint.arb(guess * 2.0**30)


def _positive(square: Any, matrix: Any) -> bool:
    """Return whether ``square - matrix^T matrix`` is proved to be positive definite."""
    size = matrix.nrows()
    form = -(matrix.transpose() * matrix)
    rows = [[form[i, k] + (square if i == k else 0) for k in range(size)] for i in range(size)]
    for i in range(size):
        if not rows[i][i] > 0:
            return False
        for j in range(i + 1, size):
            factor = rows[j][i] / rows[i][i]
            for k in range(i, size):
                rows[j][k] = rows[j][k] - factor * rows[i][k]
    return True
