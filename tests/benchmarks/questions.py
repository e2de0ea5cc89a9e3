"""What an answer costs, question by question: processor time, and what is known of its error.

Mean velocities are asked for to a share of their value at 95 %. A statistical error falls as one
over the square root of the time, so that the time for any share follows from one run; where it is
longer than what was run, the answer is called extrapolated. A solver with a bias answers only
where the bias, and what is not known of it, is smaller than the share.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from exactcreep.laws import prediction
from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.solvers.registry import rearrange, solver_named
from exactcreep.studies.fates.fate import fate
from exactcreep.studies.thresholds.threshold import threshold
from tests.benchmarks.measurements import Velocity, burned_in, velocity_costs
from tests.benchmarks.rearrangements import Rearrangements
from tests.paper import captions, paper_chain

SHARES = (0.03, 0.01, 0.001)
AMPLITUDES = {2: "0.01", 6: "0.01", 30: "0.005", 100: "0.0166"}
TIME_STEPS = ("0.3", "0.1", "0.03")
"""Of Verlet, the cheapest first."""
DIGITS = (12, 100)
_NINETY_FIVE = 1.96


@dataclass(frozen=True)
class Answer:
    """What one way to answer a question costs.

    Attributes
    ----------
    question : str
    n : int
    method : str
    seconds : float
        Processor time; nan if it does not answer the question.
    note : str
        What is known of its error, or why there is no answer.
    """

    question: str
    n: int
    method: str
    seconds: float
    note: str


def timed(run: Callable[[], Any]) -> tuple[Any, float]:
    """Return what `run` returns, and the processor time it took."""
    begin = time.process_time()
    found = run()
    return found, time.process_time() - begin


def sampled(share: float, run: Velocity, which: int) -> tuple[float, str]:
    """Return the time in which a mean is known to a share of itself, and whether it was run.

    At least a block of half-cycles; `which` is 0 for exact, 1 for Verlet.
    """
    mean, error, seconds = run.mean[which], run.error[which], run.seconds[which]
    times = max((_NINETY_FIVE * error / (share * abs(mean))) ** 2, 1.0 / run.blocks)
    return seconds * times, "extrapolated" if times > 1 else "measured"


def biased(share: float, value: float, known: Velocity) -> tuple[bool, str]:
    """Return whether a value without statistical error is known to be good to a share."""
    mean, error = known.mean[0], known.error[0]
    bias = value / mean - 1
    doubt = _NINETY_FIVE * error / abs(mean)
    words = f"bias {100 * bias:+.2g} +- {100 * doubt:.1g} %"
    return abs(bias) + doubt <= share, words


def of_verlet(share: float, runs: list[tuple[str, Velocity]]) -> tuple[float, str]:
    """Return the time of Verlet at the longest step that shows no bias beyond a share."""
    words = ""
    for dt, run in runs:
        scale = abs(run.mean[0])
        bias = (run.mean[1] - run.mean[0]) / scale
        doubt = _NINETY_FIVE * math.hypot(*run.error) / scale
        words = f"dt = {dt}, bias {100 * bias:+.2g} +- {100 * doubt:.1g} %"
        if abs(bias) <= max(share, doubt):
            seconds, how = sampled(share, run, 1)
            return seconds, f"{how}, {words}"
    return math.nan, words


def mean_velocity(n: int, *, members: int, seconds: float) -> Iterator[Answer]:
    """Yield what the mean velocity of a chain costs, by every solver, for every share."""
    amplitude = AMPLITUDES[n]
    chain, drive = paper_chain(n), Cycles(amplitude, 10**6)
    runs = [
        (dt, velocity_costs(n, amplitude, members=members, seconds=seconds, dt=dt))
        for dt in TIME_STEPS
    ]
    best = min((run for _, run in runs), key=lambda run: run.error[0])
    predicted, by_law = timed(lambda: prediction(chain, drive))
    start = State.relaxed(chain)
    slow = solver_named("sliding", {}).simulation(chain, start, 0, ("x_G",))

    def advance() -> float:
        gone = slow.follow(drive, 1, 40).recorded["x_G"]
        return float(gone[-1] - gone[-3]) / 2

    limit, by_limit = timed(advance)
    for share in SHARES:
        question = f"mean velocity to {100 * share:g} %"
        spent: dict[str, tuple[float, str]] = {}
        for value in predicted.values[:1]:
            good, words = biased(share, value, best)
            spent["law"] = (by_law if good else math.nan, words)
        good, words = biased(share, limit, best)
        spent["sliding"] = (by_limit if good else math.nan, words)
        spent["Verlet"] = of_verlet(share, runs)
        spent["exact"] = sampled(share, best, 0)
        for method, (cost, words) in spent.items():
            yield Answer(question, n, method, cost, words)


def itineraries(singles: Rearrangements, *, count: int) -> Iterator[Answer]:
    """Yield what the right events of one rearrangement cost, by the cheapest setting."""
    question = "all events of one rearrangement"
    total = singles.methods[0].errors.size
    for family in dict.fromkeys(method.family for method in singles.methods):
        methods = singles.family(family)
        right = [method for method in methods if method.wrong == 0]
        if right:
            yield Answer(
                question, singles.n, family, right[0].seconds,
                f"{right[0].setting or 'float64'}: right in all of {total}",
            )  # fmt: skip
        else:
            least = min(methods, key=lambda method: method.wrong)
            yield Answer(
                question, singles.n, family, math.nan,
                f"{least.setting}: wrong in {100 * least.wrong:.1f} % of {total}",
            )  # fmt: skip
    chain = paper_chain(singles.n)
    state = burned_in(singles.n, singles.amplitude, 10)
    spent = 0.0
    for _ in range(count):
        proof, seconds = timed(partial(rearrange, chain, state, direction=1, solver="certified"))
        spent += seconds
        state = rearrange(chain, state, direction=1).state
    yield Answer(question, singles.n, "certified", spent / count, proof.evidence.value)


def thresholds(n: int = 3) -> Iterator[Answer]:
    """Yield what the digits of the amplitude cost at which a chain without disorder creeps."""
    chain = captions(n)
    threshold(chain, after=20, digits=5)  # compiles
    for digits in DIGITS:
        edge, seconds = timed(partial(threshold, chain, cycles=20, digits=digits))
        yield Answer(f"threshold to {digits} digits", n, "certified", seconds, edge.evidence.value)


def fates(sizes: tuple[int, ...] = (2, 3)) -> Iterator[Answer]:
    """Yield what it costs to know what becomes of a chain without disorder for ever."""
    fate(captions(sizes[0]), "0.01", solver="exact")  # compiles
    for n in sizes:
        chain = captions(n)
        for solver in ("exact", "certified"):
            found, seconds = timed(partial(fate, chain, "0.01", solver=solver))
            words = f"{found.outcome.value}, {found.evidence.value}"
            yield Answer("fate at A = 0.01", n, solver, seconds, words)
