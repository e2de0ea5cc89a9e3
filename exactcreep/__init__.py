"""Exact event-driven creep of a chain of sliders with Coulomb friction on an incline.

What is simulated: `Chain`, `State`, and a drive (`Cycles`, `GaussianSteps`, `Path` or
`TemperatureRecord`). `rearrange` and `iterate` follow one rearrangement, `creep` a whole drive,
`sweep` a grid of them; `resume` goes on from a checkpoint, `load_scene` reads a TOML file.
`threshold`, `compare`, `plan` and `audit` ask what a user asks; `physical` turns a solid in SI
units into its chain. `laws` are the formulas of the paper, `disorder` the numbers that are drawn.
Results say how well they are known (`Evidence`) and why they ended (`Outcome`).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from exactcreep import laws as laws
    from exactcreep.model import disorder as disorder
    from exactcreep.model.chain import Chain as Chain
    from exactcreep.model.contact import Event as Event
    from exactcreep.model.contact import EventKind as EventKind
    from exactcreep.model.drive import Cycles as Cycles
    from exactcreep.model.drive import GaussianSteps as GaussianSteps
    from exactcreep.model.drive import Path as Path
    from exactcreep.model.numbers import InputError as InputError
    from exactcreep.model.record import TemperatureRecord as TemperatureRecord
    from exactcreep.model.state import State as State
    from exactcreep.model.verdict import Evidence as Evidence
    from exactcreep.model.verdict import Outcome as Outcome
    from exactcreep.quasistatic.loop import Interrupted as Interrupted
    from exactcreep.quasistatic.loop import creep as creep
    from exactcreep.quasistatic.loop import resume as resume
    from exactcreep.quasistatic.result import Creep as Creep
    from exactcreep.scene import load_scene as load_scene
    from exactcreep.solvers.registry import iterate as iterate
    from exactcreep.solvers.registry import rearrange as rearrange
    from exactcreep.studies.auditing import audit as audit
    from exactcreep.studies.comparison import compare as compare
    from exactcreep.studies.physical import physical as physical
    from exactcreep.studies.planning import plan as plan
    from exactcreep.studies.sweeps import sweep as sweep
    from exactcreep.studies.thresholds import threshold as threshold

# Where each public name lives; it is imported when it is first used, so that a command line
# that only prints its help does not wait for a compiler. "module:" alone is the module itself.
_HOMES = {
    "Chain": "model.chain:Chain",
    "Creep": "quasistatic.result:Creep",
    "Cycles": "model.drive:Cycles",
    "Event": "model.contact:Event",
    "EventKind": "model.contact:EventKind",
    "Evidence": "model.verdict:Evidence",
    "GaussianSteps": "model.drive:GaussianSteps",
    "InputError": "model.numbers:InputError",
    "Interrupted": "quasistatic.loop:Interrupted",
    "Outcome": "model.verdict:Outcome",
    "Path": "model.drive:Path",
    "State": "model.state:State",
    "TemperatureRecord": "model.record:TemperatureRecord",
    "audit": "studies.auditing:audit",
    "compare": "studies.comparison:compare",
    "creep": "quasistatic.loop:creep",
    "disorder": "model.disorder:",
    "iterate": "solvers.registry:iterate",
    "laws": "laws:",
    "load_scene": "scene:load_scene",
    "physical": "studies.physical:physical",
    "plan": "studies.planning:plan",
    "rearrange": "solvers.registry:rearrange",
    "resume": "quasistatic.loop:resume",
    "sweep": "studies.sweeps:sweep",
    "threshold": "studies.thresholds:threshold",
}

__all__ = ["__version__", *_HOMES]  # noqa: PLE0604 - the keys are strings


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'exactcreep' has no attribute {name!r}")
    module, _, attribute = _HOMES[name].partition(":")
    found = import_module(f"exactcreep.{module}")
    value = getattr(found, attribute) if attribute else found
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
