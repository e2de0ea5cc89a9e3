"""Run the members of a scene side by side, on all processors of this machine."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import Any

from exactcreep.quasistatic.checkpoint import Checkpoint
from exactcreep.quasistatic.creep import Interrupted, run_alone, run_experiment
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.studies.pool import Signals, pool_of
from exactcreep.watch import interrupts
from exactcreep.watch.limits import NO_LIMITS, Limits
from exactcreep.watch.progress import Hearer, Progress, reporter


def run_members(
    experiments: Iterable[Experiment],
    total: int,
    *,
    progress: Hearer = None,
    limits: Limits = NO_LIMITS,
    checkpoint: Checkpoint | None = None,
) -> list[Creep]:
    """Run `total` experiments, and return their results in the same order.

    An experiment is taken from `experiments` shortly before it starts. The seconds of `limits`
    hold for all members together: later members are then not started, but the first always is. The
    other limits hold for each member. A `checkpoint` that was read from a file is continued; it
    contains all experiments. Ctrl-C raises `Interrupted`.
    """
    if total == 1:
        (experiment,) = experiments
        return [run_alone(experiment, progress=progress, limits=limits, checkpoint=checkpoint)]
    continued: Mapping[int, Any] = {} if checkpoint is None else checkpoint.runs
    kept: AbstractContextManager[None] = nullcontext()
    if checkpoint is not None:
        kept = checkpoint.writing(experiments := [*experiments])
    results: dict[int, Creep] = {}
    heard: dict[int, Progress] = {}
    say = reporter(progress)

    def members() -> Iterator[tuple[int, tuple[int, Experiment]]]:
        for index, experiment in enumerate(experiments):
            if index and index not in continued and limits.passed():
                return
            yield index, (index, experiment)

    def tell() -> None:
        phases = {one.phase for index, one in heard.items() if index not in results}
        phase = "compiling" if "compiling" in phases else "running"
        now = [*heard.values()]
        say(phase, len(results), total, "members", events=sum(one.events for one in now),
            work=sum(one.share for one in now) / total)  # fmt: skip

    with kept, interrupts.deferred() as interrupted, pool_of(None, None) as pool:

        def run(member: tuple[int, Experiment], signals: Signals) -> Creep | None:
            index, experiment = member
            own = replace(limits, interrupted=lambda: signals.stop)
            if index and index not in continued and own.passed():
                return None

            def hear(progress: Progress) -> None:
                heard[index] = progress

            return run_experiment(experiment, own, hear, checkpoint, index)

        for ended in pool.completed(run, members()):
            if ended is not None and (result := ended[1].result()) is not None:
                results[ended[0]] = result
            tell()
        if checkpoint is not None:
            checkpoint.write()
        ordered = [results[index] for index in range(len(results)) if index in results]
        if interrupted():
            raise Interrupted(ordered)
    return ordered
