"""Exact event-driven creep of a chain of sliders with Coulomb friction on an incline.

The system is a `Chain`, a `State` and a `Drive` (`Cycles`, `GaussianSteps`, `Targets` or
`TemperatureRecord`). With a seed and a solver they form an `Experiment`. `load_scene` reads a
`Scene` from a TOML file.

- `creep` follows a whole drive (`Creep`), `rearrange` follows one rearrangement, `sweep` runs a
  grid, which `plot_sweep` draws.
- `fate` and `survival` find out how creep ends, for one or many starts.
- `threshold` finds the amplitude above which a chain creeps.
- `compare` says what a scene needs, and measures what accuracy costs.
- `physical` works with a solid in SI units, `pipeline` with a pipeline on the seabed.
- `laws` are the formulas of the paper, `disorder` the random numbers.

Results say how well they are known (`Evidence`) and why they ended (`Outcome`). Bad input raises
`InputError`. `exactcreep.results` has the types of results, warnings and progress.
"""

import sys

import lazy_loader

from exactcreep import figures as _figures  # noqa: F401 - it registers how results are drawn
from exactcreep.moved import NAMES

__version__ = "0.5.0"

# __init__.pyi names the module of each public name, also for type checkers. A module is imported
# at its first use, so that a help text does not wait for a compiler.
_found, _, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ += ["__version__"]


def __getattr__(name: str) -> object:
    if name in __all__:
        return _found(name)
    moved = NAMES.get(name)
    if moved is None and name in _found("results").__all__:
        moved = "is in exactcreep.results"
    if moved is None:
        return _found(name)  # raises AttributeError
    # `from exactcreep import` drops the text of an AttributeError; it first asks in this function
    imported = sys._getframe(1).f_code.co_name == "_handle_fromlist"
    raise (ImportError if imported else AttributeError)(f"exactcreep.{name} {moved}")


def __dir__() -> list[str]:
    return sorted(__all__)
