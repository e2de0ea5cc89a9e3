from .model.contacts import Event as Event, EventKind as EventKind
from .model.enclosure import Enclosure as Enclosure
from .model.remarks import PhysicsWarning as PhysicsWarning
from .motion.solution import Motion as Motion, Solution as Solution
from .pipeline import Pipeline as Pipeline
from .quasistatic.creep import AccuracyWarning as AccuracyWarning, Interrupted as Interrupted
from .records.readings import RecordWarning as RecordWarning
from .solid import Solid as Solid
from .solvers.rearrangement import Rearrangement as Rearrangement
from .studies.fates.fate_result import Fate as Fate
from .studies.fates.survival import Survival as Survival
from .studies.thresholds.threshold_result import Threshold as Threshold
from .walk import Walk as Walk
from .watch.progress import Progress as Progress
