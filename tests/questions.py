"""What a user asks of a chain, by the names that the package has for it today.

Tests about what a chain does in the long run ask through here: a question that is renamed is
renamed in this file alone.
"""

from typing import Any

import exactcreep
from exactcreep import Chain, Creep, Cycles, Fate, Survival


def creep(chain: Chain, amplitude: Any, cycles: int, **options: Any) -> Creep:
    """Run a chain through so many cycles +A, -A."""
    return exactcreep.creep(chain, Cycles(amplitude, cycles), **options)


def fate(chain: Chain, amplitude: Any, **options: Any) -> Fate:
    """Ask what a chain without disorder does for ever."""
    return exactcreep.fate(chain, amplitude, **options)


def survival(chain: Chain, amplitude: Any, **options: Any) -> Survival:
    """Ask how long creep lives from many starts."""
    return exactcreep.survival(chain, amplitude, **options)


def threshold(chain: Chain, **options: Any) -> Any:
    """Ask for the edges of lasting creep, or with `cycles` of creep after so many."""
    return exactcreep.threshold(chain, after=options.pop("cycles", None), **options)


def half_life(chain: Chain, cycles: int, **options: Any) -> Any:
    """Ask for the amplitude at which half of the starts still creep after so many cycles."""
    return exactcreep.half_life(chain, cycles=cycles, **options)
