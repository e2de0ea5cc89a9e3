"""What a law is: formulas that take the description of a chain and its drive."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from inspect import signature
from types import MappingProxyType

import numpy as np
from mpmath.ctx_mp import MPContext

from exactcreep.laws.operands import Number, coerced, cosine, elementwise, real
from exactcreep.laws.plateaus import pivot, pivots

VOCABULARY: Mapping[str, str] = MappingProxyType(
    {
        "n": "number of sliders",
        "l0": "natural length of a spring at T_0, in units of g tau_dyn**2",
        "mu_d": "dynamical friction coefficient",
        "mu_s": "static friction coefficient (mean value)",
        "sigma_mu": "width of the distribution of the static coefficient",
        "tan_alpha": "slope of the incline",
        "amplitude": "amplitude A_theta of the dilation cycles",
        "sigma_theta": "width of the distribution of random dilations",
        "i": "index of the plateau: slider i - 1 rests during a dilation",
        "kappa": "thermal expansion coefficient, per kelvin",
    }
)


ABBREVIATIONS: Mapping[str, Callable[..., Number]] = MappingProxyType(
    {
        "m": lambda mu_d, tan_alpha: (mu_d - tan_alpha) * cosine(tan_alpha),
        "a": lambda mu_s, tan_alpha: (mu_s - tan_alpha) * cosine(tan_alpha),
        "D": lambda mu_d, mu_s, tan_alpha: (mu_s - mu_d) * cosine(tan_alpha),
        "steps": lambda n, i: n + 3 - 2 * i,
    }
)
"""Names that a formula may use beside the `VOCABULARY`: m, a, D, and steps = N + 3 - 2i."""
_PIVOT = ("n", "tan_alpha", "mu_d")
_pivot = elementwise(pivot)
_KINDS = {"n": "of two sliders", "sigma_mu": "without disorder"}


def _arguments(function: Callable[..., Number]) -> tuple[str, ...]:
    taken = signature(function).parameters.values()
    return tuple(one.name for one in taken if one.default is one.empty)


@dataclass(frozen=True)
class Form:
    """One form of a law: a function of keyword arguments out of :data:`VOCABULARY`.

    Attributes
    ----------
    text : str
        The formula, readable.
    function : callable
        The formula. Its arguments are names of the vocabulary and `ABBREVIATIONS`.
    only : mapping of str to int
        Parameters that need not be given, and must have these values if they are.
    required, optional : tuple of str
        The parameters that the formula contains. Where it has `steps`, `i` is optional: without it
        the pivot of the sliding limit is taken.
    """

    text: str
    function: Callable[..., Number]
    only: Mapping[str, int] = field(default_factory=dict)

    @cached_property
    def _written(self) -> tuple[str, ...]:
        return _arguments(self.function)

    @cached_property
    def _short(self) -> dict[str, tuple[str, ...]]:
        """The abbreviations that the formula uses, and what they are made of."""
        used = (name for name in self._written if name in ABBREVIATIONS)
        return {name: _arguments(ABBREVIATIONS[name]) for name in used}

    @cached_property
    def required(self) -> tuple[str, ...]:
        """Parameters without which the form has no value."""
        contained = set(self._written).union(*self._short.values())
        if "steps" in self._short:
            contained.discard("i")
        return tuple(name for name in VOCABULARY if name in contained)

    @cached_property
    def optional(self) -> tuple[str, ...]:
        """Parameters that are used or examined if they are given."""
        further = {"i", *_PIVOT, *self.only} if "steps" in self._short else set(self.only)
        return tuple(name for name in VOCABULARY if name in further.difference(self.required))

    def __call__(self, **parameters: Number) -> Number:
        """Return the value of the formula.

        Raises
        ------
        TypeError
            If a parameter is missing, unknown or not a real number (named in the message).
        ValueError
            If the parameters are outside of what the form describes.
        """
        if unknown := ", ".join(sorted(set(parameters) - set(VOCABULARY))):
            raise TypeError(f"unknown parameter {unknown}; a law knows {', '.join(VOCABULARY)}")
        if missing := [name for name in self.required if name not in parameters]:
            raise TypeError(f"missing parameter {', '.join(missing)} of {self.text}")
        known = (name for name in self.required + self.optional if name in parameters)
        used = {name: real(parameters[name], name) for name in known}
        if "steps" in self._short and "i" not in used:
            if missing := [name for name in _PIVOT if name not in used]:
                found = " and ".join(missing)
                raise TypeError(f"missing parameter i (or {found}, to find the pivot)")
            # decided on the values as given, before any of them is rounded
            used["i"] = _pivot(*(used[name] for name in _PIVOT))
        values = coerced(used)
        for name, value in self.only.items():
            if name in values and np.any(values[name] != value):
                kind = _KINDS[name]
                raise ValueError(f"{name} must be {value} in a law {kind}, not {values[name]}")
        for name, parts in self._short.items():
            values[name] = ABBREVIATIONS[name](*(values[part] for part in parts))
        return self.function(**{name: values[name] for name in self._written})


def law_values(
    form: Form | None, parameters: Mapping[str, Number], bits: int | None = None
) -> tuple[float, ...]:
    """Return what a form of a law gives; two values where the pivot is not unique.

    There is none (an empty tuple) without a form, and for a slope at which it says nothing.

    Parameters
    ----------
    form : Form or None
    parameters : mapping
        The chain and its drive, rationals by the names of `VOCABULARY`; others are left aside.
    bits : int, optional
        Evaluate the form with so many bits before its value is rounded to a float.
    """
    if form is None:
        return ()
    names = [name for name in (*form.required, *form.optional) if name in parameters]
    given: dict[str, Number] = {name: parameters[name] for name in names}
    if bits is not None:
        context = MPContext()
        context.prec = bits
        given = {name: context.mpf(v.numerator) / v.denominator for name, v in given.items()}
    if "i" not in form.optional:
        return (float(form(**given)),)
    n, slope, friction = (parameters[name] for name in _PIVOT)
    if abs(slope) >= friction:
        return ()
    indices = (given["i"],) if "i" in given else pivots(int(n), slope, friction)
    return tuple(float(form(**given | {"i": i})) for i in indices)


@dataclass(frozen=True)
class Law:
    """A formula of the paper with what became of it.

    Attributes
    ----------
    label : str
        The paper's label, or a name where the paper gives none.
    latex : str
        The printed formula.
    units : str
        What the number means.
    place : str
        Where the paper has it.
    derivation : str
        File and equation in ``derivations/``.
    verdict : str
        ``exact``, ``approximation``, ``misprint``, ``inconsistent`` or ``convention``.
    printed : Form
        As printed.
    corrected, exact : Form or None
        The formula that the paper's own assumptions give; the exact law, where one is known.
    """

    label: str
    latex: str
    units: str
    place: str
    derivation: str
    verdict: str
    printed: Form
    corrected: Form | None = None
    exact: Form | None = None
