"""The amplitude above which a chain creeps: an edge to any digits, or an intercept of v(A)."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any

from exactcreep import laws
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, Number, whole_number
from exactcreep.quasistatic.creep import interruptible
from exactcreep.studies.sense import EDGE, IN_CYCLE, INTERCEPT, require_sense
from exactcreep.studies.thresholds.edge import edge_of
from exactcreep.studies.thresholds.intercept import intercept_of
from exactcreep.studies.thresholds.threshold_result import Threshold
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import Limits
from exactcreep.watch.progress import Hearer, reporter

_LONG = 100  # sliders of a chain of which one run may take seconds: a theorem comes first
_KINDS = EDGE, INTERCEPT


@shows_progress
@interruptible
def threshold(
    chain: Chain,
    *,
    kind: str | None = None,
    after: int | None = None,
    digits: Number | None = None,
    low: Number | None = None,
    high: Number | None = None,
    points: Number | None = None,
    edges: bool = False,
    cycles: Number | None = None,
    fit: tuple[Number, Number] | None = None,
    size: Number | None = None,
    seed: Number | None = None,
    progress: Hearer = None,
    max_seconds: Number | None = None,
) -> Threshold:
    """Find the amplitude above which a chain creeps.

    Without disorder this is an edge: the first amplitude in a scan above which the relaxed chain
    creeps for ever; above it there may be ranges in which the chain rests. With `after`, it is the
    first amplitude above which the chain advances in cycle `after`; the chain may stop later. With
    disorder no edge is sharp, and the straight part of v(A) is extrapolated to zero instead: the
    intercept, the threshold in the paper's figures and in Eq. 22. For more than five sliders
    without disorder, which creep chaotically, name the kind or use `survival`.

    Parameters
    ----------
    chain : Chain
        Friction may differ from slider to slider, end forces may act, and for an edge expansion may
        differ from spring to spring.
    kind : str, optional
        ``edge`` (no disorder; at most five sliders, unless `after` is given or ``mu_s = mu_d``) or
        ``intercept`` (at least two sliders with slips, on a slope below mu_d). Default:
        ``intercept`` with disorder, else ``edge``.
    after : int, optional
        Edge: number of cycles. In the last one x_G has to advance by more than 1e-6 g tau_dyn**2
        downhill, or in the direction of weight and end forces. Default: the chain has to creep for
        ever, in either direction; see `fate`.
    digits : int, optional
        Edge: number of known significant digits; `lower` and `upper` have two more. Default: 15.
    low : number, optional
        Edge: lower end of the scan. Default: half of Eq. 22. If the chain creeps there, the scan is
        extended down to 0.
    high : number, optional
        Edge: upper end of the scan. Default: twice Eq. 22. If nothing creeps there, the scan goes
        on to N times the amplitude at which the relaxed chain first slips.
    points : int, optional
        Edge: number of equal steps of the scan. Default: 1000. Intercept: number of amplitudes, at
        least 8. Default: 12. Amplitude k, from 1, has the start and the disorder of start k of
        `survival`.
    edges : bool
        Edge: whether to list all edges of the scan: the first to all digits, the others in float64.
    cycles : int, optional
        Intercept: number of cycles at each amplitude. Default: 400.
    fit : pair of numbers, optional
        Intercept: range of the line in units of Eq. 22. Default: 1.2 and 2.
    size : number, optional
        Intercept: tensions of a start are uniform in (-size, size), unit m g. Default: 1e-3.
    seed : int, optional
        Intercept: seed of the starts and of the disorder. Default: 0.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.
    max_seconds : number, optional
        Wall time after which the result so far is returned; `reason` then says so.

    Returns
    -------
    Threshold
        Its `kind`, and two decimal amplitudes around the edge, or the intercept with its error and
        the quality of the line; with the laws for comparison.

    Raises
    ------
    InputError
        If an argument is out of range or belongs to the other kind, the question makes no sense for
        the chain, nothing creeps in the scan, or `cycles` are too few for standard errors.

    Notes
    -----
    Guarantee: if `evidence` is `PROVED`, the chain provably does not creep (with `after`: not
    advance in that cycle) at `lower`, and does at `upper`. The edge is the first one in the scan;
    the scan may miss edges between two of its points. With ``mu_s = mu_d`` the result is exact:
    creep for ever begins at N m/(2 l0); odd chains with ``N abs(tan_alpha) <= mu_d`` never creep.
    An intercept is never proved: a weighted least-squares line through velocities measured in
    float64, `UNDECIDED` if its chi2 has a probability below 1 %. If a run reaches a limit of its
    solver, the result holds what is known by then, and `reason` names the amplitude. Source:
    Eqs. 20 and 22.

    Examples
    --------
    Two relaxed sliders creep above (mu_s c - s)/l0:

    >>> found = threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12"), digits=12)
    >>> found.kind, found.lower, found.evidence.value
    ('edge', '0.00016923076923076', 'proved')
    >>> rough = threshold(Chain(2, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25"), cycles=200)
    >>> rough.kind, round(rough.intercept / rough.law_seuil, 1)
    ('intercept', 1.3)
    """
    if kind is not None and not (isinstance(kind, str) and kind in _KINDS):
        raise InputError("kind", kind, "must be " + " or ".join(_KINDS))
    if after is not None:
        after = whole_number(after, "after", least=1, most=10**7)
    rough = isinstance(chain, Chain) and chain.sigma_mu != 0
    chosen = kind or (INTERCEPT if rough else EDGE)
    require_sense(chain, IN_CYCLE if after and chosen == EDGE else chosen)
    answer: Callable[..., Threshold] = intercept_of if chosen == INTERCEPT else edge_of
    words: dict[str, Any] = {
        "after": after, "digits": digits, "low": low, "high": high, "points": points,
        "edges": edges or None, "cycles": cycles, "fit": fit, "size": size, "seed": seed,
    }  # fmt: skip
    given = {name: value for name, value in words.items() if value is not None}
    (other,) = {*_KINDS} - {chosen}
    for name in given.keys() - signature(answer).parameters.keys():
        why = ": with disorder no edge is sharp" if rough and not kind else ""
        allowed = f"belongs to kind={other!r}, and this is an {chosen}{why}"
        raise InputError(name, given[name], allowed)
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    if chain.n >= _LONG and (least := laws.edges(chain).get("no_lasting_creep")):
        theorem = f"no start creeps for ever below A = {least:.6g} (proved)"
        say("scan", 0, 1, "amplitudes", answer=theorem)
    return answer(chain, limits, say, **given)
