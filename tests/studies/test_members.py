"""Members of a scene that run side by side: what each is alone, in order, made when it is due."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from exactcreep.model.drive import Cycles
from exactcreep.quasistatic.checkpoint import Checkpoint
from exactcreep.quasistatic.creep import run_alone
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.studies.members import run_members
from exactcreep.watch.limits import Limits
from tests.paper import captions

MEMBERS = [
    Experiment(captions(n), Cycles("0.003", cycles), solver=solver)
    for n, cycles, solver in (
        (6, 80, "exact"),
        (2, 5, "exact"),
        (3, 40, "sliding"),
        (4, 9, "exact"),
    )
]


def test_members_side_by_side_are_what_each_is_alone_through_a_checkpoint_too(
    tmp_path: Path,
) -> None:
    alone = [run_alone(member) for member in MEMBERS]
    assert run_members(MEMBERS, len(MEMBERS)) == alone
    file = tmp_path / "run.ckpt"
    few = Limits.of(max_events=100)
    part = run_members(MEMBERS, len(MEMBERS), limits=few, checkpoint=Checkpoint(file, 0))
    assert sum(run.half_cycles for run in part) < sum(run.half_cycles for run in alone)
    kept = Checkpoint.read(file)
    assert run_members(kept.experiments, len(MEMBERS), checkpoint=kept) == alone


def test_members_for_which_no_time_is_left_are_not_even_made() -> None:
    made = []

    def members() -> Iterator[Experiment]:
        for seed in range(1000):
            made.append(seed)
            yield Experiment(captions(2), Cycles("0.01", 2), seed=seed)

    assert len(run_members(members(), 1000, limits=Limits.of(max_seconds=0))) == 1
    assert made == [0, 1]
