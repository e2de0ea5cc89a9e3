"""What tasks of a pool and the study that waits for them tell each other."""

from __future__ import annotations

import pytest

from exactcreep.studies.pool import Signals, pool_of
from exactcreep.watch import interrupts


def test_a_task_in_a_thread_hears_a_signal_while_the_study_waits_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def heard(number: int, signals: Signals) -> tuple[bool, bool]:
        before = signals.stop
        monkeypatch.setattr(interrupts, "_waiting", [number])
        return before, signals.stop

    with pool_of(None, 1) as pool:
        ended = [future.result() for _, future in filter(None, pool.completed(heard, [(1, 2)]))]
    assert ended == [(False, True)]
