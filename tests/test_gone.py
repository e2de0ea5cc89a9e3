"""What is gone answers with what does its work instead."""

from __future__ import annotations

import pytest

import exactcreep
from exactcreep.cli import COMMANDS, status
from exactcreep.gone import SUCCESSORS

NAMES = [called.removeprefix("exactcreep.") for called in SUCCESSORS if "." in called]
GONE_COMMANDS = [called.removeprefix("exactcreep ") for called in SUCCESSORS if " " in called]


def test_what_is_gone_is_a_name_or_a_command_and_is_no_more() -> None:
    assert len(NAMES) + len(GONE_COMMANDS) == len(SUCCESSORS)
    assert not {*NAMES} & {*exactcreep.__all__}
    assert not {*GONE_COMMANDS} & {*COMMANDS}


@pytest.mark.parametrize("name", NAMES)
def test_a_name_that_is_gone_names_its_successor(name: str) -> None:
    with pytest.raises(AttributeError) as refused:
        getattr(exactcreep, name)
    assert str(refused.value) == f"exactcreep.{name} is no more: {SUCCESSORS[f'exactcreep.{name}']}"


def test_a_name_that_never_was_has_no_successor() -> None:
    with pytest.raises(AttributeError, match="No exactcreep attribute nothing"):
        exactcreep.nothing  # noqa: B018


@pytest.mark.parametrize("command", GONE_COMMANDS)
def test_a_command_that_is_gone_names_its_successor(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status([command, "scene", "--json"]) == 2
    said = f"exactcreep {command} is no more: {SUCCESSORS[f'exactcreep {command}']}"
    assert capsys.readouterr().err == f"exactcreep: {said}\n"
