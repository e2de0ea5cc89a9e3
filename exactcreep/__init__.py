"""Exact event-driven creep of a chain of sliders with Coulomb friction on an incline.

What is simulated: `Chain`, `State`, and a `Drive` (`Cycles`, `GaussianSteps`, `Path` or
`TemperatureRecord`); all of them with a seed and a solver are an `Experiment`, and a TOML file
that `load_scene` reads is a `Scene`. `rearrange` (a `Rearrangement`, whose motion is a `Solution`)
and `iterate` (one `Event` after the other) follow one rearrangement, `creep` (a `Creep`) a whole
drive, `sweep` a grid of them; `resume` goes on from a checkpoint. `fate` (a `Fate`) follows a chain
until it has settled, `survival` (a `Survival`) many starts of one. `threshold`, `compare`, `plan`
and `audit` ask what a user asks, and answer with a `Threshold` (where creep is chaotic a `HalfLife`
or an `Intercept`), a `Comparison` (of many seeds: `Partings`), a `Plan` and an `Audit`; `physical`
turns a solid in SI units into the chain of a `Solid`, and `Solid.creep` a record of temperatures
into a `Descent` in millimetres. `laws` are the formulas of the paper, `disorder` the numbers that
are drawn.

Results say how well they are known (`Evidence`) and why they ended (`Outcome`). Long computations
tell a callable their `Progress`. Bad input raises `InputError`, Ctrl-C `Interrupted` with what was
computed, a threshold that cannot be decided `GivenUp`; a run that leaves the model's physical range
warns with `PhysicsWarning`, a record whose unit is doubtful with `RecordWarning`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

if TYPE_CHECKING:
    from exactcreep import laws as laws
    from exactcreep.model import disorder as disorder
    from exactcreep.model.chain import Chain as Chain
    from exactcreep.model.contacts import Event as Event
    from exactcreep.model.contacts import EventKind as EventKind
    from exactcreep.model.drive import Cycles as Cycles
    from exactcreep.model.drive import Drive as Drive
    from exactcreep.model.drive import GaussianSteps as GaussianSteps
    from exactcreep.model.drive import Path as Path
    from exactcreep.model.numbers import InputError as InputError
    from exactcreep.model.outcome import Evidence as Evidence
    from exactcreep.model.outcome import Outcome as Outcome
    from exactcreep.model.state import State as State
    from exactcreep.model.temperature_record import RecordWarning as RecordWarning
    from exactcreep.model.temperature_record import TemperatureRecord as TemperatureRecord
    from exactcreep.motion.solution import Motion as Motion
    from exactcreep.motion.solution import Solution as Solution
    from exactcreep.progress import Progress as Progress
    from exactcreep.quasistatic.creep import AccuracyWarning as AccuracyWarning
    from exactcreep.quasistatic.creep import Interrupted as Interrupted
    from exactcreep.quasistatic.creep import PhysicsWarning as PhysicsWarning
    from exactcreep.quasistatic.creep import creep as creep
    from exactcreep.quasistatic.creep import resume as resume
    from exactcreep.quasistatic.decimals import Enclosure as Enclosure
    from exactcreep.quasistatic.experiment import Experiment as Experiment
    from exactcreep.quasistatic.result import Creep as Creep
    from exactcreep.scene import Scene as Scene
    from exactcreep.scene import load_scene as load_scene
    from exactcreep.solid import Descent as Descent
    from exactcreep.solid import Solid as Solid
    from exactcreep.solid import physical as physical
    from exactcreep.solvers.registry import iterate as iterate
    from exactcreep.solvers.registry import rearrange as rearrange
    from exactcreep.solvers.solver import Rearrangement as Rearrangement
    from exactcreep.studies.audits.audit import Audit as Audit
    from exactcreep.studies.audits.audit import audit as audit
    from exactcreep.studies.compare import Comparison as Comparison
    from exactcreep.studies.compare import compare as compare
    from exactcreep.studies.fates.fate import fate as fate
    from exactcreep.studies.fates.result import Fate as Fate
    from exactcreep.studies.fates.survival import Survival as Survival
    from exactcreep.studies.fates.survival import survival as survival
    from exactcreep.studies.partings import Partings as Partings
    from exactcreep.studies.plan import Plan as Plan
    from exactcreep.studies.plan import plan as plan
    from exactcreep.studies.sweep import sweep as sweep
    from exactcreep.studies.thresholds.criteria import threshold as threshold
    from exactcreep.studies.thresholds.half_life import HalfLife as HalfLife
    from exactcreep.studies.thresholds.horizon import GivenUp as GivenUp
    from exactcreep.studies.thresholds.intercept import Intercept as Intercept
    from exactcreep.studies.thresholds.threshold import Threshold as Threshold

# Where each public name lives; it is imported when it is first used, so that a command line
# that only prints its help does not wait for a compiler. "module:" alone is the module itself.
_HOMES = {
    "Audit": "studies.audits.audit:Audit",
    "Chain": "model.chain:Chain",
    "Comparison": "studies.compare:Comparison",
    "Creep": "quasistatic.result:Creep",
    "Cycles": "model.drive:Cycles",
    "Descent": "solid:Descent",
    "Drive": "model.drive:Drive",
    "Enclosure": "quasistatic.decimals:Enclosure",
    "Event": "model.contacts:Event",
    "EventKind": "model.contacts:EventKind",
    "Evidence": "model.outcome:Evidence",
    "Experiment": "quasistatic.experiment:Experiment",
    "Fate": "studies.fates.result:Fate",
    "GaussianSteps": "model.drive:GaussianSteps",
    "GivenUp": "studies.thresholds.horizon:GivenUp",
    "HalfLife": "studies.thresholds.half_life:HalfLife",
    "InputError": "model.numbers:InputError",
    "Intercept": "studies.thresholds.intercept:Intercept",
    "Interrupted": "quasistatic.creep:Interrupted",
    "Motion": "motion.solution:Motion",
    "Outcome": "model.outcome:Outcome",
    "Partings": "studies.partings:Partings",
    "Path": "model.drive:Path",
    "AccuracyWarning": "quasistatic.creep:AccuracyWarning",
    "PhysicsWarning": "quasistatic.creep:PhysicsWarning",
    "Plan": "studies.plan:Plan",
    "Progress": "progress:Progress",
    "Rearrangement": "solvers.solver:Rearrangement",
    "RecordWarning": "model.temperature_record:RecordWarning",
    "Scene": "scene:Scene",
    "Solid": "solid:Solid",
    "Solution": "motion.solution:Solution",
    "State": "model.state:State",
    "Survival": "studies.fates.survival:Survival",
    "TemperatureRecord": "model.temperature_record:TemperatureRecord",
    "Threshold": "studies.thresholds.threshold:Threshold",
    "audit": "studies.audits.audit:audit",
    "compare": "studies.compare:compare",
    "creep": "quasistatic.creep:creep",
    "disorder": "model.disorder:",
    "fate": "studies.fates.fate:fate",
    "iterate": "solvers.registry:iterate",
    "laws": "laws:",
    "load_scene": "scene:load_scene",
    "physical": "solid:physical",
    "plan": "studies.plan:plan",
    "rearrange": "solvers.registry:rearrange",
    "resume": "quasistatic.creep:resume",
    "survival": "studies.fates.survival:survival",
    "sweep": "studies.sweep:sweep",
    "threshold": "studies.thresholds.criteria:threshold",
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
