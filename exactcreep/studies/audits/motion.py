"""The motion that the events of a run make, and whether it obeys the model.

An `Auditor` sets the sliders in motion and at rest as the events say, and asks of what follows in
closed form: does each event's condition hold at its time; does every slider that rests stay within
its threshold, and every one that moves keep its direction, at all times between; do all stop; does
energy balance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, EventKind
from exactcreep.model.enclosure import enclosure, exact_value, floats
from exactcreep.model.numbers import nearest_float
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.modes import Run, RunMotion, forces_of
from exactcreep.motion.replay import Energies, Phase, Replay

ACCURACY = 1e-12
"""What float64 claims: errors of forces and velocities in units of the largest threshold."""
ROUNDING = 2.0**-46
"""Of the replay in float64 itself."""
_SHORTEST = 2.0**-40  # piece of a motion, relative, that is not divided further
_TOGETHER = 4096  # pieces of a motion that are looked at together
_LONGEST = 1e6  # tau_dyn: no slider that friction brakes moves for so long


@dataclass(frozen=True)
class Finding:
    """Something in a log that contradicts the model.

    Attributes
    ----------
    check : str
        ``order``, ``contact``, ``motion``, ``static``, ``drive``, ``energy``, ``state``, or
        ``again`` (what running again does not give).
    rearrangement, number : int or None
        Where: from 0; the event within the rearrangement, from 0.
    sentence : str
    error, allowed : float
        How far it is off, and how far it may be.
    """

    check: str
    rearrangement: int | None
    number: int | None
    sentence: str
    error: float = math.inf
    allowed: float = 0.0

    def summary(self) -> dict[str, Any]:
        """Return the finding by names, ready for JSON."""
        return asdict(self)


class EnoughFindings(Exception):
    """As many findings as were asked for."""


class Auditor:
    """The chain as the log has it, and what contradicts the model.

    Attributes
    ----------
    state : State
        At present, at rest.
    findings : list of Finding
    place : tuple of (int or None)
        Where the audit is: the rearrangement, and the event within it.
    errors, radii, balance
        See `Audit`.
    limits, reason
        Of the time that the audit may take, and how it has ended the audit.
    rearrangements, events : int
        Followed to their end.
    load : float
        Largest ``l0 |theta|`` so far.
    way : int
        Of the ramp to the next rearrangement; 0 if there is none.
    room : float
        By which a resting slider may seem to exceed its threshold.
    scale, accuracy : float
        The largest threshold, and the error that the numbers of the log claim in its units.
    """

    def __init__(
        self, chain: Chain, start: State, seed: int, arithmetic: Arithmetic, digits: int, most: int
    ) -> None:
        self.chain, self.contacts = chain, Contacts(chain, seed)
        self.arithmetic, self.digits = arithmetic, digits
        self.l0 = arithmetic.number(chain.l0)
        self.findings: list[Finding] = []
        self.most = most
        self.place: tuple[int | None, int | None] = (None, None)
        self.errors: list[float] = []
        self.radii: list[float] = []
        self.balance = self.load = self.room = 0.0
        self.limits, self.reason = NO_LIMITS, ""
        self.rearrangements = self.events = self.way = 0
        pairs = enumerate(start.draws.tolist())
        drawn = [float(self.contacts.coefficient(n + 1, k - 1)) for n, k in pairs]
        self.state = State(
            tensions=arithmetic.vector(map(exact_value, start.tensions.tolist())),
            displacements=arithmetic.vector(map(exact_value, start.displacements.tolist())),
            coefficients=start.coefficients if chain.sigma_mu == 0 else np.array(drawn),
            draws=start.draws,
            theta=arithmetic.number(exact_value(start.theta)),
        )
        self.scale = float(max(self.thresholds().tolist()))
        self.accuracy = ACCURACY if arithmetic is FLOAT64 else 10.0 ** -min(digits, 300)

    def begin(self, start: State) -> None:
        """Check that the coefficients of the start are those of the seed."""
        for n in np.flatnonzero(self.state.coefficients != start.coefficients):
            self.find("contact", f"slider {n + 1} begins with a coefficient not of this seed")

    def thresholds(self) -> NDArray[Any]:
        """Return the forces that hold the sliders at present."""
        return self.contacts.thresholds(self.state.coefficients, self.arithmetic)

    def excesses(self) -> list[Any]:
        """Return by how much each resting slider exceeds its threshold at present."""
        weight = self.arithmetic.times_cosine(self.chain, self.chain.tan_alpha)
        forces = forces_of(self.arithmetic, self.state.tensions, weight)
        excesses: list[Any] = (abs(forces) - self.thresholds()).tolist()
        return excesses

    def find(self, check: str, sentence: str, error: Any = math.inf, allowed: Any = 0.0) -> None:
        """Add a finding."""
        finding = Finding(check, *self.place, sentence, float(error), float(allowed))
        self.findings.append(finding)
        if len(self.findings) >= self.most:
            raise EnoughFindings

    def within(self, check: str, sentence: str, error: Any, allowed: float) -> None:
        """Add a finding if `error` exceeds `allowed`."""
        if not error <= allowed:
            self.find(check, sentence, error, allowed)

    def floor(self) -> float:
        """Return how far a condition may be off whatever its time claims."""
        if self.arithmetic is FLOAT64:
            return self.accuracy * self.scale
        # decimals of theta and of all times so far were rounded
        return self.accuracy * (self.scale + self.load) * (1 + len(self.radii))

    # -- between two rearrangements ------------------------------------------------------------

    def ramp(self, to: Any, target: Any, error: float, what: str) -> None:
        """Take theta to `to` on its way to `target`."""
        theta, l0 = self.state.theta, self.l0
        way = self.way = 1 if target >= theta else -1
        self.within("drive", f"theta turns back to {what}", way * (theta - to) * l0, error)
        passed = way * (to - target) * l0
        self.within("drive", f"theta passes its target at {what}", passed, error)
        self.state = replace(self.state, tensions=self.state.tensions - l0 * (to - theta), theta=to)
        self.load = max(self.load, float(abs(to) * l0))

    def stable(self) -> bool:
        """Return whether no slider exceeds its threshold as the chain stands."""
        return all(beyond <= self.room for beyond in self.excesses())

    def rests(self, when: str) -> None:
        """Check that every slider is within its threshold."""
        for n, beyond in enumerate(self.excesses()):
            text = f"slider {n + 1} exceeds its threshold when {when}"
            self.within("static", text, beyond, self.room)

    # -- one rearrangement ---------------------------------------------------------------------

    def rearrangement(
        self, events: Sequence[Event], load_error: float, *, ended: bool,
        residuals: Sequence[float] = (),
    ) -> None:  # fmt: skip
        """Check one rearrangement, from the present state, and the residuals of its events."""
        known = [enclosure(event.time) for event in events]
        middles = [replace(e, time=time.middle) for e, time in zip(events, known, strict=True)]
        replay = Replay(self.chain, self.state, middles, self.arithmetic, self.contacts)
        rearrangement, number = self.place[0], 0
        widest = self.floor() + load_error
        for phase in replay:
            self.place = (rearrangement, number)
            self.phase(replay, phase)
            for event in phase.events:
                self.place = (rearrangement, number)
                slack = widest
                if residuals and number:
                    slack = min(widest, 4 * residuals[number] + ROUNDING * self.scale)
                legal = self.contact(replay, event)
                for n, sign in legal.items():
                    radius = nearest_float(known[number].radius)
                    self.condition(replay, event.kind, n, sign, min(radius, widest), slack)
                phase.happen(event, legal)
                number += 1
        self.rearrangements += 1
        self.events += number
        self.place = (rearrangement, None)
        before, self.state = self.state, replay.state()
        self.balanced(replay.energies(), before.tensions)
        if not ended:
            return
        moving = [n + 1 for n in np.flatnonzero(replay.flow.signs).tolist()]
        if moving:
            self.find("motion", f"sliders {moving} still move after the last event")
        self.rests("the rearrangement ends")

    def phase(self, replay: Replay, phase: Phase) -> None:
        """Check the motion up to the next events, and let it pass."""
        self.limits.require()
        if phase.span < 0:
            self.find("order", "the event comes before the previous one", -phase.span)
            phase.lasts = False
        if phase.lasts and not phase.runs:
            self.find("order", "time passes while no slider moves", phase.span)
        elif phase.lasts:
            resting, when = replay.just_stopped, "after it has stopped"
            if not replay.moves:
                resting, when = set(range(self.chain.n)), "when the rearrangement begins"
            for n in sorted(resting):
                if replay.flow.signs[n] == 0:
                    beyond = abs(replay.flow.forces[n]) - replay.threshold(n)
                    text = f"slider {n + 1} stays at rest beyond its threshold {when}"
                    self.within("static", text, beyond, self.room)
            allowed = ACCURACY * self.scale
            span = nearest_float(exact_value(phase.span))
            if span > _LONGEST:
                self.find("motion", f"no slider moves for {span:.3g} tau_dyn", span, _LONGEST)
                raise EnoughFindings
            watches = Watches(replay, phase.runs)
            worst, n, moving = watches.worst(span, allowed)
            if worst < -allowed:
                act = "turns back" if moving else "exceeds its threshold"
                self.find("motion", f"slider {n + 1} {act} before the event", -worst, allowed)
        phase.arrive()

    def contact(self, replay: Replay, event: Event) -> dict[int, int]:
        """Check that the law allows the event; return the signs of the sliders it allows it to."""
        legal = {}
        starts, flow = event.kind is EventKind.START, replay.flow
        for slider, sign in zip(event.sliders, event.signs, strict=True):
            n = slider - 1
            if not 0 <= n < self.chain.n:
                self.find("contact", f"there is no slider {slider}")
            elif sign not in (-1, 1):
                self.find("contact", f"slider {slider} has the sign {sign}")
            elif starts and flow.signs[n] != 0:
                self.find("contact", f"slider {slider} starts while it moves")
            elif not starts and flow.signs[n] == 0:
                self.find("contact", f"slider {slider} stops while it rests")
            elif not starts and flow.signs[n] != sign:
                self.find("contact", f"slider {slider} stops with a sign that it did not have")
            elif starts and sign * flow.forces[n] <= 0:
                self.find("contact", f"slider {slider} starts against the force on it")
            else:
                legal[n] = sign
        return legal

    def condition(
        self, replay: Replay, kind: EventKind, n: int, sign: int, radius: float, slack: float
    ) -> None:
        """Check that slider `n` (from 0) stops without velocity, or starts at its threshold.

        Where it may start beyond its threshold, check that it is not below.
        """
        flow, first = replay.flow, self.place[1] == 0
        if kind is EventKind.STOP:
            value, what = flow.velocities[n], "moves"
            slope = float(abs(flow.forces[n] - flow.friction * int(flow.signs[n])))
        else:
            value, what = sign * flow.forces[n] - replay.threshold(n), "is not at its threshold"
            around = [m for m in (n - 1, n + 1) if 0 <= m < self.chain.n and flow.signs[m] != 0]
            slope = float(abs(sum(flow.velocities[m] for m in around)))
            if first or n in replay.just_stopped:
                self.within("static", f"slider {n + 1} starts below its threshold", -value, slack)
                if first and self.way:
                    text = f"slider {n + 1} starts beyond its threshold on a ramp"
                    self.within("drive", text, value, slack)
                self.errors.append(math.nan)
                self.radii.append(math.nan)
                return
        size = float(abs(value))
        allowed = 4 * radius * slope + 4 * radius * radius + slack
        self.within("motion", f"slider {n + 1} {what} at the time of its event", size, allowed)
        self.errors.append(size / slope if slope else math.inf if size else 0.0)
        self.radii.append(allowed / slope / 4 if slope else math.inf)

    def balanced(self, energies: Energies, before: NDArray[Any]) -> None:
        """Check that the energy that went is the work of friction; `before` are tensions."""
        largest = max(abs(term) for term in energies)
        if largest == 0:
            return
        # what is left over of tensions that are much larger than their change is rounding
        base = float((before * before).sum()) if before.size else 0.0
        rounding = 2.0**-50 if self.arithmetic is FLOAT64 else self.accuracy
        left = float(abs(energies.left) / largest)
        self.balance = max(self.balance, left)
        allowed = max(self.accuracy, rounding * base / float(largest))
        self.within("energy", "energy does not balance", left, 4 * allowed)


class Watches:
    """What must stay positive during a piece of motion, in float64, at many times at once.

    A moving slider's speed along its direction, and the two distances of a resting neighbour's
    force from its thresholds, each with a bound of its second derivative.
    """

    def __init__(self, replay: Replay, runs: Sequence[Run]) -> None:
        motions = [
            own if own.arithmetic is FLOAT64
            else RunMotion(FLOAT64, own.ends, floats(own.velocities), floats(own.accelerations))
            for own in (run.motion for run in runs)
        ]  # fmt: skip
        self.runs = list(zip((run.first for run in runs), motions, strict=True))
        flow, n = replay.flow, replay.chain.n
        self.size = n
        movers = np.array([i for run in runs for i in run.sliders])
        ends = {m for run in runs for m in (run.first - 1, run.first + run.motion.p)}
        resting = np.array(sorted(m for m in ends if 0 <= m < n), dtype=int)
        self.movers, self.resting = movers, resting
        self.sliders = np.concatenate([movers, resting, resting])
        self.directions = flow.signs[movers][:, None]
        rooms = [
            [nearest_float(exact_value(replay.threshold(m) - side * flow.forces[m]))]
            for side in (1, -1)
            for m in resting.tolist()
        ]
        self.rooms = np.array(rooms).reshape(-1, 1)
        bends, rates = np.zeros(n + 2), np.zeros(n + 2)
        for first, motion in self.runs:
            for i in range(motion.p):
                bends[first + i + 1] = motion.bound(i, 2)
            rates[first] += motion.bound(0, 1)
            rates[first + motion.p + 1] += motion.bound(motion.p - 1, 1)
        bounds = np.concatenate([bends[movers + 1], rates[resting + 1], rates[resting + 1]])
        self.bounds = np.maximum(bounds, np.finfo(float).tiny)[:, None]

    def values(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return every margin and its slope at the times `t`, each of shape (margins, times)."""
        shape = (3, self.size + 2, t.size)
        moved = np.zeros(shape)
        for first, motion in self.runs:
            moved[:, first + 1 : first + 1 + motion.p] = motion.at(t)
        speeds, gains = (self.directions * part[self.movers + 1] for part in moved[1:])
        force, rate = (part[self.resting] + part[self.resting + 2] for part in moved[:2])
        rooms = self.rooms + np.concatenate([-force, force])
        return np.concatenate([speeds, rooms]), np.concatenate([gains, -rate, rate])

    def worst(self, span: float, allowed: float) -> tuple[float, int, bool]:
        """Return a margin below -`allowed` on ``[0, span]``, its slider and whether that moves.

        From value and slope at either end of a piece follows how far inwards a margin stays above
        -`allowed`; a piece that these two reaches do not cover is halved. Returns 0 if all are.
        """
        ends = np.linspace(0.0, span, 2 + math.ceil(2 * span))
        waiting = [(ends[k : k + _TOGETHER], ends[k + 1 : k + 1 + _TOGETHER])
                   for k in range(0, ends.size - 1, _TOGETHER)]  # fmt: skip
        while waiting:
            a, b = waiting.pop()
            a = a[: b.size]
            values, slopes = self.values(np.concatenate([a, b]))
            margin, place = np.unravel_index(int(np.argmin(values)), values.shape)
            if values[margin, place] < -allowed:
                moving = bool(margin < self.movers.size)
                return float(values[margin, place]), int(self.sliders[margin]), moving
            slopes[:, a.size :] *= -1  # inwards
            root = np.sqrt(slopes**2 + 2 * self.bounds * np.maximum(values + allowed, 0.0))
            reach = (slopes + root) / self.bounds
            covered = reach[:, : a.size] + reach[:, a.size :]
            loose = (covered < b - a).any(axis=0) & (b - a > _SHORTEST * span)
            if loose.any():
                a, b = a[loose], b[loose]
                middle = (a + b) / 2
                waiting += [(a, middle), (middle, b)]
        return 0.0, -1, False
