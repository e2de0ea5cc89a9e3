"""The result of `threshold`, of any kind, with the laws and theorems to compare it with."""

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
    pulls = [number(force) for force in chain.end_forces]
    least = differing_intercept(chain.each("mu_d", number), number(chain.tan_alpha), pulls)
    values["law_seuil"] = least / number(chain.l0)
    if not chain.unlike:
        rationals = chain.parameters() | {"tan_alpha": abs(chain.tan_alpha)}
        about = {name: number(value) for name, value in rationals.items()}
        held, _ = about.pop("mu_s"), about.pop("sigma_mu")
        values["law_corrected"] = onset_amplitude(**about, mu_s=held)
        if chain.n == 2:
            values["law_two_sliders"] = threshold_amplitude(**about | {"mu_d": held})
    return {name: v if v is None else enclosure(v).text(digits) for name, v in values.items()}


class Threshold(Result):
    """The amplitude above which a chain creeps, with the laws and theorems for comparison.

    Attributes
    ----------
    chain : Chain
        The argument.
    kind : str
        ``edge``: the chain creeps for ever above it. ``edge in cycle M`` (``after=M``): it advances
        in cycle M above it. ``intercept``: the straight part of v(A) meets zero there; this is an
        extrapolation, never proved.
    evidence : Evidence
        Of an edge: how well the behaviour at `lower` and at `upper` is known. Of an intercept:
        `COMPUTED` in float64, or `UNDECIDED`; `reason` then says why.
    reason : str
        Why the answer is not complete: the limit that ended the search, that creep does not settle,
        or that v(A) has no straight part; "" if it is.
    compare : str
        The law to compare it with.
    law_seuil : str or float
        Eq. 22: N m/(2 l0), a decimal beside an edge. If friction or end forces differ: h/l0 of
        `laws.differing_intercept`.
    law_corrected, law_two_sliders : str or None
        Edge, as decimals: Eq. 22 corrected, see `laws.onset_amplitude`; and ``(mu_s c - s)/l0`` of
        two relaxed sliders.
    lower, upper : str or None
        Edge. Decimals: the chain does not creep (not advance in the last cycle) at `lower`, and
        does at `upper`. With slips another edge may lie below them, between two points of the scan.
        If creep does not settle within `cycles`: the last amplitude of the scan at which the chain
        locked, and the next one. None: unknown.
    cycles : int
        Edge: the chain has to settle within so many cycles, or advance in the last of them.
        Intercept: cycles at each amplitude.
    digits : int
        Edge: the argument.
    solver : str
        Edge: ``certified``, or ``sliding`` without slips, where the edge is that of the law.
    direction : str
        Edge: direction of the creep (or advance) at `upper`; ``none`` if unknown.
    fates : pair of Fate or None
        Kind ``edge``: what the chain does for ever at `lower` and at `upper`.
    sensitive : tuple of float
        Edge: amplitudes at which starts 1e-13 apart differ in float64, and no certified run found
        the fate. The answer of float64 was taken there, and may be wrong.
    edges : tuple or None
        Edge, on request: every edge of the scan; only the first one is refined beyond float64.
    report : mapping
        Edge: numbers of runs.
    amplitudes, velocities, errors : ndarray, shape (points,)
        Intercept: velocities per half-cycle, unit ``g tau_dyn**2``, and their standard errors. An
        unknown error is replaced by the largest known error.
    intercept, error, slope, slope_error : float
        Intercept: where the line meets zero, its slope, and standard errors; nan if not known.
    systematic : float
        Intercept: larger shift if only the lower, or only the upper half of the amplitudes is
        fitted; inf if a half has no slope.
    chi2, chi2_probability : float
        Intercept: chi2 of the line, and the probability of so large a value.
    fit, seed, size
        Intercept: the arguments; `fit` is the range of the line in units of Eq. 22.
    law_slope : float
        Intercept: ``(N + 3 - 2i) l0`` of Eq. 20; nan where i is not unique. If friction or end
        forces differ, ``(q - p) l0`` of `laws.differing_velocity`.

    Examples
    --------
    >>> found = threshold(pair, digits=12)
    >>> found.lower, found.upper, found.evidence.value
    ('0.00033954987505086', '0.00033954987505087', 'proved')
    """

    chain: Chain
    kind: str
    digits: int
    compare: str

    if TYPE_CHECKING:  # which attributes it has depends on its kind

        def __getattr__(self, name: str) -> Any: ...

    def _beside(self) -> dict[str, Any]:
        laws = laws_beside(self.chain, self.digits)
        return {**laws, "theorems": edges(self.chain), "compare": self.compare}

    def _columns(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        raise NotImplementedError

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The searched amplitudes; the chain and all single numbers and texts are attributes.

        An edge has its `edges` along ``edge``; an intercept has the velocities along
        ``amplitude``, in the units of the fields.
        """
        single = {k: v for k, v in self.summary().items() if isinstance(v, (str, int, float))}
        about = plain_data(self.chain.parameters()) | single
        # imported late: the help of a command takes its options from this module
        made: xr.Dataset = import_module("xarray").Dataset(*self._columns(), about)
        return made
