"""The amplitude of temperature cycles above which a chain creeps, by one of four criteria."""

from __future__ import annotations

from typing import Any

from exactcreep.display import shows_progress
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, Number, nearest_float
from exactcreep.progress import Hearer, reporter
from exactcreep.studies.thresholds.amplitudes import Span
from exactcreep.studies.thresholds.edges import lowest_edge
from exactcreep.studies.thresholds.half_life import HalfLife, half_life
from exactcreep.studies.thresholds.intercept import Intercept, intercept
from exactcreep.studies.thresholds.results import Threshold

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


_STAYS = (
    "must not be 0: on the level what starts symmetric, as the relaxed chain does, stays where it"
    " is; the criterion survival has starts that creep one way or the other"
)
_LEVEL = {
    "horizon": _STAYS,
    "lasting": _STAYS,
    "intercept": "must not be 0: on the level chains creep one way or the other, and no v(A) is"
    " left; the criterion survival counts both",
}
"""Why a criterion has no meaning for a level chain."""


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
        starts still creep after `cycles` cycles; see `survival`. All of them mean creep either way:
        down the incline, or up it as chains of even N do near ``tan_alpha = 0``; `direction` says
        which was found. ``intercept``: the straight part of v(A), downhill, meets zero; the only
        one with disorder. An argument is refused by a criterion that
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
    ``tan_alpha < 0`` the mirror image is meant. On the level, ``tan_alpha = 0``, a chain that
    starts symmetric never creeps: ``survival`` alone has an answer.

    Examples
    --------
    Two relaxed sliders creep from (mu_s c - s)/l0 on:

    >>> found = threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12"), digits=12)
    >>> found.lower, found.criterion, found.evidence.value
    ('0.00016923076923076', 'lasting', 'proved')
    """
    given = {
        name: value
        for name, value in locals().items()
        if value is not None and any(name in taken for taken in CRITERIA.values())
    }
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
    if chain.tan_alpha == 0 and chain.n > 1 and criterion in _LEVEL:
        raise InputError("tan_alpha", 0, _LEVEL[criterion])
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
    return lowest_edge(criterion, chain, span, limits, say, **given)


def _fitting(chain: Chain, given: dict[str, Any]) -> str:
    """Return the criterion that suits a chain."""
    if "cycles" in given:
        return "horizon"
    if chain.sigma_mu != 0:
        return "intercept"
    return "lasting" if chain.n <= _SHORT or chain.mu_s == chain.mu_d else "survival"
