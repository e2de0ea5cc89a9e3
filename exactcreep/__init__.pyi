from . import disorder as disorder, laws as laws
from .figures.sweep import plot_sweep as plot_sweep
from .model.chain import Chain as Chain
from .model.contacts import Event as Event, EventKind as EventKind
from .model.drive import (
    Cycles as Cycles,
    Drive as Drive,
    GaussianSteps as GaussianSteps,
)
from .model.enclosure import Enclosure as Enclosure
from .model.numbers import InputError as InputError
from .model.outcome import Evidence as Evidence, Outcome as Outcome
from .model.path import Path as Path
from .records.readings import RecordWarning as RecordWarning
from .model.remarks import PhysicsWarning as PhysicsWarning
from .model.state import State as State
from .records.temperature_record import TemperatureRecord as TemperatureRecord
from .motion.solution import Motion as Motion, Solution as Solution
from .pipeline import Pipeline as Pipeline, Walk as Walk, pipeline as pipeline
from .quasistatic.creep import (
    AccuracyWarning as AccuracyWarning,
    Interrupted as Interrupted,
    creep as creep,
)
from .quasistatic.experiment import Experiment as Experiment
from .quasistatic.creep_result import Creep as Creep
from .scene import Scene as Scene, load_scene as load_scene
from .solid import Descent as Descent, Solid as Solid, physical as physical
from .solvers.registry import rearrange as rearrange
from .solvers.rearrangement import Rearrangement as Rearrangement
from .studies.compare import compare as compare
from .studies.fates.fate import fate as fate
from .studies.fates.fate_result import Fate as Fate
from .studies.fates.survival import Survival as Survival, survival as survival
from .studies.sweep import sweep as sweep
from .studies.thresholds.threshold import threshold as threshold
from .studies.thresholds.threshold_result import Threshold as Threshold
from .watch.progress import Progress as Progress

__version__: str
