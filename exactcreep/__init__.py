"""Exact event-driven creep of a chain of sliders with Coulomb friction on an incline.

The system is a `Chain`, a `State`, and a `Drive` (`Cycles`, `GaussianSteps`, `Path` or
`TemperatureRecord`); all of them with a seed and a solver are an `Experiment`, and a TOML file
that `load_scene` reads is a `Scene`. `rearrange` (a `Rearrangement` of one `Event` after the other,
whose motion is a `Solution`) follows one rearrangement, `creep` (a `Creep`) a whole drive, `sweep`
a grid of them; `resume` goes on from a checkpoint. `fate` (a `Fate`) follows a chain until it has
settled, `survival` (a `Survival`) many starts of one. `threshold` (a `Threshold`), and
with disorder `intercept` (an `Intercept`), look for the amplitude above which a chain creeps.
`compare` and `plan` answer with a dataset over `Method` and seed, and a `Plan`; `quiescent` tells
when the chain of a run stood still (a `Quiescence`); `physical` turns a solid in SI units into the
chain of a `Solid`, and `Solid.creep` a record of temperatures into a `Descent` in millimetres;
`pipeline` does the same for a `Pipeline` on the seabed, and `Pipeline.walk` follows its `Walk`.
`laws` are the formulas of the paper, `disorder` the numbers that are drawn.

Results say how well they are known (`Evidence`) and why they ended (`Outcome`). Long computations
tell a callable their `Progress`. Bad input raises `InputError`, Ctrl-C `Interrupted` with what was
computed, a threshold that cannot be decided `GivenUp`; a run that leaves the model's physical range
warns with `PhysicsWarning`, a record whose unit is doubtful with `RecordWarning`.
"""

import lazy_loader

__version__ = "0.4.0"

# Where each public name lives stands in __init__.pyi, for type checkers too; it is imported when it
# is first used, so that a command line that only prints its help does not wait for a compiler.
__getattr__, _, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ += ["__version__"]


def __dir__() -> list[str]:
    return sorted(__all__)
