from . import disorder as disorder, laws as laws, results as results
from .figures.sweep import plot_sweep as plot_sweep
from .model.chain import Chain as Chain
from .model.drive import (
    Cycles as Cycles,
    Drive as Drive,
    GaussianSteps as GaussianSteps,
)
from .model.numbers import InputError as InputError
from .model.outcome import Evidence as Evidence, Outcome as Outcome
from .model.state import State as State
from .model.targets import Targets as Targets
from .pipeline import pipeline as pipeline
from .quasistatic.creep import creep as creep
from .quasistatic.creep_result import Creep as Creep
from .quasistatic.experiment import Experiment as Experiment
from .records.temperature_record import TemperatureRecord as TemperatureRecord
from .scene import Scene as Scene, load_scene as load_scene
from .solid import physical as physical
from .solvers.registry import rearrange as rearrange
from .studies.compare import compare as compare
from .studies.fates.fate import fate as fate
from .studies.fates.survival import survival as survival
from .studies.sweep import sweep as sweep
from .studies.thresholds.threshold import threshold as threshold

__version__: str
