"""The amplitude of temperature cycles above which a chain creeps, by four meanings of the word.

Told apart: the paper's law, the corrected law, and what the equations do. `horizon`: x_G advances
in a given cycle. `lasting`: the chain creeps for ever. `survival`: half of many starts still creep
after so many cycles. `intercept`: the straight part of v(A) meets zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from exactcreep.display import shows_progress
from exactcreep.limits import Limits, OutOfTime
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError, Number, exact_number, nearest_float, whole_number
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.decimals import magnitude
from exactcreep.solvers.registry import SOLVERS, solver_named
from exactcreep.solvers.solver import advance
from exactcreep.studies.thresholds.edges import MOST_DIGITS, SPARE, EdgeSearch
from exactcreep.studies.thresholds.half_life import HalfLife, half_life
from exactcreep.studies.thresholds.horizon import Question
from exactcreep.studies.thresholds.intercept import Intercept, intercept
from exactcreep.studies.thresholds.lasting import MOST_CYCLES, Lasting
from exactcreep.studies.thresholds.span import Span, text_of
from exactcreep.studies.thresholds.threshold import Edge, Threshold

_SEED_SIZE = Fraction(1, 10**6)  # of seeded tensions: far below a slip, far above rounding
_SHORT = 5  # sliders: longer chains creep chaotically, and for a while only
_SEARCHED = ("digits", "low", "high", "points", "bracket", "windows", "refine", "start_tension")
CRITERIA: dict[str, tuple[str, ...]] = {
    "horizon": ("cycles", *_SEARCHED, "seeds", "solver"),
    "lasting": (*_SEARCHED, "solver"),
    "survival": ("cycles", "digits", "low", "high", "bracket", "starts", "size", "seed", "workers"),
    "intercept": ("cycles", "points", "fit", "size", "seed"),
}
"""The arguments that each criterion uses."""
_NAMED = {"low": "from", "high": "to"}  # how messages call an argument


@shows_progress
def threshold(
    chain: Chain,
    *,
    criterion: str | None = None,
    cycles: Number | None = None,
    digits: Number | None = None,
    low: Number | None = None,
    high: Number | None = None,
    points: Number | None = None,
    bracket: tuple[Number, Number] | None = None,
    windows: bool | None = None,
    refine: Number | None = None,
    start_tension: Number | None = None,
    seeds: Number | None = None,
    solver: str | None = None,
    starts: Number | None = None,
    size: Number | None = None,
    seed: Number | None = None,
    fit: tuple[Number, Number] | None = None,
    workers: Number | None = None,
    progress: Hearer = None,
    max_seconds: Number | None = None,
) -> Threshold | HalfLife | Intercept:
    """Return the amplitude of temperature cycles above which a chain creeps, by one criterion.

    Parameters
    ----------
    chain : Chain
    criterion : str, optional
        ``horizon``: x_G advances by more than 1e-6 in cycle `cycles`, from the relaxed chain.
        ``lasting``: the chain creeps for ever, from there; see `fate`. ``survival``: half of many
        starts still creep after `cycles` cycles; see `survival`. ``intercept``: the straight part
        of v(A) meets zero; the only one with disorder. An argument is refused by a criterion that
        it does not name below. Default: ``horizon`` if `cycles` is given; with disorder
        ``intercept``; ``lasting`` up to five sliders and without slips (mu_s = mu_d); else
        ``survival``, since long chains creep chaotically, and for a while only.
    cycles : int, optional
        Of ``horizon``: full cycles +A, -A up to the verdict, default 20. Of ``survival``: the
        horizon, default 4000. Of ``intercept``: of each amplitude, default 400.
    digits : int, optional
        Of ``horizon`` and ``lasting``: significant digits of the bracket, default 15. Of
        ``survival``: bisection ends at a relative width of ``10**-digits``, default 3.
    low, high : number, optional
        Of all but ``intercept``: ends of the scan; default 1/2 and 2 times Eq. (seuil). If nothing
        creeps up to there (or the law is not positive), the default scan goes on to
        N (mu_s c - s)/l0; if the chain creeps at its lower end, as it may from a start with
        tensions, it begins at 0.
    points : int, optional
        Of ``horizon`` and ``lasting``: equal steps of the scan, default 1000. Of ``intercept``:
        amplitudes, at least 8, default 12.
    bracket : pair of numbers, optional
        Of all but ``intercept``, instead of a scan: the chain does not creep at the first, and
        creeps at the second.
    windows : bool, optional
        Of ``horizon`` and ``lasting``: whether to list all edges of the scan.
    refine : int, optional
        Of ``horizon`` and ``lasting``: how many windows to give to all digits; the others have
        float accuracy.
    start_tension : number, optional
        Of ``horizon`` and ``lasting``: of every spring, at theta = 0; default none, the relaxed
        chain.
    seeds : int, optional
        Of ``horizon``: also find the threshold from so many starts with seeded tensions, uniform in
        (-size, size) with size ``|start_tension|``, or 1e-6.
    solver : str, optional
        Of ``horizon`` and ``lasting``, which decides about the bracket: ``certified`` (default),
        ``exact`` (float64: at most 12 digits, and a wider bracket where rounding does not tell so
        many), or, of ``horizon``, ``mpmath``.
    starts : int, optional
        Of ``survival``: number of starts, default 40.
    size : number, optional
        Of ``survival`` and ``intercept``: tensions of a start are uniform in (-size, size), unit
        m g, default 1e-3.
    seed : int, optional
        Of ``survival`` and ``intercept``: of starts, and of the disorder; default 0.
    fit : pair of numbers, optional
        Of ``intercept``: range of the line in units of Eq. (seuil), default 1.2 and 2.
    workers : int, optional
        Of ``survival``: threads, default one for each processor.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.
    max_seconds : number, optional
        Come back after so much wall time with what has been found; `reason` then says so.

    Returns
    -------
    Threshold, HalfLife or Intercept
        Of ``horizon`` and ``lasting``; of ``survival``; of ``intercept``. `evidence` says how well
        it is known, `compare` which of the laws beside it is about the same thing.

    Raises
    ------
    InputError
        If an argument is out of range or of no use to the criterion, a bracket is empty or does
        not straddle an edge, or nothing creeps in the scan.
    GivenUp
        If a run comes to a limit of its solver.

    Notes
    -----
    Guarantee: if `evidence` is `PROVED`, the chain provably does not creep (of ``horizon``: not
    advance in that cycle) at `lower`, and does at `upper`. It is the first edge of the scan: no
    claim is made between its points.

    With ``mu_s = mu_d`` the chain slides with theta and the threshold is N m/(2 l0), exactly. For
    ``tan_alpha < 0`` the mirror image is meant, and an advance is one uphill along x.

    Examples
    --------
    Two relaxed sliders creep from (mu_s c - s)/l0 on:

    >>> found = threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12"), digits=12)
    >>> found.lower, found.criterion, found.evidence.value
    ('0.00016923076923076', 'lasting', 'proved')
    """
    given: dict[str, Any] = {
        "cycles": cycles, "digits": digits, "low": low, "high": high, "points": points,
        "bracket": bracket, "windows": windows, "refine": refine, "start_tension": start_tension,
        "seeds": seeds, "solver": solver, "starts": starts, "size": size, "seed": seed, "fit": fit,
        "workers": workers,
    }  # fmt: skip
    given = {name: value for name, value in given.items() if value is not None}
    if not isinstance(chain, Chain):
        raise InputError("chain", chain, "must be a Chain")
    chosen = criterion is None
    if criterion is None:
        criterion = _fitting(chain, given)
    if not isinstance(criterion, str) or criterion not in CRITERIA:
        raise InputError("criterion", criterion, "must be " + ", ".join(CRITERIA))
    for name, value in given.items():
        if name not in CRITERIA[criterion]:
            allowed = f"has no meaning with the criterion {criterion}"
            if chosen and "cycles" in given:
                allowed += ", which cycles alone stand for: name the criterion, too"
            raise InputError(_NAMED.get(name, name), value, allowed)
    if chain.tan_alpha == 0 and chain.n > 1:
        raise InputError("tan_alpha", 0, "must not be 0: a level chain creeps nowhere")
    if abs(chain.tan_alpha) >= chain.mu_s:
        allowed = f"must be less than mu_s = {nearest_float(chain.mu_s)}, or the chain slides"
        raise InputError("tan_alpha", chain.tan_alpha, allowed)
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    if criterion == "intercept":
        return intercept(chain, limits, say, **given)
    if chain.sigma_mu != 0:
        allowed = f"must be 0 with the criterion {criterion}; intercept tells of disorder"
        raise InputError("sigma_mu", chain.sigma_mu, allowed)
    span = Span.of(chain, *(given.pop(name, None) for name in ("low", "high", "bracket")))
    if criterion == "survival":
        return half_life(chain, span, limits, say, **given)
    return _edge(criterion, chain, span, limits, say, **given)


def _fitting(chain: Chain, given: dict[str, Any]) -> str:
    """Return the criterion that suits a chain."""
    if "cycles" in given:
        return "horizon"
    if chain.sigma_mu != 0:
        return "intercept"
    return "lasting" if chain.n <= _SHORT or chain.mu_s == chain.mu_d else "survival"


def _edge(
    criterion: str,
    chain: Chain,
    span: Span,
    limits: Limits,
    say: Callable[..., None],
    *,
    cycles: Number = 20,
    digits: Number = 15,
    points: Number = 1000,
    windows: bool = False,
    refine: Number = 0,
    start_tension: Number = 0,
    seeds: Number = 0,
    solver: str = "certified",
) -> Threshold:
    """Return the lowest edge of a chain."""
    lasting = criterion == "lasting"
    known = [name for name in MOST_DIGITS if name in SOLVERS and not (lasting and name == "mpmath")]
    if not isinstance(solver, str) or solver not in known:
        raise InputError("solver", solver, "must be " + " or ".join(known))
    if not isinstance(windows, bool):
        raise InputError("windows", windows, "must be true or false")
    size = exact_number(start_tension, "start_tension")
    most = MOST_CYCLES if lasting else whole_number(cycles, "cycles", least=1, most=10**7)
    asked = Threshold(
        chain=chain,
        criterion=criterion,
        cycles=most,
        digits=whole_number(digits, "digits", least=1, most=MOST_DIGITS[solver]),
        solver=solver,
        compare=_compared(chain, criterion, most, relaxed=size == 0),
    )
    steps = whole_number(points, "points", least=1, most=10**7)
    count = whole_number(refine, "refine", least=0)
    number = whole_number(seeds, "seeds", least=0, most=10**6)
    if count and not windows:
        raise InputError("refine", refine, "needs windows")
    if span.bracket is not None and windows:
        raise InputError("windows", windows, "needs a scan, and a bracket skips it")
    if chain.n == 1:
        return replace(
            asked,
            outcome_at_lower=Outcome.AT_REST,
            outcome_evidence=Evidence.PROVED,
            evidence=Evidence.PROVED,
        )
    if chain.mu_s == chain.mu_d:
        for field, value in (("windows", windows), ("seeds", number)):
            if value:
                allowed = "has no meaning with mu_s = mu_d: there is one edge, whatever the start"
                raise InputError(field, value, allowed)
        return _sliding(asked)
    start = State.prepared(chain, [size] * (chain.n - 1))
    question = Question(chain, most, start, limits)
    if lasting:
        question = Lasting(chain, most, start, limits, solver)
    search = EdgeSearch(asked, question, span, steps, say, windows, count)
    try:
        if span.free and question.creeps(span.scans[0][0]):
            span = search.span = replace(span, scans=[(Fraction(0), span.scans[0][0])])
        found = search.threshold()
    except OutOfTime as limit:
        return search.unfinished(str(limit))
    preparations: dict[int, Edge | None] = {}
    for seed in range(1, number + 1):
        begin = State.perturbed(chain, abs(size) or _SEED_SIZE, start_seed=seed)
        other = EdgeSearch(asked, replace(question, start=begin), span, steps, say)
        try:
            preparations[seed] = other.refined(*other.first_bracket()).edge
        except InputError:
            preparations[seed] = None
        except OutOfTime as limit:
            return replace(found, preparations=preparations, reason=str(limit))
        say("preparations", seed, number, "starts")
    return replace(found, preparations=preparations) if number else found


def _compared(chain: Chain, criterion: str, cycles: int, *, relaxed: bool) -> str:
    """Return which law an edge may be compared with."""
    if chain.n == 1:
        return "no law: one slider has no spring"
    if chain.mu_s == chain.mu_d:
        return "Eq. (seuil), which is exact without slips"
    if chain.n == 2 and relaxed:
        return "(mu_s c - s)/l0, which is exact for two relaxed sliders, and no other law"
    if criterion == "horizon":
        return f"no law: it says what happens in cycle {cycles}, and creep may end later"
    return "no law: Eq. (seuil) is about long chains, and about the intercept of v(A)"


def _sliding(asked: Threshold) -> Threshold:
    """Return N m/(2 l0), where the chain slides with theta: mu_s = mu_d."""
    chain = asked.chain
    tangent = abs(chain.tan_alpha)
    # N (mu_d - tan) cos / (2 l0) = sqrt(square), floored exactly
    square = (chain.n * (chain.mu_d - tangent) / (2 * chain.l0)) ** 2 / (1 + tangent**2)
    unit = Fraction(10) ** (magnitude(square) // 2 + 1 - asked.digits - SPARE)
    below = math.isqrt(math.floor(square / unit**2))
    cycles = min(asked.cycles, 20)  # it repeats from the second on
    simulation = solver_named("sliding", {}).simulation(
        chain, State.relaxed(chain), 0, ("x_G", "slips")
    )
    followed = advance(simulation, Cycles(below * unit, cycles), 2 * cycles)
    moves = bool(np.any(followed.recorded["slips"][-2:]))
    return replace(
        asked,
        solver="sliding",
        lower=text_of(below, unit),
        upper=text_of(below + 1, unit),
        outcome_at_lower=Outcome.CYCLING if moves else Outcome.AT_REST,
        evidence=Evidence.PROVED,
        stable_digits=asked.digits if asked.criterion == "horizon" else None,
        report={"exact": (below * unit) ** 2 == square},
    )
