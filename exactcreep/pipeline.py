"""Convert a pipeline on the seabed, in SI units, to a chain with end forces, and results back.

A hot pipeline expands against the friction of the soil and contracts when it is shut down. With a
slope of the bed or a tension at one end it *walks*: it advances by the same length in each cycle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.numbers import (
    InputError,
    Number,
    Shown,
    exact_number,
    nearest_float,
    number_from_zero,
    positive_number,
    refusing,
    whole_number,
)
from exactcreep.model.remarks import remark
from exactcreep.model.targets import Targets
from exactcreep.quasistatic.creep import creep
from exactcreep.walk import MILLIMETRES, Walk

_MOST = 20_000  # most cells; a pull that needs more, so small beside friction, hardly moves a pipe


@dataclass(frozen=True, kw_only=True, repr=False)
class Pipeline(Shown):
    """A pipeline on a seabed, and its units as a chain.

    The pipe is cut into equal cells with a slider at each middle, except for the end cells. There
    is a slider at each *virtual anchor*, the place that rests while the pipe is heated, or cooled,
    so that the chain walks like the continuum.

    Attributes
    ----------
    length, axial_stiffness, submerged_weight, kappa, tan_alpha : Fraction
        As in `pipeline`.
    friction : tuple of (Fraction, Fraction)
        Sections from the upper end down: length in m, and coefficient.
    end_forces : tuple of Fraction
        Forces on the upper and the lower end, downhill positive, N.
    profile, static_friction, sigma_mu, contacts : tuple, Fraction, Fraction, int
        As in `pipeline`.
    cell : float
        Length of a cell, m.
    positions : ndarray, shape (n,)
        Positions of the sliders, m from the upper end.
    chain : Chain
        The dimensionless chain.

    Examples
    --------
    >>> pipe = pipeline(length=2000, axial_stiffness="4e9", submerged_weight=500, friction="0.5",
    ...                 tan_alpha="0.035", kappa="1.17e-5")
    >>> f"{pipe.continuum_walk(60):.1f} mm per cycle, above {pipe.critical_heating:.1f} K"
    '82.0 mm per cycle, above 9.9 K'
    """

    length: Fraction
    axial_stiffness: Fraction
    submerged_weight: Fraction
    friction: tuple[tuple[Fraction, Fraction], ...]
    kappa: Fraction
    tan_alpha: Fraction
    end_forces: tuple[Fraction, Fraction]
    profile: tuple[tuple[Fraction, Fraction], ...]
    static_friction: Fraction
    sigma_mu: Fraction
    contacts: int
    cell: float = field(init=False, compare=False)
    positions: NDArray[np.float64] = field(init=False, compare=False)
    chain: Chain = field(init=False, compare=False)
    _units_in_line = True

    def __post_init__(self) -> None:
        total, pull, whole = self._total, self._pull, nearest_float(self.length)
        if abs(pull) >= total:
            beside = f"{total:.4g} N in all, beside a pull of {abs(pull):.4g} N"
            mu = [nearest_float(each) for _, each in self.friction]
            raise InputError("friction", mu, f"must hold the pipe: {beside}")
        first, last = sorted(self.anchors)
        apart = last - first
        cells = max(1, round(self.contacts * apart / whole)) if apart else self.contacts
        cell = (apart or whole) / cells
        above, below = math.floor(first / cell), math.floor((whole - first) / cell)
        if above + below >= _MOST:
            allowed = f"must exceed {2 / _MOST:g} of the friction, or be zero: cells are too short"
            raise InputError("tan_alpha and end_tension", pull, allowed)
        vars(self).update(cell=cell, positions=first + cell * np.arange(-above, below + 1))
        vars(self).update(chain=self._cut())

    def _cut(self) -> Chain:
        """Return the chain of the cells."""
        edges, unit, (_, sine) = self.springs, self.force_unit, self._slope
        low, high = np.interp([edges[:-1], edges[1:]], *self._ground)
        mu, sizes = ((high - low) / self.cell).tolist(), (np.diff(edges)[[0, -1]]).tolist()
        peak = nearest_float(self.static_friction)
        pulls = [
            nearest_float(force) / unit + (size / self.cell - 1) * sine
            for force, size in zip(self.end_forces, sizes, strict=True)
        ]
        heated = np.array(self.profile, dtype=float).T
        weights = np.interp(edges[1:-1], *heated).tolist() if self.profile else ()
        return Chain(
            len(mu), nearest_float(self.axial_stiffness) / unit, mu, [peak * one for one in mu],
            self.sigma_mu, tan_alpha=self.tan_alpha, end_forces=pulls, expansion=weights,
        )  # fmt: skip

    def _facts(self) -> dict[str, Any]:
        return {"length": self.length, "axial_stiffness": self.axial_stiffness, "n": self.chain.n}

    def _units(self) -> dict[str, str]:
        return {"length": "m", "axial_stiffness": "N"}

    @property
    def force_unit(self) -> float:
        """Unit of force: the submerged weight of a cell, N."""
        return nearest_float(self.submerged_weight) * self.cell

    @property
    def length_unit(self) -> float:
        """Unit of length: the extension of a cell under the weight of a cell, m."""
        return self.force_unit * self.cell / nearest_float(self.axial_stiffness)

    @property
    def springs(self) -> NDArray[np.float64]:
        """Positions of `Walk.axial_force`: both ends, and between sliders, m."""
        middles = (self.positions[1:] + self.positions[:-1]) / 2
        return np.array([0.0, *middles, nearest_float(self.length)])

    @cached_property
    def _ground(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The ends of the sections, and the integral of the coefficient up to each, both in m."""
        lengths, mu = np.array(self.friction, dtype=float).T
        return np.cumsum([0.0, *lengths]), np.cumsum([0.0, *(mu * lengths)])

    @property
    def _slope(self) -> tuple[float, float]:
        slope = nearest_float(self.tan_alpha)
        return 1 / math.hypot(1, slope), slope / math.hypot(1, slope)

    @property
    def _total(self) -> float:
        return float(self.friction_up_to(nearest_float(self.length)))

    @property
    def _pull(self) -> float:
        forces = nearest_float(sum(self.end_forces, Fraction(0)))
        return float(self.weight_up_to(nearest_float(self.length))) + forces

    def friction_up_to(self, places: float | NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the friction between the upper end and places along the pipe, N.

        Parameters
        ----------
        places : number or ndarray
            In m from the upper end.

        Returns
        -------
        ndarray
            One number for each place.
        """
        scale = nearest_float(self.submerged_weight) * self._slope[0]
        return np.asarray(scale * np.interp(places, *self._ground))

    def weight_up_to(self, places: float | NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the weight along the bed between the upper end and places along the pipe, N.

        Parameters
        ----------
        places : number or ndarray
            In m from the upper end.

        Returns
        -------
        ndarray
            One number for each place.
        """
        return np.asarray(nearest_float(self.submerged_weight) * self._slope[1] * places)

    @property
    def anchors(self) -> tuple[float, float]:
        """The virtual anchors: places that rest while the pipe is heated, and cooled, m."""
        halves = (self._total - self._pull) / 2, (self._total + self._pull) / 2
        places, _ = self._ground
        hot, cold = np.interp(halves, self.friction_up_to(places), places)
        return float(hot), float(cold)

    @property
    def critical_heating(self) -> float:
        """Heating beyond which the pipe walks, K."""
        stiffness = nearest_float(self.axial_stiffness * self.kappa)
        return (self._total - abs(self._pull)) / stiffness

    def continuum_walk(self, heating: Number) -> float:
        """Return the walk per cycle of the continuum, mm, positive downhill.

        It is ``(x_c - x_h)/EA max(0, EA kappa dT - F + |G|)`` with the `anchors` x_h and x_c, the
        total friction F, and the sum G of the weight along the bed and the end forces. Source:
        ``derivations/unlike.py``; on an even bed it has the form of the engineers' formulas.

        Parameters
        ----------
        heating : number
            Rise of the temperature from shutdown to operation, K.

        Returns
        -------
        float
            In mm.
        """
        hot, cold = self.anchors
        rise = nearest_float(self.kappa * exact_number(heating, "heating"))
        beyond = rise - self.critical_heating * nearest_float(self.kappa)
        return MILLIMETRES * (cold - hot) * max(0.0, beyond)

    def walk(
        self, heatings: Any, cycles: int = 1, *, solver: str = "sliding",
        **options: Any,
    ) -> Walk:  # fmt: skip
        """Return how the pipe walks under cycles of heating and shutdown, from the laid pipe on.

        Parameters
        ----------
        heatings : number, or array of shape (cycles,), (steps, places) or (cycles, steps, places)
            Rise of the temperature above shutdown in each cycle, K. Several places are equally
            spaced from the upper to the lower end; temperatures are linear between them. Several
            steps follow each other in each cycle, and a shutdown follows the last one.
        cycles : int
            How often the heatings are repeated.
        solver : str
            ``sliding`` is for soil without a peak of friction, and does not take a `profile`. Other
            solvers need `static_friction` above 1.
        **options
            As for `creep`.

        Returns
        -------
        Walk
            With displacements and effective axial forces at each end of a heating and a cooling.

        Raises
        ------
        InputError
            If a number is out of range, or the solver does not take the chain.
        """
        count, given = whole_number(cycles, "cycles", least=1), np.zeros(0, dtype=object)
        with suppress(ValueError):  # rows of unequal length
            given = np.array(heatings, dtype=object)
        given = given[None] if given.ndim in (0, 2) else given
        if given.ndim not in (1, 3) or not given.size:
            allowed = "must be numbers, of each cycle, or of each step and place, as many at each"
            raise InputError("heatings", heatings, allowed)
        exact = [number_from_zero(one, f"heatings[{k}]") for k, one in enumerate(given.flat)]
        rises = np.array(exact).reshape(len(given), -1, *given.shape[2:])
        if solver == "sliding" and (rises != rises[..., :1]).any():
            allowed = 'must be numbers, of each cycle; solver="exact" takes heatings along the pipe'
            raise InputError("heatings", heatings, allowed)
        targets = [self._dilations(step) for cycle in rises for step in (*cycle, 0 * cycle[0])]
        record = ("x", "tension")
        run = creep(self.chain, Targets(targets * count), solver=solver, record=record, **options)
        return Walk(self, run, steps=rises.shape[1])

    def _dilations(self, heating: Any) -> Any:
        """Return the dilation by a heating of the pipe; of each spring, by heatings along it."""
        if not isinstance(heating, np.ndarray):
            return self.kappa * heating
        places = np.linspace(0, nearest_float(self.length), len(heating))
        shares = np.interp(self.springs[1:-1], places, heating.astype(float))
        return [self.kappa * Fraction(share) for share in shares]


@refusing
def pipeline(
    *,
    length: Number,
    axial_stiffness: Number,
    submerged_weight: Number,
    friction: Number | Sequence[tuple[Number, Number]],
    kappa: Number,
    tan_alpha: Number = 0,
    end_tension: Number | tuple[Number, Number] = 0,
    profile: Sequence[tuple[Number, Number]] = (),
    static_friction: Number = 1,
    sigma_mu: Number = 0,
    contacts: int = 100,
) -> Pipeline:
    """Return a pipeline on a seabed with its chain (``pipeline(...).chain``).

    The pipe is cut into cells of length a, with one slider each. The unit of force is ``W a``, the
    unit of length is ``W a^2/EA``, and ``l0 = EA/(W a)``.

    Parameters
    ----------
    length : number
        L along the bed, m.
    axial_stiffness : number
        EA of the steel, N.
    submerged_weight : number
        W, N per m.
    friction : number, or sequence of (number, number)
        Axial friction coefficient; or sections from the upper end down, each with its length in m
        and its coefficient.
    kappa : number
        Thermal expansion of the pipe, 1/K.
    tan_alpha : number
        Slope of the bed, positive where it falls towards the lower end. Default: level.
    end_tension : number, or (number, number)
        Tension at the lower end, N, e.g. of a riser; or at the upper and at the lower end.
    profile : sequence of (number, number), optional
        Heating along the pipe: positions in m from the upper end, and the fraction of the heating
        there; linear in between. Default: 1 everywhere.
    static_friction : number
        Peak of the static friction over the sliding friction, at least 1 (no peak).
    sigma_mu : number
        Standard deviation of the static coefficients; 0 for uniform soil.
    contacts : int
        Approximate number of cells, see `Pipeline`.

    Returns
    -------
    Pipeline
        With its `chain`.

    Raises
    ------
    InputError
        If a number is out of range, or friction does not hold the pipe.

    Examples
    --------
    >>> pipe = pipeline(length=1000, axial_stiffness="2e9", submerged_weight=400, friction="0.5",
    ...                 end_tension="5e4", kappa="1.17e-5")
    >>> pipe.chain.n, [round(place) for place in pipe.anchors]
    (100, [375, 625])
    """
    known = {"length": length, "axial_stiffness": axial_stiffness,
             "submerged_weight": submerged_weight, "kappa": kappa}  # fmt: skip
    exact: dict[str, Any] = {name: positive_number(value, name) for name, value in known.items()}
    remark("kappa", exact["kappa"])
    pulled = end_tension if isinstance(end_tension, (list, tuple)) else (0, end_tension)
    if len(pulled) != 2:
        raise InputError("end_tension", end_tension, "must be one tension, or one for each end")
    upper, lower = (exact_number(tension, "end_tension") for tension in pulled)
    sections: Any = friction
    if not isinstance(friction, (list, tuple)):
        sections = [(exact["length"], positive_number(friction, "friction"))]
    sections = _pairs(sections, "friction", positive_number, "a length in m and a coefficient")
    whole = sum((part for part, _ in sections), Fraction(0))
    if whole != exact["length"]:
        wanted = f"must have lengths that sum up to {nearest_float(exact['length']):g} m"
        raise InputError("friction", f"{nearest_float(whole):g} m", wanted)
    heated = _pairs(profile, "profile", exact_number, "a place in m and the share of heating there")
    places = [place for place, _ in heated]
    if sorted({*places}) != places:
        raise InputError("profile", profile, "must hold places in ascending order, with shares")
    peak = exact_number(static_friction, "static_friction")
    if peak < 1:
        raise InputError("static_friction", static_friction, "must be at least 1, in units of mu")
    return Pipeline(
        **exact, friction=sections, tan_alpha=exact_number(tan_alpha, "tan_alpha"),
        end_forces=(-upper, lower), profile=heated, static_friction=peak,
        sigma_mu=exact_number(sigma_mu, "sigma_mu"),
        contacts=whole_number(contacts, "contacts", least=2),
    )  # fmt: skip


def _pairs(
    given: Any, name: str, number: Callable[[Any, str], Fraction], what: str
) -> tuple[tuple[Fraction, Fraction], ...]:
    """Return pairs of numbers, or raise `InputError`, which says `what` they are."""
    pairs = given if isinstance(given, (list, tuple)) else [given]
    if not all(isinstance(pair, (list, tuple)) and len(pair) == 2 for pair in pairs):
        raise InputError(name, given, f"must hold pairs: {what}, from the upper end down")
    return tuple(
        (number(one, f"{name}[{k}]"), number(other, f"{name}[{k}]"))
        for k, (one, other) in enumerate(pairs)
    )
