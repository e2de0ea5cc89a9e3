"""Judge a finished run by its events: does it obey the model?

The sliders are set in motion and at rest as the events say, and followed in closed form between
them; this shares the motion of a run with the solvers, and none of their searches. Held against the
model are the time of every event, whether the law of friction allows it, the static condition of
every slider at every instant, the drive, the energy, and the state at the end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.contacts import Contacts, Event, EventKind
from exactcreep.model.enclosure import Enclosure, enclosure, exact_value, floats, quantity
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, FLOAT64, Arithmetic, digits_of
from exactcreep.motion.modes import Run, forces_of
from exactcreep.motion.replay import Phase, Replay
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.solvers.rearrangement import Rearrangement
from exactcreep.studies.event_log import rearrangements

FLOAT_ACCURACY = 1e-12
"""What float64 promises: errors of forces and velocities in units of the largest threshold."""
_EXTRA_BITS = 64  # of the replay beyond those of the log
_SHORTEST = 2.0**-40  # piece of a motion, relative, that is not divided further
_TOGETHER = 4096  # pieces of a motion that are looked at together
_LONGEST = 1e6  # tau_dyn: no slider that friction brakes moves for so long


class Fault(Exception):
    """The first thing that contradicts the model, with its rearrangement and event, from 0.

    `check` is ``order``, ``contact``, ``motion``, ``static``, ``drive``, ``energy`` or ``state``.
    """

    def __init__(self, check: str, place: tuple[int | None, int | None], sentence: str) -> None:
        super().__init__(f"{check}, at {place}: {sentence}")
        self.check = check


def judge(
    result: Rearrangement | Creep, *, seed: int | None = None, accuracy: float | None = None
) -> Judgement:
    """Return whether a finished run obeys the model; a `Creep` has to record its events.

    `accuracy` is how far forces and velocities may be off, in units of the largest threshold: by
    default what the arithmetic of the solver promises; the fixed steps of `verlet` need more. No
    more is believed of a claimed radius than that. `seed` is that of the run unless it is told.
    """
    judgement = Judgement(result, result.seed if seed is None else seed, accuracy)
    judgement.follow(result)
    return judgement


def _arithmetic(result: Rearrangement | Creep) -> tuple[Arithmetic, float]:
    """Return the arithmetic in which a run is followed, and the accuracy that it promises."""
    events = result.events if isinstance(result, Rearrangement) else ()
    bits = result.report.get("precision_bits", 0)
    digits = result.experiment.digits if isinstance(result, Creep) else None
    if not bits and not digits and all(isinstance(event.time, float | int) for event in events):
        return FLOAT64, FLOAT_ACCURACY
    bits = max(int(bits), math.ceil((digits or 0) * BITS_PER_DIGIT), 64)
    promised = digits or math.floor(bits / BITS_PER_DIGIT) - 15
    return digits_of(bits + _EXTRA_BITS), 10.0 ** -min(max(promised, 1), 300)


def as_claimed(written: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return the numbers of a file; their radii hold the rounding to decimals, too."""
    claimed = {name: values for name, values in written.items() if quantity(name) == name}
    for name in claimed:
        if f"{name}_decimal" in written:
            decimals, radii = written[f"{name}_decimal"], written[f"{name}_radius"]
            claimed[name] = np.frompyfunc(_known, 2, 1)(decimals, radii)
    return claimed


def _known(text: str, radius: float) -> Enclosure:
    middle = Fraction(text)
    exponent = int(Decimal(text).as_tuple().exponent)
    return Enclosure(middle, Fraction(radius) + (Fraction(10) ** exponent / 2 if middle else 0))


class Judgement:
    """What was found, and how much was looked at.

    `fault` is None if nothing was. `radii` are by how much the time of each event may be off, to
    first order, in tau_dyn; nan for the first of a rearrangement. `balance` is the largest energy
    left over in a rearrangement, relative to its largest term.

    While a log is followed, its chain is at `place` (a rearrangement, and an event within it), has
    come by `load`, the largest ``l0 |theta|``, along a ramp of direction `way`, 0 if none. A
    resting slider may seem to exceed its threshold by `room`; `scale` is the largest threshold.
    """

    def __init__(self, result: Rearrangement | Creep, seed: int, accuracy: float | None) -> None:
        self.fault: Fault | None = None
        self.events = 0
        self.radii: list[float] = []
        self.balance = self.load = self.room = 0.0
        self.place: tuple[int | None, int | None] = (None, None)
        self.way = 0
        self.chain, self.contacts = result.chain, Contacts(result.chain, seed)
        self.arithmetic, promised = _arithmetic(result)
        self.accuracy = promised if accuracy is None else accuracy
        self.l0, self.float64 = self.arithmetic.number(self.chain.l0), self.arithmetic is FLOAT64
        start = result.experiment.initial if isinstance(result, Creep) else result.initial
        drawn = [self.contacts.coefficient(n, k - 1) for n, k in enumerate(start.draws.tolist(), 1)]
        self.state = State(
            tensions=self.arithmetic.vector(map(exact_value, start.tensions.tolist())),
            displacements=self.arithmetic.vector(map(exact_value, start.displacements.tolist())),
            coefficients=start.coefficients if self.chain.sigma_mu == 0 else np.array(drawn),
            draws=start.draws,
            theta=self.arithmetic.number(exact_value(start.theta)),
        )
        self.known = bool((self.state.coefficients == start.coefficients).all())
        self.scale = float(max(self.thresholds().tolist()))

    def follow(self, result: Rearrangement | Creep) -> None:
        """Judge up to the first fault; a log that cannot even be followed is one."""
        try:
            with self.arithmetic.active():
                if not self.known:
                    self.refute("contact", "a slider begins with a coefficient not of this seed")
                self.run(result) if isinstance(result, Creep) else self.single(result)
        except Fault as fault:
            self.fault = fault
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:  # of damaged logs
            self.fault = Fault("order", self.place, f"the log cannot be followed: {error}")

    def refute(self, check: str, sentence: str) -> NoReturn:
        raise Fault(check, self.place, sentence)

    def within(self, check: str, sentence: str, error: Any, allowed: float) -> None:
        if not error <= allowed:
            self.refute(check, f"{sentence}, by {float(error):.3g} of {float(allowed):.3g}")

    def thresholds(self) -> NDArray[Any]:
        return self.contacts.thresholds(self.state.coefficients, self.arithmetic)

    def floor(self) -> float:
        """Return how far a condition may be off whatever its time claims."""
        if self.float64:
            return self.accuracy * self.scale
        # decimals of theta and of all times so far were rounded
        return self.accuracy * (self.scale + self.load) * (1 + len(self.radii))

    def arrives(self, rearrangement: int, theta: Any) -> float:
        """Note which rearrangement comes next; return how far off the load at its theta may be."""
        middle, radius = (float(part * self.chain.l0) for part in enclosure(theta))
        error = min(radius, self.floor())
        error += 4 * 2.0**-52 * max(self.load, abs(middle)) * self.float64
        self.place, self.room = (rearrangement, None), self.floor() + error
        return error

    def single(self, result: Rearrangement) -> None:
        """Follow one rearrangement, from the state at theta_c."""
        self.load = float(self.chain.l0 * abs(exact_value(result.theta)))
        error = self.arrives(0, result.theta)
        self.way = int(self.stable())
        if result.events:
            ended = result.outcome is Outcome.AT_REST
            self.rearrangement(result.events, error, ended=ended)
        self.place = (None, None)
        self.ends_in(result.state)

    def run(self, result: Creep) -> None:
        """Follow a run along its drive, from rearrangement to rearrangement."""
        columns, drive = as_claimed(result.recorded), result.drive
        cut = result.outcome in (Outcome.RUNAWAY, Outcome.LIMIT)
        log, r = rearrangements(columns), 0
        for q in range(1, min(result.half_cycles + cut, drive.half_cycles) + 1):
            target = self.arithmetic.number(drive.exact_target(q, result.seed))
            while r < len(log) and log[r].half_cycle == q:
                error = self.arrives(r, log[r].theta)
                ramped = r > 0 or self.stable()
                theta = self.arithmetic.number(exact_value(log[r].theta))
                self.ramp(theta, target, "a rearrangement")
                self.way *= ramped
                self.rearrangement(log[r].events, error, ended=r + 1 < len(log) or not cut)
                r += 1
            self.place = (None, None)
            if q <= result.half_cycles:
                self.ramp(target, target, "a target")
                self.rests(f"theta reaches target {q}")
                for name, made in (("x", "displacements"), ("tension", "tensions")):
                    if name in columns:
                        own = getattr(self.state, made)
                        self.same(f"recorded {name} at target {q}", own, columns[name][q - 1])
        if r < len(log):
            self.refute("order", f"{len(log) - r} rearrangements belong to no half-cycle")
        if result.outcome is not Outcome.RUNAWAY:  # it goes on moving until that is proved
            self.ends_in(result.state)

    def ramp(self, to: Any, target: Any, what: str) -> None:
        theta, l0 = self.state.theta, self.l0
        way = self.way = 1 if target >= theta else -1
        self.within("drive", f"theta turns back to {what}", way * (theta - to) * l0, self.room)
        passed = way * (to - target) * l0
        self.within("drive", f"theta passes its target at {what}", passed, self.room)
        self.state = replace(self.state, tensions=self.state.tensions - l0 * (to - theta), theta=to)
        self.load = max(self.load, float(abs(to) * l0))

    def excesses(self) -> list[Any]:
        """Return by how much each resting slider exceeds its threshold at present."""
        weight = self.arithmetic.times_cosine(self.chain, self.chain.tan_alpha)
        forces = forces_of(self.arithmetic, self.state.tensions, weight)
        return list((abs(forces) - self.thresholds()).tolist())

    def stable(self) -> bool:
        return all(beyond <= self.room for beyond in self.excesses())

    def rests(self, when: str) -> None:
        for n, beyond in enumerate(self.excesses(), 1):
            text = f"slider {n} exceeds its threshold when {when}"
            self.within("static", text, beyond, self.room)

    def ends_in(self, state: State) -> None:
        present = self.state
        self.same("the final tension", present.tensions, state.tensions)
        self.same("the final displacement", present.displacements, state.displacements)
        off = abs(exact_value(present.theta) - exact_value(state.theta)) * self.chain.l0
        rounding = 2.0**-49 * self.load + self.accuracy * (not self.float64)
        text = "the final theta is not where the drive took it"
        self.within("state", text, float(off), rounding)
        if not np.array_equal(present.draws, state.draws):
            self.refute("state", "the number of draws is not what the stops make")
        if not np.array_equal(present.coefficients, state.coefficients):
            self.refute("state", "the final coefficients are not those of the last draws")

    def same(self, what: str, made: NDArray[Any], claimed: NDArray[Any]) -> None:
        """Compare numbers as well as errors of events add up."""
        for here, there in zip(made.tolist(), claimed.tolist(), strict=True):
            known, value = enclosure(there), exact_value(here)
            rounded = FLOAT_ACCURACY if isinstance(there, float) else 0.0
            room = max(rounded, self.accuracy) * (1 + len(self.radii)) ** 0.5 * self.scale
            room += self.room + 2.0**-50 * abs(float(value)) * self.float64
            text = f"{what} is not what the events make"
            self.within("state", text, float(abs(value - known.middle)), room)

    def rearrangement(self, events: Sequence[Event], load_error: float, *, ended: bool) -> None:
        """Judge one rearrangement, from the present state."""
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
                signs = self.contact(replay, event)
                radius = min(nearest_float(known[number].radius), widest)
                for n, sign in signs.items():
                    self.condition(replay, event.kind, n, sign, radius, widest)
                phase.happen(event, signs)
                number += 1
        self.events += number
        self.place = (rearrangement, None)
        before, self.state = self.state, replay.state()
        self.balanced(replay, before.tensions)
        if ended:
            if replay.flow.signs.any():
                self.refute("motion", "sliders still move after the last event")
            self.rests("the rearrangement ends")

    def phase(self, replay: Replay, phase: Phase) -> None:
        """Judge the motion up to the next events, and let it pass."""
        self.within("order", "the event comes before the previous one", -phase.span, 0.0)
        if phase.lasts and not phase.runs:
            self.refute("order", "time passes while no slider moves")
        if phase.lasts:
            resting, when = replay.just_stopped, "after it has stopped"
            if not replay.moves:
                resting, when = set(range(self.chain.n)), "when the rearrangement begins"
            for n in sorted(resting):
                if replay.flow.signs[n] == 0:
                    beyond = abs(replay.flow.forces[n]) - replay.threshold(n)
                    text = f"slider {n + 1} stays at rest beyond its threshold {when}"
                    self.within("static", text, beyond, self.room)
            span = nearest_float(exact_value(phase.span))
            self.within("motion", "sliders move and nothing happens, in tau_dyn", span, _LONGEST)
            allowed = max(self.accuracy, FLOAT_ACCURACY) * self.scale
            worst, n, moving = _Margins(replay, phase.runs).worst(span, allowed)
            act = "turns back" if moving else "exceeds its threshold"
            self.within("motion", f"slider {n + 1} {act} before the event", -worst, allowed)
        phase.arrive()

    def contact(self, replay: Replay, event: Event) -> dict[int, int]:
        """Judge whether the law allows the event; return the signs of its sliders."""
        starts, flow = event.kind is EventKind.START, replay.flow
        for slider, sign in zip(event.sliders, event.signs, strict=True):
            there = 1 <= slider <= self.chain.n
            held, force = (flow.signs[slider - 1], flow.forces[slider - 1]) if there else (0, 0)
            for wrong, why in (
                (not there, "is not there"),
                (sign not in (-1, 1), f"has the sign {sign}"),
                (starts and held != 0, "starts while it moves"),
                (not starts and held != sign, "stops with a sign that it did not have"),
                (starts and sign * force <= 0, "starts against the force on it"),
            ):
                if wrong:
                    self.refute("contact", f"slider {slider} {why}")
        return {slider - 1: sign for slider, sign in zip(event.sliders, event.signs, strict=True)}

    def condition(
        self, replay: Replay, kind: EventKind, n: int, sign: int, radius: float, slack: float
    ) -> None:
        """Judge whether slider `n` (from 0) stops without velocity, or starts at its threshold."""
        flow, first = replay.flow, self.place[1] == 0
        if kind is EventKind.STOP:
            value, what = flow.velocities[n], "moves"
            slope = float(abs(flow.forces[n] - flow.friction[n] * int(flow.signs[n])))
        else:
            value, what = sign * flow.forces[n] - replay.threshold(n), "is not at its threshold"
            around = [m for m in (n - 1, n + 1) if 0 <= m < self.chain.n and flow.signs[m] != 0]
            slope = float(abs(sum(flow.velocities[m] for m in around)))
            if first or n in replay.just_stopped:  # it may start beyond its threshold
                self.within("static", f"slider {n + 1} starts below its threshold", -value, slack)
                if first and self.way:
                    text = f"slider {n + 1} starts beyond its threshold on a ramp"
                    self.within("drive", text, value, slack)
                self.radii.append(math.nan)
                return
        size = float(abs(value))
        allowed = 4 * radius * slope + 4 * radius * radius + slack
        self.within("motion", f"slider {n + 1} {what} at the time of its event", size, allowed)
        self.radii.append(allowed / slope / 4 if slope else math.inf)

    def balanced(self, replay: Replay, before: NDArray[Any]) -> None:
        """Judge whether the energy that went is the work of friction; `before` are tensions."""
        energies = replay.energies()
        if largest := max(abs(term) for term in energies):
            # what is left over of tensions that are much larger than their change is rounding
            rounding = 2.0**-50 if self.float64 else self.accuracy
            base = rounding * float((before * before).sum()) / float(largest)
            left = float(abs(energies.left) / largest)
            self.balance = max(self.balance, left)
            allowed = 4 * max(min(self.accuracy, FLOAT_ACCURACY), base)
            self.within("energy", "energy does not balance", left, allowed)


class _Margins:
    """What must stay positive during a piece of motion, each with a bound of its second derivative.

    A moving slider's speed along its direction, and the two distances of a resting neighbour's
    force from its thresholds; in float64.
    """

    def __init__(self, replay: Replay, runs: Sequence[Run]) -> None:
        self.runs = [
            Run(FLOAT64, run.ends, floats(run.velocities), floats(run.accelerations), run.first)
            for run in runs
        ]
        flow, n = replay.flow, replay.chain.n
        self.size = n
        self.movers = movers = np.array([i for run in runs for i in run.sliders])
        ends = {m for run in runs for m in (run.first - 1, run.first + run.p)}
        self.resting = resting = np.array(sorted(m for m in ends if 0 <= m < n), dtype=int)
        self.sliders = np.concatenate([movers, resting, resting])
        self.directions = flow.signs[movers][:, None]
        rooms = [
            nearest_float(exact_value(replay.threshold(m) - side * flow.forces[m]))
            for side in (1, -1)
            for m in resting.tolist()
        ]
        self.rooms = np.array(rooms).reshape(-1, 1)
        bends, rates = np.zeros(n + 2), np.zeros(n + 2)
        for run in self.runs:
            for i in range(run.p):
                bends[run.first + i + 1] = run.bound(i, 2)
            rates[run.first] += run.bound(0, 1)
            rates[run.first + run.p + 1] += run.bound(run.p - 1, 1)
        bounds = np.concatenate([bends[movers + 1], rates[resting + 1], rates[resting + 1]])
        self.bounds = np.maximum(bounds, np.finfo(float).tiny)[:, None]

    def values(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return every margin and its slope at the times `t`, each of shape (margins, times)."""
        moved = np.zeros((3, self.size + 2, t.size))
        for run in self.runs:
            moved[:, run.first + 1 : run.first + 1 + run.p] = run.at(t)
        speeds, gains = (self.directions * part[self.movers + 1] for part in moved[1:])
        force, rate = (part[self.resting] + part[self.resting + 2] for part in moved[:2])
        rooms = self.rooms + np.concatenate([-force, force])
        return np.concatenate([speeds, rooms]), np.concatenate([gains, -rate, rate])

    def worst(self, span: float, allowed: float) -> tuple[float, int, bool]:
        """Return a margin below -`allowed` on ``[0, span]``, its slider, whether that moves; or 0.

        From value and slope at either end of a piece follows how far inwards a margin stays above
        -`allowed`; a piece that these two reaches do not cover is halved.
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
