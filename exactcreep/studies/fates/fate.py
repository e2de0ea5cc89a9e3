"""What a chain without disorder does in the end: it rests, is locked, or creeps.

Which of these depends on the start so finely that float64 may find another fate than the equations
have; evidence says which of the two a result speaks of.
"""

from __future__ import annotations

from exactcreep.display import shows_progress
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError, Number
from exactcreep.model.state import State
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.exact.recurrence import Recurrence
from exactcreep.studies.fates.numerical import numerical_fate, refuse_sliding
from exactcreep.studies.fates.proof import proved_fate
from exactcreep.studies.fates.result import Fate


@shows_progress
def fate(
    chain: Chain,
    amplitude: Number,
    *,
    start: State | None = None,
    cycles: Number = 10_000,
    solver: str = "certified",
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> Fate:
    """Follow a chain without disorder under temperature cycles until it has settled for ever.

    Parameters
    ----------
    chain : Chain
        Without disorder: ``sigma_mu = 0``.
    amplitude : number
        Of the cycles +A, -A.
    start : State, optional
        Default: the relaxed chain. A start that is not at rest is first rearranged.
    cycles : int
        Give up after so many.
    solver : str
        ``certified``: what it finds is proved, for ever, or undecided. ``exact``: float64,
        compiled; it finds that the forces return bit for bit with a period up to 1000, or to within
        rounding for at least 100 cycles in a row.
    max_seconds : number, optional
        Come back after so much wall time with what is known; `reason` then says so.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.

    Returns
    -------
    Fate
        Its `outcome`, `evidence`, `period`, `advance`, `settled_after` and `itinerary`. What has
        not settled, as chaotic creep never does, comes back as a `LIMIT`.

    Raises
    ------
    InputError
        If an argument is out of range, the chain has disorder (no tension ever returns then; see
        `survival`), or no slips (mu_s = mu_d).

    Examples
    --------
    Two sliders creep or not as the relaxed chain tells:

    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> [fate(chain, a, solver="exact").outcome.value for a in ("0.0001", "0.0003", "0.0004")]
    ['at_rest', 'at_rest', 'creeping']
    """
    drive = Cycles(amplitude, cycles)
    experiment = Experiment.of(chain, drive, solver=solver, start=start, record=())
    if chain.sigma_mu != 0:
        allowed = "must be 0: with disorder no tension ever returns; survival tells how long"
        raise InputError("sigma_mu", chain.sigma_mu, allowed + " creep lives")
    refuse_sliding(chain)
    if solver not in ("certified", "exact"):
        raise InputError("solver", solver, "must be certified or exact")
    limits, say, begin = Limits.of(max_seconds=max_seconds), reporter(progress), experiment.initial
    if solver == "exact":
        return numerical_fate(Recurrence(chain, drive, begin), begin, limits, say)[0]
    return proved_fate(chain, drive, begin, limits, say)[0]
