"""What theory predicts: the paper's formulas, their corrections and the exact laws behind them.

``LAWS[label]`` is the law of the paper's equation ``label`` (formulas without a label have a name
of their own). Each law has a ``printed`` form, and a ``corrected`` and an ``exact`` form where they
exist (``None`` where they do not)::

    >>> from fractions import Fraction
    >>> LAWS["seuil"].printed(n=30, l0=1000, mu_d=Fraction(1, 2), tan_alpha=Fraction(7, 24))
    Fraction(3, 1000)

Every form takes keyword arguments out of one vocabulary, :data:`VOCABULARY`, which describes the
chain and its drive; a form uses what it contains (``form.required``, ``form.optional``) and a
description of the same chain may name the rest. Velocities are ``tau_th <v_G>``, the displacement
of the centre of mass per half-cycle (cycles) or per target (random dilations), in units of
``g tau_dyn**2``; amplitudes are dimensionless dilations.

Numbers decide the arithmetic: mpmath numbers give mpmath numbers of their own context, arrays
broadcast to float64 arrays, floats give floats, and rationals (``int``, ``Fraction``) stay rational
as long as the result is rational. Which side of a boundary a rational, a float (its exact binary
value) or an mpmath number stands on is always decided exactly.

Abbreviations: ``c = cos(alpha)``, ``s = sin(alpha)``, ``m = mu_d c - s``, ``a = mu_s c - s``,
``D = (mu_s - mu_d) c``, ``L = l0 amplitude``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from mpmath import libmp
from mpmath.ctx_mp import MPContext

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
from exactcreep.model.state import State

__all__ = [
    "EDGES",
    "LAWS",
    "VOCABULARY",
    "Edge",
    "Form",
    "Law",
    "PivotWindow",
    "Prediction",
    "at_rest_amplitude",
    "cosine",
    "edges",
    "gaussian_integral",
    "law_values",
    "pivot",
    "pivot_window",
    "pivots",
    "prediction",
    "staircase_two_sliders",
]

Number = Any
"""int, Fraction, float, numpy array or mpmath number."""

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


# --- numbers -------------------------------------------------------------------------------------


def _is_mpf(value: object) -> bool:
    # of any context: each has a class of its own
    return hasattr(value, "_mpf_") and hasattr(value, "context")


def _rational(value: Number) -> Fraction:
    """Return the exact value of a finite scalar."""
    if _is_mpf(value):
        if not value.context.isfinite(value):
            raise ValueError(f"{value} is not a finite number")
        numerator, denominator = libmp.to_rational(value._mpf_)
        return Fraction(int(numerator), int(denominator))
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    return Fraction(value)


def _coerced(given: Mapping[str, Number]) -> dict[str, Number]:
    """Return the parameters brought to one arithmetic; rationals stay rational among themselves."""
    values: dict[str, Number] = {}
    context = None
    has_array = has_float = False
    for name, value in given.items():
        if isinstance(value, bool | str | bytes | complex) or value is None:
            raise TypeError(f"{name} must be a real number or an array of them, not {value!r}")
        if _is_mpf(value):
            context = value.context
        elif isinstance(value, np.ndarray | list | tuple):
            value = np.asarray(value)
            if value.dtype == object:
                if not all(isinstance(x, int | float | Fraction) for x in value.ravel()):
                    raise TypeError(f"{name} must hold real numbers")
                value = value.astype(np.float64)
            if value.dtype.kind not in "iuf":
                raise TypeError(f"{name} must hold real numbers, not {value.dtype}")
            has_array = True
        elif isinstance(value, np.integer):
            value = int(value)
        elif isinstance(value, float | np.floating):
            value = float(value)
            has_float = True
        elif not isinstance(value, int | Fraction):
            raise TypeError(f"{name} must be a real number or an array of them, not {value!r}")
        values[name] = value
    if context is not None:
        if has_array:
            raise TypeError("arrays and mpmath numbers do not mix: call the law once per number")
        return {
            name: value if _is_mpf(value) else context.convert(value)
            for name, value in values.items()
        }
    if has_array:
        return {
            name: value.astype(np.float64) if isinstance(value, np.ndarray) else np.float64(value)
            for name, value in values.items()
        }
    if has_float:
        return {name: float(value) for name, value in values.items()}
    return {name: Fraction(value) for name, value in values.items()}


def _square_root(value: Number) -> Number:
    """Return the square root; of a rational, the rational root where there is one."""
    if _is_mpf(value):
        return value.context.sqrt(value)
    if isinstance(value, Fraction | int):
        value = Fraction(value)
        numerator, denominator = math.isqrt(value.numerator), math.isqrt(value.denominator)
        if numerator**2 == value.numerator and denominator**2 == value.denominator:
            return Fraction(numerator, denominator)
        return math.sqrt(value)
    root = np.sqrt(value)
    return root if isinstance(value, np.ndarray) else float(root)


def _pi(like: Number) -> Number:
    return +like.context.pi if _is_mpf(like) else math.pi


def _positive_part(value: Number) -> Number:
    if isinstance(value, np.ndarray):
        return np.maximum(value, 0.0)
    return value if value > 0 else value * 0


def _elementwise(function: Callable[..., Number], *arguments: Number) -> Number:
    """Return a scalar function's values over broadcast arrays (or its value on scalars)."""
    if not any(isinstance(argument, np.ndarray) for argument in arguments):
        return function(*arguments)
    broadcast = np.broadcast_arrays(*arguments)
    values = [
        function(*point) for point in zip(*(b.ravel().tolist() for b in broadcast), strict=True)
    ]
    return np.array(values, dtype=np.float64).reshape(broadcast[0].shape)


def cosine(tan_alpha: Number) -> Number:
    """Return cos(alpha) of a slope; a rational where it is one (slopes of Pythagorean triangles).

    Derivation: ``derivations/scaling.py``.
    """
    return 1 / _square_root(1 + tan_alpha * tan_alpha)


def _floor_surd(surd: Fraction, radicand: Fraction, rational: Fraction) -> int:
    """Return floor(surd * sqrt(radicand) + rational), exactly."""
    # sign * sqrt(surd**2 radicand), brought to one integer root over one denominator
    square = surd * surd * radicand
    scale = square.denominator * rational.denominator
    inside = square.numerator * square.denominator * rational.denominator**2
    root = math.isqrt(inside)
    shift = rational.numerator * square.denominator
    if surd >= 0:
        return (root + shift) // scale
    # -sqrt(inside) lies in (-(root + 1), -root] : its floor over `scale` needs the exact case
    lower = -root if root * root == inside else -root - 1
    return (lower + shift) // scale


def _ceil_surd(surd: Fraction, radicand: Fraction, rational: Fraction) -> int:
    return -_floor_surd(-surd, radicand, -rational)


# --- pivots --------------------------------------------------------------------------------------


class PivotWindow(NamedTuple):
    """The slopes between which the index i of a plateau is possible.

    Attributes
    ----------
    lower, upper : number
        Slider i - 1 can rest during a dilation for ``lower <= tan_alpha <= upper``.
    lower_alone, upper_alone : number
        Between these no other slider can: outside, the pivot depends on the chain's history.
    """

    lower: Number
    lower_alone: Number
    upper_alone: Number
    upper: Number


def pivot_window(n: int, i: int, mu_d: Number, mu_s: Number) -> PivotWindow:
    """Return the slopes between which slider i - 1 can rest while the chain dilates.

    Parameters
    ----------
    n, i : int
        Number of sliders, index of the plateau (2 <= i <= n + 1).
    mu_d, mu_s : number
        Friction coefficients.

    Returns
    -------
    PivotWindow
        Four values of tan(alpha). Neighbouring windows overlap over a width 2 (mu_s - mu_d)/n.

    Raises
    ------
    ValueError
        If i is not an index of a plateau.

    Notes
    -----
    Derivation: ``derivations/pivots.py``; the upper edge is the paper's Eq. (critical_angle) with
    i - 1 for i, and `lower_alone` is that equation itself.
    """
    if not 2 <= i <= n + 1:
        raise ValueError(f"i must be between 2 and n + 1 = {n + 1}, not {i}")
    p = _coerced({"n": n, "i": i, "mu_d": mu_d, "mu_s": mu_s})
    below = p["mu_d"] * (1 - 2 * (p["i"] - 1) / p["n"])
    above = p["mu_d"] * (1 - 2 * (p["i"] - 2) / p["n"])
    half_width = (p["mu_s"] - p["mu_d"]) / p["n"]
    return PivotWindow(
        below - half_width, below + half_width, above - half_width, above + half_width
    )


def pivots(n: int, tan_alpha: Number, mu_d: Number) -> tuple[int, ...]:
    """Return the one index i of the sliding limit's plateau, or the two where it is not unique.

    Parameters
    ----------
    n : int
        Number of sliders.
    tan_alpha, mu_d : number
        Slope and dynamical friction coefficient, |tan_alpha| < mu_d.

    Returns
    -------
    tuple of int
        ``(i,)`` with ``mu_d (1 - 2(i-1)/n) < tan_alpha < mu_d (1 - 2(i-2)/n)``, or ``(i, i + 1)``
        where the slope equals the edge between the two. Slider i - 1 rests while the chain
        dilates, slider n + 2 - i while it contracts.

    Raises
    ------
    ValueError
        If |tan_alpha| >= mu_d (the chain can run away and has no pivot) or n < 1.

    Notes
    -----
    Guarantee: the arguments are taken at their exact values; the equality is decided exactly.
    Derivation: ``derivations/pivots.py`` and ``derivations/sliding_limit.py``; window of
    Eq. (critical_angle) for mu_s -> mu_d.
    """
    count, slope, friction = int(n), _rational(tan_alpha), _rational(mu_d)
    if count < 1 or count != n:
        raise ValueError(f"n must be a positive integer, not {n}")
    if not abs(slope) < friction:
        raise ValueError(
            f"tan_alpha must lie between -mu_d and mu_d for a pivot, not at {tan_alpha}"
        )
    # tan_alpha n / mu_d lies between n - 2i + 2 and n - 2i + 4
    position = (count + 2 - count * slope / friction) / 2
    lowest = math.ceil(position)
    return (lowest, lowest + 1) if position == lowest else (lowest,)


def pivot(n: int, tan_alpha: Number, mu_d: Number) -> int:
    """Return the index i of the sliding limit's plateau (slider i - 1 rests during a dilation).

    Parameters
    ----------
    n : int
        Number of sliders.
    tan_alpha, mu_d : number
        Slope and dynamical friction coefficient, |tan_alpha| < mu_d.

    Returns
    -------
    int
        i with ``mu_d (1 - 2(i-1)/n) < tan_alpha < mu_d (1 - 2(i-2)/n)``.

    Raises
    ------
    ValueError
        If |tan_alpha| >= mu_d, or where the limit is not unique (see :func:`pivots`).

    Notes
    -----
    Guarantee: decided exactly at the arguments' exact values.
    Derivation: ``derivations/pivots.py``; Eq. (critical_angle).
    """
    found = pivots(n, tan_alpha, mu_d)
    if len(found) == 2:
        raise ValueError(
            f"the sliding limit of n = {n} at tan_alpha = {tan_alpha} is not unique: "
            f"name i = {found[0]} or i = {found[1]}"
        )
    return found[0]


def _plateau_index(p: Mapping[str, Number]) -> Number:
    """Return i as given, or the index of the sliding limit."""
    if "i" in p:
        return p["i"]
    return _elementwise(pivot, p["n"], p["tan_alpha"], p["mu_d"])


def _steps(p: Mapping[str, Number]) -> Number:
    """Return N + 3 - 2i."""
    return p["n"] + 3 - 2 * _plateau_index(p)


# --- exact laws ----------------------------------------------------------------------------------


def _trapezoid(
    h: Number, complement: Callable[[Number], Number], unit: Number, bits: int
) -> Number:
    """Return I(h) by the trapezoidal rule, halving the step until two values agree to `bits`."""
    # The integrand is even, analytic, and decays faster than exp(-z**2/2 - h z): the rule converges
    # geometrically in 1/step. The nearest pole is at a distance of order pi/(2h).
    root_two = (2 * unit) ** (unit / 2)
    decay = bits * 0.6931471805599453
    large = float(h)
    reach = unit * (math.sqrt(large * large + 2 * decay) - large + 1)
    count = 16

    def term(z: Number) -> Number:
        # tails of a normal distribution: falling and rising side
        thin, thick = complement((h + z) / root_two) / 2, complement((h - z) / root_two) / 2
        return thin / (1 + thin / thick) if thick else thin * 0

    step = reach / count
    total = term(unit * 0) / 2 + sum(term(step * k) for k in range(1, count + 1))
    value = 2 * step * total
    while True:
        total += sum(term(step * (2 * k + 1) / 2) for k in range(count))
        count, step = 2 * count, step / 2
        previous, value = value, 2 * step * total
        # halving the step at least squares the error; `value - previous` is the error before it
        if abs(value - previous) <= abs(value) * unit * 2.0 ** (-0.6 * bits) or count > 1 << 16:
            return value


def _gaussian_integral(h: Number) -> Number:
    if _is_mpf(h):
        context = h.context
        working = MPContext()
        working.prec = context.prec + 32
        inner = working.make_mpf(h._mpf_)
        value = _trapezoid(inner, working.erfc, working.mpf(1), context.prec + 12)
        return +context.make_mpf(value._mpf_)
    return _trapezoid(float(h), math.erfc, 1.0, 51)


def gaussian_integral(h: Number) -> Number:
    """Return I(h), the mean advance of a play operator driven by independent normal numbers.

    ``I(h) = integral over z of Phi(z-h) Phi(-z-h) / (Phi(z-h) + Phi(-z-h))``, Phi the normal
    distribution function. For small h,
    ``I(h) = 1/sqrt(pi) - 2h/3 + (1 - (2/pi) asin(1/3)) h**2/(2 sqrt(pi)) + ...``.

    Parameters
    ----------
    h : number or array
        Half-width of the play in units of the drive's standard deviation, h >= 0.

    Returns
    -------
    float, array or mpf
        I(h), positive.

    Raises
    ------
    ValueError
        If an h is negative or not finite.

    Notes
    -----
    Guarantee: computed; the trapezoidal sum has converged, and what remains is the rounding of the
    operand's arithmetic (mpmath: a unit of the last place; float64: 1e-15 (1 + h**2/10), relative).
    Derivation: ``derivations/gaussian.py``; the law behind Eqs. (vitesse_seuil_random) and
    (velocity_th_2_gaussienne_corrected).
    """
    h = _coerced({"h": h})["h"]

    def checked(value: Number) -> Number:
        if not value >= 0 or value == math.inf:
            raise ValueError(f"h must be finite and not negative, not {value}")
        return _gaussian_integral(value)

    return _elementwise(checked, h)


def staircase_two_sliders(
    l0: Number,
    mu_d: Number,
    mu_s: Number,
    tan_alpha: Number,
    amplitude: Number,
    r0: Number = 0,
) -> Number:
    """Return tau_th <v_G> of two sliders under dilation cycles, sigma_mu = 0, exactly.

    Parameters
    ----------
    l0, mu_d, mu_s, tan_alpha, amplitude : number
        The chain and the drive, 0 < tan_alpha < mu_d <= mu_s.
    r0 : number, optional
        x_2 - x_1 - l0 at theta = 0, in units of g tau_dyn**2 (conserved modulo 2D); 0 is the
        relaxed chain.

    Returns
    -------
    number
        ``D`` times the number of rho in ``r0 + D + 2D Z`` with ``|rho| < l0 amplitude - m``; for
        the relaxed chain ``2D max(0, ceil((l0 amplitude - a)/(2D)))``; ``max(0, l0 amplitude - m)``
        where mu_s = mu_d. In units of g tau_dyn**2 per half-cycle.

    Raises
    ------
    ValueError
        If not 0 < tan_alpha < mu_d <= mu_s.

    Notes
    -----
    Guarantee: the number of slips is decided exactly at the arguments' exact values.
    Derivation: ``derivations/two_sliders.py``; exact form of Eq. (velocity_th_2_cycle_corrected).
    """
    p = _coerced(
        {
            "l0": l0,
            "mu_d": mu_d,
            "mu_s": mu_s,
            "tan_alpha": tan_alpha,
            "amplitude": amplitude,
            "r0": r0,
        }
    )
    return _elementwise(_staircase, *p.values())


def _staircase(
    l0: Number, mu_d: Number, mu_s: Number, tan_alpha: Number, amplitude: Number, r0: Number
) -> Number:
    friction, static, slope = _rational(mu_d), _rational(mu_s), _rational(tan_alpha)
    if not 0 < slope < friction <= static:
        raise ValueError(
            "two sliders creep by this law for 0 < tan_alpha < mu_d <= mu_s, not at "
            f"tan_alpha = {tan_alpha}, mu_d = {mu_d}, mu_s = {mu_s}"
        )
    excess = static - friction
    if excess == 0:
        return _positive_part(l0 * amplitude - (mu_d - tan_alpha) * cosine(tan_alpha))
    # everything in units of 2D: 1/c = sqrt(1 + tan_alpha**2) is the only surd
    radicand = 1 + slope * slope
    room, offset = _rational(l0) * _rational(amplitude) / (2 * excess), _rational(r0) / (2 * excess)
    margin = (friction - slope) / (2 * excess)
    first = _floor_surd(-room - offset, radicand, margin - Fraction(1, 2)) + 1
    last = _ceil_surd(room - offset, radicand, -margin - Fraction(1, 2)) - 1
    return max(0, last - first + 1) * ((mu_s - mu_d) * cosine(tan_alpha))


# --- forms ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Form:
    """One form of a law: a function of keyword arguments out of :data:`VOCABULARY`.

    Attributes
    ----------
    text : str
        The formula, readable.
    required, optional : tuple of str
        The parameters that the formula contains; without an optional `i` the pivot of the sliding
        limit is taken.
    function : callable
        Its value for a mapping of coerced parameters.
    """

    text: str
    required: tuple[str, ...]
    function: Callable[[Mapping[str, Number]], Number]
    optional: tuple[str, ...] = ()

    def __call__(self, **parameters: Number) -> Number:
        """Return the value of the formula.

        Raises
        ------
        TypeError
            If a parameter is missing, unknown or not a real number (named in the message).
        ValueError
            If the parameters are outside of what the form describes.
        """
        unknown = sorted(set(parameters) - set(VOCABULARY))
        if unknown:
            raise TypeError(
                f"unknown parameter {', '.join(unknown)}; a law knows {', '.join(VOCABULARY)}"
            )
        missing = [name for name in self.required if name not in parameters]
        if missing:
            raise TypeError(f"missing parameter {', '.join(missing)} of {self.text}")
        used = {
            name: parameters[name] for name in self.required + self.optional if name in parameters
        }
        if "n" in used and "i" not in used and "i" in self.optional:
            # the pivot is decided on the values as given, before any of them is rounded
            found_from = [_with_index(used)[name] for name in ("n", "tan_alpha", "mu_d")]
            if not any(isinstance(value, np.ndarray | list | tuple) for value in found_from):
                used["i"] = pivot(*found_from)
        return self.function(_coerced(used))


@dataclass(frozen=True)
class Law:
    """A formula of the paper with what became of it.

    Attributes
    ----------
    label : str
        The paper's label, or a name where the paper gives none.
    formula, latex : str
        The printed formula, plain and in LaTeX.
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
    formula: str
    latex: str
    units: str
    place: str
    derivation: str
    verdict: str
    printed: Form
    corrected: Form | None = None
    exact: Form | None = None


_VELOCITY = "tau_th <v_G>, in g tau_dyn**2 per half-cycle or target"
_AMPLITUDE = "dilation, dimensionless"
_SLOPE = "tan(alpha)"

_TWO_CYCLES = ("l0", "mu_d", "mu_s", "tan_alpha", "amplitude")


def _no_disorder(p: Mapping[str, Number]) -> None:
    if "sigma_mu" in p and np.any(p["sigma_mu"] != 0):
        raise ValueError(f"sigma_mu must be 0 for the exact staircase, not {p['sigma_mu']}")


def _with_index(p: Mapping[str, Number]) -> Mapping[str, Number]:
    """Return p, refusing one that neither holds i nor what the pivot is found from."""
    missing = [name for name in ("tan_alpha", "mu_d") if name not in p]
    if "i" not in p and missing:
        raise TypeError(f"missing parameter i (or {' and '.join(missing)}, to find the pivot)")
    return p


def _two(
    function: Callable[[Mapping[str, Number]], Number],
) -> Callable[[Mapping[str, Number]], Number]:
    """Return the same function, refusing a chain that does not have two sliders."""

    def of_two(p: Mapping[str, Number]) -> Number:
        if "n" in p and np.any(p["n"] != 2):
            raise ValueError(f"n must be 2 in a law of two sliders, not {p['n']}")
        return function(p)

    return of_two


def _m(p: Mapping[str, Number]) -> Number:
    """Return m."""
    return (p["mu_d"] - p["tan_alpha"]) * cosine(p["tan_alpha"])


def _a(p: Mapping[str, Number]) -> Number:
    """Return a."""
    return (p["mu_s"] - p["tan_alpha"]) * cosine(p["tan_alpha"])


def _excess(p: Mapping[str, Number]) -> Number:
    """Return D."""
    return (p["mu_s"] - p["mu_d"]) * cosine(p["tan_alpha"])


def _over_root_two(value: Number) -> Number:
    two = value * 0 + 2
    return value / (_square_root(two) if not isinstance(two, Fraction) else math.sqrt(2))


def _root_pi(p: Mapping[str, Number]) -> Number:
    like = next((value for value in p.values() if _is_mpf(value)), 0.0)
    return _square_root(_pi(like))


def _exact_staircase(p: Mapping[str, Number]) -> Number:
    _no_disorder(p)
    return staircase_two_sliders(**{name: p[name] for name in _TWO_CYCLES})


def _exact_threshold(p: Mapping[str, Number]) -> Number:
    _no_disorder(p)
    return _a(p) / p["l0"]


def _sliding_cycles(p: Mapping[str, Number]) -> Number:
    return _steps(p) * _positive_part(p["l0"] * p["amplitude"] - p["n"] * _m(p) / 2)


def _sliding_gaussian(p: Mapping[str, Number], n: Number, steps: Number) -> Number:
    width = p["l0"] * p["sigma_theta"]
    return steps * width * gaussian_integral(n * _m(p) / (2 * width))


_STAIRCASE = Form(
    "2D max(0, ceil((L - a)/(2D))): sigma_mu = 0, from the relaxed chain",
    _TWO_CYCLES,
    _two(_exact_staircase),
    ("n", "sigma_mu"),
)
_PHASE_AVERAGE = Form(
    "max(0, l0 A - m): the mean over the phases r0 of the staircase",
    ("l0", "mu_d", "tan_alpha", "amplitude"),
    _two(lambda p: _positive_part(p["l0"] * p["amplitude"] - _m(p))),
    ("n",),
)
_GAUSSIAN_TWO = Form(
    "l0 sigma I(h), h = m/(l0 sigma): sliding limit, and the mean over phases",
    ("l0", "mu_d", "tan_alpha", "sigma_theta"),
    _two(lambda p: _sliding_gaussian(p, 2, 1)),
    ("n",),
)
_GAUSSIAN_TWO_SERIES = Form(
    "l0 sigma/sqrt(pi) - (2/3) m: first two terms of l0 sigma I(h)",
    ("l0", "mu_d", "tan_alpha", "sigma_theta"),
    _two(lambda p: p["l0"] * p["sigma_theta"] / _root_pi(p) - 2 * _m(p) / 3),
    ("n",),
)
_CHAIN_CYCLES = ("n", "l0", "mu_d", "tan_alpha", "amplitude")
_SLIDING = Form(
    "(N+3-2i) max(0, l0 A - N m/2): exact in the sliding limit mu_s -> mu_d",
    _CHAIN_CYCLES,
    _sliding_cycles,
    ("i",),
)
_CHAIN_GAUSSIAN = ("n", "l0", "mu_d", "tan_alpha", "sigma_theta")
_GAUSSIAN_CHAIN = Form(
    "(N+3-2i) l0 sigma I(h), h = N m/(2 l0 sigma): exact in the sliding limit",
    _CHAIN_GAUSSIAN,
    lambda p: _sliding_gaussian(p, p["n"], _steps(p)),
    ("i",),
)

_ALL = (
    Law(
        "alpha_c",
        "tan(alpha_c) = mu_d",
        r"\tan\alpha_\mathrm{c} = \mu_\mathrm{d}",
        _SLOPE,
        "Sec. Two sliders, numerical results (inline)",
        "derivations/runaway.py, critical slope",
        "exact",
        Form("mu_d", ("mu_d",), lambda p: p["mu_d"]),
    ),
    Law(
        "alpha_c_minus",
        "tan(alpha_c^-) = sigma_mu/sqrt(2)",
        r"\tan\alpha_\mathrm{c}^- = \sigma_\mu/\sqrt{2}",
        _SLOPE,
        "Sec. Two sliders, analysis (inline)",
        "derivations/two_sliders.py, lower end of the plateau",
        "approximation",
        Form("sigma_mu/sqrt(2)", ("sigma_mu",), lambda p: _over_root_two(p["sigma_mu"])),
    ),
    Law(
        "alpha_c_plus",
        "tan(alpha_c^+) = mu_d - sigma_mu/sqrt(2)",
        r"\tan\alpha_\mathrm{c}^+ = \mu_\mathrm{d} - \sigma_\mu/\sqrt{2}",
        _SLOPE,
        "Sec. Two sliders, analysis (inline)",
        "derivations/two_sliders.py, upper end of the plateau",
        "approximation",
        Form(
            "mu_d - sigma_mu/sqrt(2)",
            ("mu_d", "sigma_mu"),
            lambda p: p["mu_d"] - _over_root_two(p["sigma_mu"]),
        ),
    ),
    Law(
        "velocity_th_2_cycle",
        "tau_th <v_G> = l0 A",
        r"\tau_\mathrm{th}\langle v_G\rangle \simeq l_0 A_\theta",
        _VELOCITY,
        "Sec. Two sliders, Eq. (velocity_th_2_cycle)",
        "derivations/two_sliders.py, plateau",
        "approximation",
        Form(
            "l0 A",
            ("l0", "amplitude"),
            _two(lambda p: p["l0"] * p["amplitude"]),
            ("n",),
        ),
        _PHASE_AVERAGE,
        _STAIRCASE,
    ),
    Law(
        "velocity_th_2_gaussian",
        "tau_th <v_G> = l0 sigma_theta/sqrt(pi)",
        r"\tau_\mathrm{th}\langle v_G\rangle \approx l_0 \sigma_\theta/\sqrt{\pi}",
        _VELOCITY,
        "Sec. Two sliders, Eq. (velocity_th_2_gaussian)",
        "derivations/gaussian.py, free motion",
        "approximation",
        Form(
            "l0 sigma/sqrt(pi)",
            ("l0", "sigma_theta"),
            _two(lambda p: p["l0"] * p["sigma_theta"] / _root_pi(p)),
            ("n",),
        ),
        _GAUSSIAN_TWO_SERIES,
        _GAUSSIAN_TWO,
    ),
    Law(
        "velocity_th_2_cycle_corrected",
        "tau_th <v_G> = l0 A - (mu_s cos(alpha) - sin(alpha))",
        r"\tau_\mathrm{th}\langle v_G\rangle \simeq l_0 A_\theta"
        r" - (\overline{\mu}_\mathrm{s}\cos\alpha - \sin\alpha)",
        _VELOCITY,
        "Sec. Two sliders, Eq. (velocity_th_2_cycle_corrected)",
        "derivations/two_sliders.py, staircase and phase average",
        "inconsistent",
        Form(
            "l0 A - a",
            ("l0", "mu_s", "tan_alpha", "amplitude"),
            _two(lambda p: p["l0"] * p["amplitude"] - _a(p)),
            ("n",),
        ),
        _PHASE_AVERAGE,
        _STAIRCASE,
    ),
    Law(
        "threshold_th_2_cycle_corrected",
        "A* = (mu_s cos(alpha) - sin(alpha))/l0",
        r"A_\theta^* = (\overline{\mu}_\mathrm{s}\cos\alpha - \sin\alpha)/l_0",
        _AMPLITUDE,
        "Sec. Two sliders, Eq. (threshold_th_2_cycle_corrected)",
        "derivations/two_sliders.py, threshold",
        "exact",
        Form(
            "a/l0",
            ("l0", "mu_s", "tan_alpha"),
            _two(lambda p: _a(p) / p["l0"]),
            ("n",),
        ),
        None,
        Form(
            "a/l0: sigma_mu = 0, from the relaxed chain; (a - |r0|)/l0 from any other",
            ("l0", "mu_s", "tan_alpha"),
            _two(_exact_threshold),
            ("n", "sigma_mu"),
        ),
    ),
    Law(
        "velocity_th_2_gaussienne_corrected",
        "tau_th <v_G> = l0 sigma_theta/sqrt(pi) - (2/3) (mu_s cos(alpha) - sin(alpha))",
        r"\tau_\mathrm{th}\langle v_G\rangle \approx \frac{l_0}{\sqrt{\pi}}\sigma_\theta"
        r" - \frac{2}{3}(\overline{\mu}_\mathrm{s}\cos\alpha - \sin\alpha)",
        _VELOCITY,
        "Sec. Two sliders, Eq. (velocity_th_2_gaussienne_corrected)",
        "derivations/gaussian.py, two sliders",
        "inconsistent",
        Form(
            "l0 sigma/sqrt(pi) - (2/3) a",
            ("l0", "mu_s", "tan_alpha", "sigma_theta"),
            _two(lambda p: p["l0"] * p["sigma_theta"] / _root_pi(p) - 2 * _a(p) / 3),
            ("n",),
        ),
        _GAUSSIAN_TWO_SERIES,
        _GAUSSIAN_TWO,
    ),
    Law(
        "threshold_th_2_gaussienne_corrected",
        "sigma* = 2 sqrt(pi)/(3 l0) (mu_s cos(alpha) - sin(alpha))",
        r"\sigma_\theta^* = \frac{2\sqrt{\pi}}{3 l_0}"
        r"(\overline{\mu}_\mathrm{s}\cos\alpha - \sin\alpha)",
        _AMPLITUDE,
        "Sec. Two sliders, Eq. (threshold_th_2_gaussienne_corrected)",
        "derivations/gaussian.py, two sliders",
        "inconsistent",
        Form(
            "2 sqrt(pi)/(3 l0) a",
            ("l0", "mu_s", "tan_alpha"),
            _two(lambda p: 2 * _root_pi(p) * _a(p) / (3 * p["l0"])),
            ("n",),
        ),
        Form(
            "2 sqrt(pi)/(3 l0) m",
            ("l0", "mu_d", "tan_alpha"),
            _two(lambda p: 2 * _root_pi(p) * _m(p) / (3 * p["l0"])),
            ("n",),
        ),
    ),
    Law(
        "critical_angle",
        "tan(alpha*) = mu_d (1 - 2(i-1)/N) + (mu_s - mu_d)/N",
        r"\tan\alpha_{N,i}^* = \mu_\mathrm{d}\bigl[1 - 2\frac{i-1}{N}\bigr] + \frac{\Delta\mu}{N}",
        _SLOPE,
        "Sec. Large systems, Eq. (critical_angle)",
        "derivations/pivots.py, critical angle",
        "exact",
        Form(
            "mu_d (1 - 2(i-1)/N) + (mu_s - mu_d)/N",
            ("n", "i", "mu_d", "mu_s"),
            lambda p: (
                p["mu_d"] * (1 - 2 * (p["i"] - 1) / p["n"]) + (p["mu_s"] - p["mu_d"]) / p["n"]
            ),
        ),
    ),
    Law(
        "vitesse",
        "tau_th v* = (N+3-2i) l0 A",
        r"\tau_\mathrm{th} v_{N,i}^* = (N+3-2i)\,l_0 A_\theta",
        _VELOCITY,
        "Sec. Large systems, Eq. (vitesse)",
        "derivations/plateaus.py, plateau velocity",
        "approximation",
        Form(
            "(N+3-2i) l0 A",
            ("n", "l0", "amplitude"),
            lambda p: _steps(_with_index(p)) * p["l0"] * p["amplitude"],
            ("mu_d", "tan_alpha", "i"),
        ),
        None,
        _SLIDING,
    ),
    Law(
        "vitesse_random",
        "tau_th v* = (N+3-2i) l0 sigma_theta/sqrt(pi)",
        r"\tau_\mathrm{th} v_{N,i}^* = (N+3-2i)\,l_0\sigma_\theta/\sqrt{\pi}",
        _VELOCITY,
        "Sec. Large systems, after Eq. (vitesse) (inline)",
        "derivations/gaussian.py, free motion",
        "approximation",
        Form(
            "(N+3-2i) l0 sigma/sqrt(pi)",
            ("n", "l0", "sigma_theta"),
            lambda p: _steps(_with_index(p)) * p["l0"] * p["sigma_theta"] / _root_pi(p),
            ("mu_d", "tan_alpha", "i"),
        ),
        None,
        _GAUSSIAN_CHAIN,
    ),
    Law(
        "forcestatique",
        "f_(i-1 -> i) = [N - (i-1)] (mu_d cos(alpha) - sin(alpha))",
        r"f_{i-1\to i} + [N-(i-1)](\sin\alpha - \mu_\mathrm{d}\cos\alpha) = 0",
        "force, in m g",
        "Sec. Large systems, Eq. (forcestatique)",
        "derivations/thresholds.py, end of a dilation",
        "exact",
        Form(
            "(N+1-i) m",
            ("n", "i", "mu_d", "tan_alpha"),
            lambda p: (p["n"] + 1 - p["i"]) * _m(p),
        ),
    ),
    Law(
        "seuil",
        "A* = N/(2 l0) (mu_d cos(alpha) - sin(alpha))",
        r"A_\theta^* = \frac{N}{2 l_0}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)",
        _AMPLITUDE,
        "Sec. Large systems, Eq. (seuil)",
        "derivations/thresholds.py, threshold",
        "approximation",
        Form(
            "N m/(2 l0)",
            ("n", "l0", "mu_d", "tan_alpha"),
            lambda p: p["n"] * _m(p) / (2 * p["l0"]),
        ),
        Form(
            "(N m + D)/(2 l0): the whole chain is set in motion",
            ("n", "l0", "mu_d", "mu_s", "tan_alpha"),
            lambda p: (p["n"] * _m(p) + _excess(p)) / (2 * p["l0"]),
        ),
    ),
    Law(
        "vitesse_seuil",
        "tau_th v* = (N+3-2i) l0 [A - N/(2 l0) (mu_d cos(alpha) - sin(alpha))]",
        r"\tau_\mathrm{th} v_{N,i}^* = (N+3-2i)\,l_0\Bigl[A_\theta"
        r" - \frac{N}{2 l_0}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)\Bigr]",
        _VELOCITY,
        "Sec. Large systems, Eq. (vitesse_seuil)",
        "derivations/sliding_limit.py, cycles",
        "exact",
        Form(
            "(N+3-2i) (l0 A - N m/2)",
            _CHAIN_CYCLES,
            lambda p: _steps(p) * (p["l0"] * p["amplitude"] - p["n"] * _m(p) / 2),
            ("i",),
        ),
        _SLIDING,
        _SLIDING,
    ),
    Law(
        "sigma_theta_star",
        "sigma* = (2/3) sqrt(pi) A*",
        r"\sigma_\theta^* = \frac{2}{3}\sqrt{\pi} A_\theta^*",
        _AMPLITUDE,
        "Sec. Large systems, before Eq. (vitesse_seuil_random) (inline)",
        "derivations/gaussian.py, chains",
        "exact",
        Form(
            "(2/3) sqrt(pi) N m/(2 l0)",
            ("n", "l0", "mu_d", "tan_alpha"),
            lambda p: _root_pi(p) * p["n"] * _m(p) / (3 * p["l0"]),
        ),
    ),
    Law(
        "vitesse_seuil_random",
        "tau_th v* = (N+3-2i) l0 [sigma_theta/sqrt(pi) - N/(3 l0) (mu_d cos(alpha) - sin(alpha))]",
        r"\tau_\mathrm{th} v_{N,i}^* = (N+3-2i)\,l_0\Bigl[\frac{\sigma_\theta}{\sqrt{\pi}}"
        r" - \frac{N}{3 l_0}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)\Bigr]",
        _VELOCITY,
        "Sec. Large systems, Eq. (vitesse_seuil_random)",
        "derivations/gaussian.py, chains",
        "approximation",
        Form(
            "(N+3-2i) (l0 sigma/sqrt(pi) - N m/3)",
            _CHAIN_GAUSSIAN,
            lambda p: _steps(p) * (p["l0"] * p["sigma_theta"] / _root_pi(p) - p["n"] * _m(p) / 3),
            ("i",),
        ),
        None,
        _GAUSSIAN_CHAIN,
    ),
    Law(
        "vitessecontinue",
        "tau_th v_G = L tan(alpha)/mu_d [A - g rho L/(2 Y) (mu_d cos(alpha) - sin(alpha))]",
        r"\tau_\mathrm{th} v_G = L\frac{\tan\alpha}{\mu_\mathrm{d}}\Bigl[A_\theta"
        r" - \frac{g\rho L}{2Y}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)\Bigr]",
        _VELOCITY,
        "Sec. Discussion, Eq. (vitessecontinue)",
        "derivations/continuum.py, solid",
        "approximation",
        Form(
            "N l0 (tan(alpha)/mu_d) [A - N m/(2 l0)], with L = N l0 and g rho L/Y = N/l0",
            _CHAIN_CYCLES,
            lambda p: (
                p["n"]
                * (p["tan_alpha"] / p["mu_d"])
                * (p["l0"] * p["amplitude"] - p["n"] * _m(p) / 2)
            ),
        ),
        None,
        _SLIDING,
    ),
    Law(
        "delta_T_star",
        "Delta T* = g rho L/(2 Y kappa) (mu_d cos(alpha) - sin(alpha))",
        r"\Delta T^* = \frac{g\rho L}{2Y\kappa}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)",
        "kelvin",
        "Sec. Discussion, after Eq. (vitessecontinue)",
        "derivations/continuum.py, solid",
        "approximation",
        Form(
            "N m/(2 l0 kappa), with g rho L/Y = N/l0",
            ("n", "l0", "mu_d", "tan_alpha", "kappa"),
            lambda p: p["n"] * _m(p) / (2 * p["l0"] * p["kappa"]),
        ),
        Form(
            "(N m + D)/(2 l0 kappa)",
            ("n", "l0", "mu_d", "mu_s", "tan_alpha", "kappa"),
            lambda p: (p["n"] * _m(p) + _excess(p)) / (2 * p["l0"] * p["kappa"]),
        ),
    ),
    Law(
        "largest_chain",
        "N* = 2 l0 A/(mu_d cos(alpha) - sin(alpha))",
        r"N^* = 2 l_0 A_\theta/(\mu_\mathrm{d}\cos\alpha - \sin\alpha)",
        "number of sliders above which cycles no longer make the chain creep",
        "Sec. Discussion, granular matter (inline)",
        "derivations/thresholds.py, largest chain",
        "approximation",
        Form(
            "2 l0 A/m",
            ("l0", "mu_d", "tan_alpha", "amplitude"),
            lambda p: 2 * p["l0"] * p["amplitude"] / _m(p),
        ),
        Form(
            "(2 l0 A - D)/m: the longest chain that is set in motion as a whole",
            ("l0", "mu_d", "mu_s", "tan_alpha", "amplitude"),
            lambda p: (2 * p["l0"] * p["amplitude"] - _excess(p)) / _m(p),
        ),
    ),
)


LAWS: Mapping[str, Law] = MappingProxyType({law.label: law for law in _ALL})
"""The laws of the paper by label."""


# --- edges of the fate ----------------------------------------------------------------------------


def at_rest_amplitude(l0: Number, tan_alpha: Number, coefficients: Sequence[Number]) -> Number:
    """Return the largest amplitude at which some state of a chain stays at rest through cycles.

    Parameters
    ----------
    l0, tan_alpha : number
        Natural length, slope (either sign).
    coefficients : sequence of number
        Effective static coefficients of sliders 1..N, N >= 2, kept since no slider slips.

    Returns
    -------
    number
        ``min(w_1, w_N, (w_1 + ... + w_N - N |s|)/2)/l0`` with ``w_n = coefficients[n - 1] c``;
        dimensionless.

    Raises
    ------
    ValueError
        If there are fewer than two sliders, or no state is at rest even without cycles.

    Notes
    -----
    Guarantee: exact; at this amplitude itself such a state exists.
    Derivation: ``derivations/shakedown.py``, at rest.
    """
    if len(coefficients) < 2:
        raise ValueError("coefficients must be those of two sliders or more: one has no spring")
    p = _coerced(
        {"l0": l0, "tan_alpha": tan_alpha} | {str(k): mu for k, mu in enumerate(coefficients)}
    )
    length, slope, *held = p.values()
    sum_bound = (sum(held) - len(held) * abs(slope)) / 2
    if sum_bound < 0:
        raise ValueError(f"no state is at rest at tan_alpha = {tan_alpha}: friction is too small")
    return min(held[0], held[-1], sum_bound) * cosine(slope) / length


def _many(n: Number, least: int) -> int:
    count = int(n)
    if count != n or count < least:
        raise ValueError(f"n must be a whole number from {least} on, not {n}")
    return count


def _edge_at_rest(p: Mapping[str, Number]) -> Number:
    _no_disorder(p)

    def amplitude(n: Number, l0: Number, mu_s: Number, tan_alpha: Number) -> Number:
        return at_rest_amplitude(l0, tan_alpha, [mu_s] * _many(n, 2))

    return _elementwise(amplitude, *(p[name] for name in ("n", "l0", "mu_s", "tan_alpha")))


def _edge_of_lasting_creep(p: Mapping[str, Number]) -> Number:
    def amplitude(n: Number, l0: Number, mu_d: Number, tan_alpha: Number) -> Number:
        margin = _many(n, 2) * (mu_d - abs(tan_alpha)) / 2
        return _positive_part(min(mu_d, margin) * cosine(tan_alpha) / l0)

    return _elementwise(amplitude, *(p[name] for name in ("n", "l0", "mu_d", "tan_alpha")))


def _edge_of_locked_ends(p: Mapping[str, Number]) -> Number:
    _no_disorder(p)

    def amplitude(n: Number, l0: Number, mu_d: Number, mu_s: Number, tan_alpha: Number) -> Number:
        count = _many(n, 2)
        slope, friction, static = abs(_rational(tan_alpha)), _rational(mu_d), _rational(mu_s)
        if static < friction:
            raise ValueError(f"mu_s must not be below mu_d, not {mu_s} below {mu_d}")
        if count == 3 and 3 * slope <= static:
            return math.inf
        if count <= 3 or count * (static - slope) <= 2 * static:
            return l0 * 0
        swings = static // (static - friction) if static > friction else None
        turning = 2 * mu_s if swings is None else mu_s + swings * (mu_s - mu_d)
        return min(n * (mu_s - abs(tan_alpha)) / 2, turning) * cosine(tan_alpha) / l0

    names = ("n", "l0", "mu_d", "mu_s", "tan_alpha")
    return _elementwise(amplitude, *(p[name] for name in names))


@dataclass(frozen=True)
class Edge:
    """An amplitude of dilation cycles between fates of a chain; a theorem beyond the paper.

    Attributes
    ----------
    label : str
    statement : str
        What holds below, above or at the amplitude, and for which chains.
    derivation : str
        File and part in ``derivations/``.
    form : Form
        The amplitude, dimensionless.
    """

    label: str
    statement: str
    derivation: str
    form: Form


EDGES: Mapping[str, Edge] = MappingProxyType(
    {
        edge.label: edge
        for edge in (
            Edge(
                "at_rest",
                "Up to this amplitude, and at it, some state stays at rest through all cycles; "
                "above it none does (sigma_mu = 0, n >= 2)",
                "derivations/shakedown.py, at rest",
                Form(
                    "min(mu_s c, N (mu_s c - |s|)/2)/l0",
                    ("n", "l0", "mu_s", "tan_alpha"),
                    _edge_at_rest,
                    ("sigma_mu",),
                ),
            ),
            Edge(
                "no_lasting_creep",
                "Below this amplitude no state creeps for ever, whatever the static coefficients "
                ">= mu_d of its contacts (any sigma_mu, n >= 2)",
                "derivations/shakedown.py, no lasting creep",
                Form(
                    "min(mu_d c, N (mu_d c - |s|)/2)/l0, not below 0",
                    ("n", "l0", "mu_d", "tan_alpha"),
                    _edge_of_lasting_creep,
                ),
            ),
            Edge(
                "locked_ends",
                "Up to this amplitude, and at it, there are locked cycles in which only sliders 1 "
                "and n slip; above it there are none (sigma_mu = 0; 0: none at any amplitude, "
                "infinite: at every amplitude from mu_s c/l0 on, n = 3). Other locked cycles may "
                "exist above it",
                "derivations/shakedown.py, ends",
                Form(
                    "min(N (mu_s c - |s|)/2, mu_s c + D floor(mu_s/(mu_s - mu_d)))/l0",
                    ("n", "l0", "mu_d", "mu_s", "tan_alpha"),
                    _edge_of_locked_ends,
                    ("sigma_mu",),
                ),
            ),
        )
    }
)
"""Theorems on the fate of a chain under cycles, by label."""


def edges(chain: Chain) -> dict[str, float]:
    """Return the amplitudes of `EDGES` of a chain, by label, without those that do not hold for it.

    Parameters
    ----------
    chain : Chain

    Returns
    -------
    dict of str to float
        Dimensionless amplitudes; under disorder `no_lasting_creep` alone, nothing for n = 1.
    """
    found = {}
    for label, edge in EDGES.items():
        try:
            (found[label],) = law_values(edge.form, chain.parameters())
        except ValueError:
            continue
    return found


# --- predictions ---------------------------------------------------------------------------------


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
    given = {name: parameters[name] for name in names}
    if bits is not None:
        context = MPContext()
        context.prec = bits
        given = {name: context.mpf(v.numerator) / v.denominator for name, v in given.items()}
    if "i" not in form.optional:
        return (float(form(**given)),)
    n, slope, friction = (parameters[name] for name in ("n", "tan_alpha", "mu_d"))
    if abs(slope) >= friction:
        return ()
    return tuple(float(form(**given, i=i)) for i in pivots(int(n), slope, friction))


@dataclass(frozen=True)
class Prediction:
    """The velocity that theory predicts, unit ``g tau_dyn**2`` per half-cycle or target.

    Attributes
    ----------
    label : str
        Of the paper's equation.
    printed : tuple of float
        What the equation gives as printed; two values where its plateau is not unique, none for a
        single slider or without dilations.
    sliding : tuple of float
        What the exact law of the sliding limit (mu_s -> mu_d) gives, in rising order.
    staircase : float or None
        The exact velocity of the chain itself where it is known: two sliders that start relaxed,
        sigma_mu = 0, under cycles.
    """

    label: str
    printed: tuple[float, ...]
    sliding: tuple[float, ...]
    staircase: float | None = None

    @property
    def values(self) -> tuple[float, ...]:
        """The best that theory has: the staircase, else the law of the sliding limit."""
        return self.sliding if self.staircase is None else (self.staircase,)


def prediction(
    chain: Chain, drive: Drive, start: State | None = None, bits: int | None = None
) -> Prediction | None:
    """Return what theory predicts for the mean velocity; None where it has no law.

    There is none for a path, and where the chain may run away. A chain on an incline of negative
    slope is the mirror image of one of positive slope.

    Parameters
    ----------
    chain : Chain
    drive : Drive
    start : State, optional
        Default: the relaxed chain, the only start whose staircase is known here.
    bits : int, optional
        As in `law_values`.
    """
    if isinstance(drive, Cycles):
        label, size = "vitesse_seuil", {"amplitude": drive.amplitude}
    elif isinstance(drive, GaussianSteps):
        label, size = "vitesse_seuil_random", {"sigma_theta": drive.sigma_theta}
    else:
        return None
    if chain.n == 1 and abs(chain.tan_alpha) <= chain.mu_d:
        return Prediction(label, (), (0.0,))
    if chain.may_run_away:
        return None
    if not all(size.values()):
        return Prediction(label, (), (0.0,))
    sign = -1 if chain.tan_alpha < 0 else 1
    described = (chain.mirrored() if sign < 0 else chain).parameters() | size

    def values(form: Form | None) -> tuple[float, ...]:  # without a negative zero
        return tuple(sign * value + 0.0 for value in law_values(form, described, bits))

    law, staircase = LAWS[label], None
    relaxed = start is None and isinstance(drive, Cycles)
    if relaxed and chain.n == 2 and chain.sigma_mu == 0 and chain.tan_alpha != 0:
        (staircase,) = values(LAWS["velocity_th_2_cycle_corrected"].exact)
    sliding = tuple(sorted(set(values(law.exact))))
    return Prediction(label, values(law.printed), sliding, staircase)
