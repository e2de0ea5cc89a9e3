"""What earlier versions had and this one has no more, each with what does its work instead."""

from __future__ import annotations

_AUDIT = "tests/oracle/obeys.py of its repository judges finished runs by the model"
SUCCESSORS = {
    "exactcreep.iterate": "`rearrange(...).events` are the events, in order",
    "exactcreep.audit": _AUDIT,
    "exactcreep.Audit": _AUDIT,
    "exactcreep audit": _AUDIT,
    "exactcreep tradeoff": "`exactcreep compare SCENE` answers its question",
    "exactcreep envelope": "`exactcreep compare SCENE` answers its question",
}
"""By public name (``exactcreep.name``) or command (``exactcreep command``)."""


def successor_of(called: str) -> str:
    """Return the sentence that says what replaces a name or command; "" if it never was one."""
    successor = SUCCESSORS.get(called)
    return f"{called} is no more: {successor}" if successor else ""
