"""What all thresholds share: the laws and theorems to compare them with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import mpmath

from exactcreep.laws import (
    differing_intercept,
    edges,
    onset_amplitude,
    threshold_amplitude,
)
from exactcreep.model.chain import Chain
from exactcreep.model.enclosure import enclosure
from exactcreep.model.numbers import plain_data
from exactcreep.model.result import Result
from exactcreep.model.uniform import EXPANSION
from exactcreep.motion.arithmetic import BITS_PER_DIGIT

if TYPE_CHECKING:
    import xarray as xr


def laws_beside(chain: Chain, digits: int = 12) -> dict[str, str | None]:
    """Return the laws' predictions for a chain or its mirror image, as decimals; None: no law.

    If friction or end forces differ, Eq. 22 is ``h/l0`` of `differing_intercept`; there is no law
    if springs expand differently.
    """
    context = mpmath.MPContext()
    context.prec = math.ceil((digits + 10) * BITS_PER_DIGIT)

    def number(value: Fraction) -> Any:
        return context.mpf(value.numerator) / value.denominator

    values: dict[str, Any] = dict.fromkeys(("law_seuil", "law_corrected", "law_two_sliders"))
    if EXPANSION in chain.unlike:
        return values
    if chain.unlike:
        pulls = [number(force) for force in chain.end_forces]
        least = differing_intercept(chain.each("mu_d", number), number(chain.tan_alpha), pulls)
        values["law_seuil"] = least / number(chain.l0)
    else:
        rationals = chain.parameters() | {"tan_alpha": abs(chain.tan_alpha)}
        about = {name: number(value) for name, value in rationals.items()}
        held, _ = about.pop("mu_s"), about.pop("sigma_mu")
        values["law_seuil"] = threshold_amplitude(**about)
        values["law_corrected"] = onset_amplitude(**about, mu_s=held)
        if chain.n == 2:
            values["law_two_sliders"] = threshold_amplitude(**about | {"mu_d": held})
    return {name: v if v is None else enclosure(v).text(digits) for name, v in values.items()}


class BesideLaws(Result):
    """A threshold of a chain of either kind, with the laws and theorems for comparison."""

    chain: Chain
    digits: int
    criterion: str
    compare: str

    def _beside(self) -> dict[str, Any]:
        laws = laws_beside(self.chain, self.digits)
        return {**laws, "theorems": edges(self.chain), "compare": self.compare}

    def _columns(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        raise NotImplementedError

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The searched amplitudes; the chain and all single numbers and texts are attributes.

        `Threshold` has its `windows` along ``edge``; `Intercept` has the velocities along
        ``amplitude``, in the units of the fields.
        """
        single = {k: v for k, v in self.summary().items() if isinstance(v, (str, int, float))}
        about = plain_data(self.chain.parameters()) | single
        # imported late: the help of a command takes its options from this module
        made: xr.Dataset = import_module("xarray").Dataset(*self._columns(), about)
        return made
