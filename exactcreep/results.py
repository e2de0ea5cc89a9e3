"""What computations return and tell: results, their parts, warnings, progress and interruptions.

Each name is imported at its first use, as those of `exactcreep` are.
"""

import lazy_loader

import exactcreep

# results.pyi names the module of each name, relative to the package
_found, __dir__, __all__ = lazy_loader.attach_stub("exactcreep", __file__)


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"No exactcreep.results attribute {name}")
    found = globals()[name] = _found(name)
    vars(exactcreep).pop(name, None)  # where lazy_loader keeps what it found
    return found
