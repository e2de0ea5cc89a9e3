"""Exact event-driven creep of a chain of sliders with Coulomb friction on an incline.

The system is a `Chain`, a `State` and a `Drive` (`Cycles`, `GaussianSteps`, `Path` or
`TemperatureRecord`). With a seed and a solver they form an `Experiment`. `load_scene` reads a
`Scene` from a TOML file.

- `creep` follows a whole drive (`Creep`), `rearrange` follows one rearrangement (`Rearrangement`,
  of `Event`; motion: `Solution`), `sweep` runs a grid.
- `fate` and `survival` (`Fate`, `Survival`) find out how creep ends, for one or many starts.
- `threshold` (`Threshold`) finds the amplitude above which a chain creeps.
- `compare` says what a scene needs, and measures what accuracy costs.
- `physical` and `Solid.creep` (`Solid`, `Descent`) work with a solid in SI units, `pipeline` and
  `Pipeline.walk` (`Pipeline`, `Walk`) with a pipeline on the seabed.
- `laws` are the formulas of the paper, `disorder` the random numbers.

Results say how well they are known (`Evidence`) and why they ended (`Outcome`). Long computations
report `Progress`. Bad input raises `InputError`, Ctrl-C `Interrupted`. Doubtful input warns with
`PhysicsWarning` or `RecordWarning`.
"""

import lazy_loader

__version__ = "0.4.0"

# __init__.pyi names the module of each public name, also for type checkers. A module is imported
# at its first use, so that a help text does not wait for a compiler.
_found, _, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ += ["__version__"]
_GONE = {
    "intercept": 'threshold(chain, kind="intercept")',
    "quiescent": "a cell of the notebook From jumps to steady creep",
    "GivenUp": "the reason of a Threshold",
}


def __getattr__(name: str) -> object:
    if name in _GONE:
        # an ImportError, because `from exactcreep import` drops the text of an AttributeError
        raise ImportError(f"exactcreep.{name} is gone: {_GONE[name]} takes its place")
    return _found(name)


def __dir__() -> list[str]:
    return sorted(__all__)
