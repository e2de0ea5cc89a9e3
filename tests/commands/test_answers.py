"""What the commands that ask a question say in words, where they say more than a number."""

from __future__ import annotations

from tests.conftest import Command

PAIR = ("threshold", "--n", "2")


def words(text: str) -> str:
    return " ".join(text.split())


def test_a_threshold_lists_its_edges_and_those_of_seeded_starts(command: Command) -> None:
    scan = ("--cycles", "3", "--points", "30", "--digits", "8", "--solver", "exact")
    told = command(*PAIR, *scan, "--windows", "--seeds", "2")
    assert told.code == 0
    said = words(told.out)
    # (mu_s c - s)/l0, where two relaxed sliders begin to creep
    assert "advance in cycle 3 begins between 0.00033954987505 and 0.00033954987506" in said
    assert "start 1 between 0.000339549" in said
    assert "start 2 between 0.000339549" in said


def test_a_threshold_that_finds_no_time_shows_what_is_known_with_status_3(command: Command) -> None:
    told = command(*PAIR, "--max-seconds", "0")
    assert told.code == 3
    assert "incomplete max_seconds = 0 was reached" in words(told.out)
    assert "below a transient (computed)" in words(told.out)


def test_a_long_itinerary_is_cut_and_says_by_how_much(command: Command) -> None:
    told = command("fate", "--n", "3", "--amplitude", "0.0006", "--start-tension", "0.01")
    lines = told.out.splitlines()
    shown = [line for line in lines if "half-cycle " in line and ": " in line]
    assert len(shown) == 12
    assert lines[-1].split()[:1] == ["and"]
    assert words(lines[-1]).endswith("more")
