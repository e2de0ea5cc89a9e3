"""Drive a chain from target to target of the temperature: `creep`.

A solver follows the drive in blocks of targets. A block ends at a target that an observer of the
run needs, or after a tenth of a second. The blocks do not change the result.
"""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import Any, ParamSpec, TypeVar

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.enclosure import as_float
from exactcreep.model.numbers import Number
from exactcreep.model.remarks import PhysicsWarning as PhysicsWarning
from exactcreep.model.remarks import warn
from exactcreep.model.state import State
from exactcreep.quasistatic.checkpoint import Checkpoint
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.observed_run import PAUSE, ObservedRun
from exactcreep.solvers.interface import compile_for
from exactcreep.watch import interrupts
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import NO_LIMITS, Limits
from exactcreep.watch.progress import Hearer, Progress

P = ParamSpec("P")
T = TypeVar("T")
PHYSICS = {
    "draws_below_mu_d": "a static coefficient was drawn below mu_d, and acts as mu_d",
    "theta_beyond_one": "|theta| was 1 or more, where a spring of the model has no length left",
    "crossings": "sliders would have crossed: x_(n+1) <= x_n at the end of a half-cycle",
}
"""Texts of `PhysicsWarning` by their names in `Creep.warnings`."""


class AccuracyWarning(UserWarning):
    """The velocity of a run is less accurate than requested.

    Examples
    --------
    >>> import warnings
    >>> chain = Chain(3, 1000, "0.5", "0.6", sigma_mu="0.01", tan_alpha="0.25")
    >>> with warnings.catch_warnings(record=True, action="always") as caught:
    ...     run = creep(chain, Cycles("0.002", 200), accuracy=1e-3)
    >>> print(caught[0].message)
    the velocity's relative error at 95 % is 0.005, not 0.001: run more cycles
    """


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a computation; `partial` holds its result so far.

    Parameters
    ----------
    partial : object
        The partial result: of `creep` a `Creep`, of `fate` a `Fate`, of `sweep` a grid.

    Examples
    --------
    >>> Interrupted(creep(pair, Cycles("0.001", 50))).partial.half_cycles
    100
    """

    def __init__(self, partial: Any) -> None:
        super().__init__("interrupted")
        self.partial = partial


def interruptible(computation: Callable[P, T]) -> Callable[P, T]:
    """Make a computation raise `Interrupted` with its partial result at Ctrl-C.

    Within a block that defers Ctrl-C, such as a command, the partial result is returned instead.
    """

    @functools.wraps(computation)
    def heard(*args: P.args, **words: P.kwargs) -> T:
        alone = not interrupts.deferring()
        with interrupts.deferred() as interrupted:
            result = computation(*args, **words)
            if alone and interrupted():
                raise Interrupted(result)
        return result

    return heard


@shows_progress
def creep(
    chain: Chain,
    drive: Drive,
    *,
    seed: int = 0,
    solver: str = "exact",
    start: State | None = None,
    record: Sequence[str] = ("x_G",),
    burn_in: int | None = None,
    twin: bool = False,
    accuracy: Number | None = None,
    progress: Hearer = None,
    max_events: int | None = None,
    max_seconds: float | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    every: float = 60.0,
    force: bool = False,
    **options: Any,
) -> Creep:
    """Follow a chain along a sequence of temperatures, and return how it moves, and how fast.

    Parameters
    ----------
    chain : Chain
        The chain to drive.
    drive : Cycles, GaussianSteps, Targets or TemperatureRecord
        The dilations that the temperature imposes, one target after the other.
    seed : int
        Seed of the static coefficients that are drawn, and of the targets of GaussianSteps.
    solver : str
        ``exact``: compiled float64, from event to event in closed form; ``certified``: exact
        numbers and balls, `digits` of them, proves; ``verlet``: the independent witness, steps of
        `dt`; ``sliding``: a chain that never sticks (mu_s = mu_d, no disorder).
    start : State, optional
        Initial state. Default: the relaxed chain (theta = 0, no tensions). If the force on a slider
        exceeds its static friction, the sliders first move until all rest; theta stays the same.
    record : sequence of str
        Any of ``x_G`` (displacement of the centre of mass), ``x`` (of each slider), ``tension`` (of
        each spring), ``slips`` (of each slider), at every target; and the tables ``events``,
        ``rearrangements`` and ``slip_table``; `Creep.dataset` has their columns. With ``()`` the
        memory that a run needs does not grow with its length.
    burn_in : int, optional
        Number of targets that are left out of the mean velocity, for Cycles rounded up to whole
        cycles. Default: none for Targets or a TemperatureRecord; for other drives a tenth of the
        targets, at least 2.
    twin : bool
        Slightly perturbed copies of the run show up to which target its trajectory is known
        (`Creep.known_until`). True: follow the copies until one of them differs from the run.
        Default: follow each copy for at most 16,384 events, after which the distance of copies
        that have stayed close is taken to grow in proportion to time.
    accuracy : number, optional
        Stop when the mean velocity has this relative error at 95 %. The error is tested after 128
        targets, then each time after 1.5 times as many; ``report["relative_error"]`` is the
        error at the last test.
    progress : bool or callable, optional
        A callable receives a `Progress` about ten times a second. Default: a bar on terminals and
        in notebooks after a second; True: also lines where no bar can be shown.
    max_events, max_seconds : number, optional
        Stop after this number of events, or of seconds of wall time, with the partial result and
        the outcome `LIMIT`.
    checkpoint : path, optional
        A file that is kept up to date (`exact`, `sliding`, `verlet`). If it exists, the same call
        continues the run in it with the same bits, and says so by a `CheckpointWarning`. Limits
        start again, except `max_events`.
    every : number
        Seconds between two writings of the checkpoint.
    force : bool
        Begin the run anew even if the checkpoint exists, and overwrite it.
    **options
        Options of the solver.

    Returns
    -------
    Creep
        Its `outcome` is

        - ``RUNAWAY``: proved: no slider ever stops again, or the chain never comes to rest
          (`reason` says which);
        - ``LIMIT``: a limit was reached; `reason` says which. Recorded data may take half of the
          free memory. The run also ends after about a million events without a new target if
          friction cannot hold the chain (equal sliders: tan_alpha >= mu_d) or |theta| reaches 1;
        - ``AT_REST``: no event in the last whole cycle, hence never again; for drives other than
          Cycles, no event after the burn-in;
        - ``CREEPING``: every slider has moved in the same direction between two cycle ends at which
          the tensions are equal; or, if tensions do not return, by at least two standard errors
          over all half-cycles after the burn-in;
        - ``CYCLING``: sliders slip, but the chain does not advance. `outcome_evidence` is
          `UNDECIDED` if the drift is below two standard errors (`reason` holds its bound), or if,
          without disorder, the tensions have not returned. Equal sliders on the level that start
          relaxed have no mean drift, by symmetry; two of them age (`laws.level_displacement`).

        The outcome holds after `since` cycles. If the tensions have returned, the outcome holds for
        ever, and `outcome_evidence` equals `evidence`. If not, the outcome was seen only in this
        run, and `outcome_evidence` is at most `COMPUTED`. If the tensions return only to within
        2**-40 of the friction, it is `UNDECIDED`.
        Displacements below 2**-50 n (mu_s + |tan_alpha|) cos(alpha) per slip may be rounding errors
        and count as zero.

        `velocity_error` comes from averages over blocks (`statistics.standard_error`); it is nan
        if the estimate still grows with the length of the blocks.

    Raises
    ------
    InputError
        If an argument is out of range, the solver lacks an option, or the checkpoint belongs to
        another experiment (the message names the first parameter that differs).
    Interrupted
        At Ctrl-C: a KeyboardInterrupt that holds the partial result.

    Notes
    -----
    Guarantee: recording, progress and checkpoints do not change the result by a single bit.

    Examples
    --------
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> result = creep(chain, Cycles(amplitude="0.001", cycles=50), record=["x_G", "slips"])
    >>> result.outcome.value, round(result.velocity, 6), result.dataset.slips.shape
    ('creeping', 0.776114, (100, 2))

    A run that was stopped goes on with the same call:

    >>> part = creep(chain, Cycles("0.001", 50), checkpoint="run.ckpt", max_events=100)
    >>> part.half_cycles, creep(chain, Cycles("0.001", 50), checkpoint="run.ckpt").half_cycles
    (6, 100)
    """
    asked: dict[str, Any] = {"record": record, "accuracy": accuracy}  # not yet checked
    experiment = Experiment(
        chain, drive, seed=seed, solver=solver, start=start, burn_in=burn_in, twin=twin,
        options=options, **asked,
    )  # fmt: skip
    limits = Limits.of(max_events, max_seconds)
    kept = None if checkpoint is None else Checkpoint(checkpoint, every, force=force)
    return _warned(run_alone(experiment, progress=progress, limits=limits, checkpoint=kept))


def run_alone(
    experiment: Experiment,
    *,
    progress: Hearer = None,
    limits: Limits = NO_LIMITS,
    checkpoint: Checkpoint | None = None,
) -> Creep:
    """Run one experiment, or continue it from its checkpoint; Ctrl-C raises `Interrupted`."""
    run = ObservedRun(experiment)
    kept = nullcontext() if checkpoint is None else checkpoint.writing(run)
    with kept, interrupts.deferred() as interrupted:
        result = advanced(run, replace(limits, interrupted=interrupted), progress, checkpoint)
        if checkpoint is not None:
            checkpoint.write()
        if interrupted():
            raise Interrupted(result)
    return result


def advanced(
    run: ObservedRun, limits: Limits, progress: Hearer = None, checkpoint: Checkpoint | None = None
) -> Creep:
    """Continue a run, in any thread, until it ends or a limit is reached."""

    def watch(phase: str = "running") -> None:
        if callable(progress):
            progress(_progress(run, phase))
        if checkpoint is not None and phase == "running":
            checkpoint.take()

    if not run.ended:
        experiment, say = run.experiment, partial(watch, "compiling")
        compile_for(experiment.algorithm, experiment.chain, experiment.record, say)
        pause = PAUSE if checkpoint is None else min(PAUSE, checkpoint.every)
        run.go_on(limits, watch, pause)
    return run.result()


def _progress(run: ObservedRun, phase: str) -> Progress:
    drive, seed, done = run.experiment.drive, run.experiment.seed, run.done
    theta, part = None, 0.0
    if not drive.springs:
        theta = float(drive.targets(done, 1, seed)[0]) if done else run.experiment.theta
    if theta is not None and done < run.total:
        before, theta = theta, as_float(run.simulation.state().theta)
        way = float(drive.targets(done + 1, 1, seed)[0]) - before
        part = min(max((theta - before) / way, 0.0), 1.0) if way else 0.0
    work, events = (done + part) / run.total, run.simulation.tally.events
    return Progress(phase, done, run.total, events, run.seconds, work=work, theta=theta)


def _warned(result: Creep) -> Creep:
    """Return a result; warn if it left the model's physical range or is not accurate enough."""
    for name, count in result.warnings.items():
        if name != "theta_beyond_one":  # the experiment has warned of this before the run
            warn(f"{PHYSICS[name]} ({count} times)")
    if result.report.get("accuracy_reached") is False:
        warn(accuracy_reached(result.report), AccuracyWarning)
    return result


def accuracy_reached(report: Mapping[str, Any]) -> str:
    """Return the sentence that says whether a velocity is as accurate as requested."""
    known, wanted = report["relative_error"], f"{report['accuracy']:.2g}"
    reached = "is not known" if known is None or math.isnan(known) else f"is {known:.2g}"
    far = f"within {wanted}" if report["accuracy_reached"] else f"not {wanted}: run more cycles"
    return f"the velocity's relative error at 95 % {reached}, {far}"
