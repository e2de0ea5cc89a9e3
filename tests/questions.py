"""What a user asks of a chain, by the names that the tests of the long run have for it."""

from typing import Any

import exactcreep
from exactcreep import Chain, Creep, Cycles

fate, survival = exactcreep.fate, exactcreep.survival


def creep(chain: Chain, amplitude: Any, cycles: int, **options: Any) -> Creep:
    """Run a chain through so many cycles +A, -A."""
    return exactcreep.creep(chain, Cycles(amplitude, cycles), **options)


def threshold(chain: Chain, **options: Any) -> Any:
    """Ask for the edges of lasting creep, or with `cycles` of creep after so many."""
    return exactcreep.threshold(chain, after=options.pop("cycles", None), **options)


def half_life(chain: Chain, cycles: int, **options: Any) -> Any:
    """Ask for the amplitude at which half of the starts still creep after so many cycles."""
    return exactcreep.half_life(chain, cycles=cycles, **options)
