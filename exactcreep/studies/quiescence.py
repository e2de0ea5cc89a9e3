"""Rests of creep (cycles in which x_G changes by less than a jump), and waiting times of jumps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError, Number, nearest_float, number_from_zero
from exactcreep.model.result import Result
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.statistics import jump_of, ratio_of_sums

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False, repr=False)
class Quiescence(Result):
    """The cycles in which a chain stood still, and the waiting times between its jumps.

    Attributes
    ----------
    jump : float
        Smallest change of x_G in a cycle, down or up, that is a jump; unit ``g tau_dyn**2``.
    cycles : int
        Number of cycles after the burn-in, in all runs.
    fraction, fraction_error : float
        Fraction of cycles without a jump, and its standard error from the scatter of the runs. The
        error is nan for one run, because its parts are not independent: a rest can be long.
    jumps : int
        Number of cycles with a jump.
    waiting_mean : float
        Mean number of cycles from one jump to the next; nan without two jumps in a run.
    waiting_ratio : float
        Standard deviation of the waiting times over their mean: 1 for an exponential law.
    waiting : ndarray of int64
        All waiting times, run by run.
    open_ends : ndarray of int64, shape (runs, 2)
        Cycles before the first jump and after the last jump of each run (lower bounds of a waiting
        time); without a jump, both are the number of cycles.
    advances : tuple of ndarray
        The advance of x_G in each cycle, run by run; unit ``g tau_dyn**2``.
    first_cycles : tuple of int
        The cycle, counted from 1, of the first entry of `advances` of each run.

    Examples
    --------
    >>> chain = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    >>> rests = quiescent([creep(chain, Cycles("0.0008", 100), seed=k) for k in range(4)])
    >>> print(f"{rests.fraction:.2f} +- {rests.fraction_error:.2f}")
    0.75 +- 0.14
    """

    told = (
        "jump", "cycles", "fraction", "fraction_error", "jumps", "waiting_mean", "waiting_ratio",
    )  # fmt: skip

    jump: float
    cycles: int
    fraction: float
    fraction_error: float
    jumps: int
    waiting_mean: float
    waiting_ratio: float
    waiting: NDArray[np.int64]
    open_ends: NDArray[np.int64]
    advances: tuple[NDArray[np.float64], ...]
    first_cycles: tuple[int, ...]

    @property
    def table(self) -> pd.DataFrame:
        """One row per jump: `run` from 0, `cycle` from 1, `advance`, cycles `waited` or -1."""
        import pandas as pd  # noqa: PLC0415

        runs = []
        for index, (advance, first) in enumerate(
            zip(self.advances, self.first_cycles, strict=True)
        ):
            at = np.flatnonzero(np.abs(advance) > self.jump)
            waited = np.diff(at, prepend=at[:1] + 1)  # -1 for the first
            columns = {"cycle": at + first, "advance": advance[at], "waited": waited}
            runs.append(pd.DataFrame({"run": index, **columns}))
        return pd.concat(runs, ignore_index=True)


def quiescent(runs: Creep | Sequence[Creep], jump: Number | None = None) -> Quiescence:
    """Return the cycles in which chains stood still, and the waiting times between their jumps.

    Parameters
    ----------
    runs : Creep or sequence of Creep
        Runs under cycles that recorded ``x_G``; several runs are pooled.
    jump : number, optional
        Smallest change of x_G in a cycle, down or up, that is a jump; unit ``g tau_dyn**2``.
        Default: N D/4 with D = (mu_s - mu_d) cos(alpha). One slip of an end slider moves x_G by
        2 D/N.

    Returns
    -------
    Quiescence
        The fraction of cycles without a jump, all waiting times, and a table of the jumps.

    Raises
    ------
    InputError
        If a run was not driven by `Cycles`, did not record ``x_G``, or has no whole cycle after its
        burn-in; if chains differ and no `jump` is given.

    Notes
    -----
    Guarantee: none beyond the runs. In chaos, averages over rests hold but no single rest does.
    Source: Fig. 8 and its discussion.

    Examples
    --------
    >>> chain = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    >>> rests = quiescent(creep(chain, Cycles("0.0008", 300), seed=6, record=("x_G",)))
    >>> rests.cycles, rests.jumps, round(rests.fraction, 2)
    (270, 97, 0.64)
    """
    runs = [runs] if isinstance(runs, Creep) else list(runs)
    if not runs:
        raise InputError("runs", "none", "must be at least one run")
    size = _size_of_jump(runs, jump)
    advances = [_advances(run) for run in runs]
    jumped = [np.flatnonzero(np.abs(advance) > size) for advance in advances]
    waits = [np.diff(cycle) for cycle in jumped]
    waiting = np.concatenate(waits).astype(np.int64)
    ends = [
        (cycle[0], advance.size - 1 - cycle[-1]) if cycle.size else (advance.size, advance.size)
        for cycle, advance in zip(jumped, advances, strict=True)
    ]
    lengths = np.array([advance.size for advance in advances], float)
    fraction, error = ratio_of_sums(lengths - [cycle.size for cycle in jumped], lengths)
    mean = float(waiting.mean()) if waiting.size else math.nan
    return Quiescence(
        size, int(lengths.sum()), float(fraction), float(error), sum(map(len, jumped)), mean,
        float(waiting.std(ddof=1)) / mean if waiting.size > 1 else math.nan,
        waiting, np.array(ends, np.int64), tuple(advances),
        tuple(_left_out(run) + 1 for run in runs),
    )  # fmt: skip


def _size_of_jump(runs: Sequence[Creep], jump: Number | None) -> float:
    if jump is not None:
        return nearest_float(number_from_zero(jump, "jump"))
    sizes = {jump_of(run.chain) for run in runs}
    if len(sizes) > 1:
        raise InputError("jump", None, "must be given, since N D/4 of these chains differ")
    return sizes.pop()


def _advances(run: Creep) -> NDArray[np.float64]:
    if not run.drive.cyclic:
        raise InputError("runs", type(run.drive).__name__, "must be driven by Cycles")
    if "x_G" not in run.recorded:
        raise InputError("runs", "x_G not recorded", 'need runs with record = ["x_G"]')
    begin = np.mean([float(x) for x in run.experiment.initial.displacements])
    ends = np.append(begin, run.recorded["x_G"][1::2].astype(float))
    advances: NDArray[np.float64] = np.diff(ends)[_left_out(run) :]
    if not advances.size:
        raise InputError("runs", "0 cycles", "need a whole cycle after the burn-in")
    return advances


def _left_out(run: Creep) -> int:
    """Return how many whole cycles the burn-in of a run takes."""
    return -(-run.burn_in // 2)
