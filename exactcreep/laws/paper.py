"""The formulas of the paper, each as printed, as corrected, and as the exact law behind it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from exactcreep.laws.closed_forms import gaussian_integral, staircase_two_sliders
from exactcreep.laws.forms import Form, Law, law_values
from exactcreep.laws.operands import Number, positive_part, root_of_pi, square_root

_VELOCITY = "tau_th <v_G>, in g tau_dyn**2 per half-cycle or target"
_AMPLITUDE = "dilation, dimensionless"
_SLOPE = "tan(alpha)"
_TWO = {"n": 2}
_CLEAN = {"n": 2, "sigma_mu": 0}


def _over_root_two(sigma_mu: Number) -> Number:
    return sigma_mu / square_root(sigma_mu * 0 + 2)


def _under_random_dilations(
    n: Number, steps: Number, m: Number, l0: Number, sigma_theta: Number
) -> Number:
    """Return the velocity of the sliding limit."""
    width = l0 * sigma_theta
    return steps * width * gaussian_integral(n * m / (2 * width))


_STAIRCASE = Form(
    "2D max(0, ceil((L - a)/(2D))): sigma_mu = 0, from the relaxed chain",
    staircase_two_sliders,
    _CLEAN,
)
_PHASE_AVERAGE = Form(
    "max(0, l0 A - m): the mean over the phases r0 of the staircase",
    lambda l0, amplitude, m: positive_part(l0 * amplitude - m),
    _TWO,
)
_GAUSSIAN_TWO = Form(
    "l0 sigma I(h), h = m/(l0 sigma): sliding limit, and the mean over phases",
    lambda m, l0, sigma_theta: _under_random_dilations(2, 1, m, l0, sigma_theta),
    _TWO,
)
_GAUSSIAN_TWO_SERIES = Form(
    "l0 sigma/sqrt(pi) - (2/3) m: first two terms of l0 sigma I(h)",
    lambda l0, sigma_theta, m: l0 * sigma_theta / root_of_pi(m) - 2 * m / 3,
    _TWO,
)
_SLIDING = Form(
    "(N+3-2i) max(0, l0 A - N m/2): exact in the sliding limit mu_s -> mu_d",
    lambda steps, l0, amplitude, n, m: steps * positive_part(l0 * amplitude - n * m / 2),
)
_GAUSSIAN_CHAIN = Form(
    "(N+3-2i) l0 sigma I(h), h = N m/(2 l0 sigma): exact in the sliding limit",
    _under_random_dilations,
)

_ALL = (
    Law(
        "alpha_c",
        r"\tan\alpha_\mathrm{c} = \mu_\mathrm{d}",
        _SLOPE,
        "Sec. Two sliders, numerical results (inline)",
        "derivations/runaway.py, critical slope",
        "exact",
        Form("mu_d", lambda mu_d: mu_d),
    ),
    Law(
        "alpha_c_minus",
        r"\tan\alpha_\mathrm{c}^- = \sigma_\mu/\sqrt{2}",
        _SLOPE,
        "Sec. Two sliders, analysis (inline)",
        "derivations/two_sliders.py, lower end of the plateau",
        "approximation",
        Form("sigma_mu/sqrt(2)", _over_root_two),
    ),
    Law(
        "alpha_c_plus",
        r"\tan\alpha_\mathrm{c}^+ = \mu_\mathrm{d} - \sigma_\mu/\sqrt{2}",
        _SLOPE,
        "Sec. Two sliders, analysis (inline)",
        "derivations/two_sliders.py, upper end of the plateau",
        "approximation",
        Form("mu_d - sigma_mu/sqrt(2)", lambda mu_d, sigma_mu: mu_d - _over_root_two(sigma_mu)),
    ),
    Law(
        "velocity_th_2_cycle",
        r"\tau_\mathrm{th}\langle v_G\rangle \simeq l_0 A_\theta",
        _VELOCITY,
        "Sec. Two sliders, Eq. (velocity_th_2_cycle)",
        "derivations/two_sliders.py, plateau",
        "approximation",
        Form("l0 A", lambda l0, amplitude: l0 * amplitude, _TWO),
        _PHASE_AVERAGE,
        _STAIRCASE,
    ),
    Law(
        "velocity_th_2_gaussian",
        r"\tau_\mathrm{th}\langle v_G\rangle \approx l_0 \sigma_\theta/\sqrt{\pi}",
        _VELOCITY,
        "Sec. Two sliders, Eq. (velocity_th_2_gaussian)",
        "derivations/gaussian.py, free motion",
        "approximation",
        Form("l0 sigma/sqrt(pi)", lambda l0, sigma_theta: l0 * sigma_theta / root_of_pi(l0), _TWO),
        _GAUSSIAN_TWO_SERIES,
        _GAUSSIAN_TWO,
    ),
    Law(
        "velocity_th_2_cycle_corrected",
        r"\tau_\mathrm{th}\langle v_G\rangle \simeq l_0 A_\theta"
        r" - (\overline{\mu}_\mathrm{s}\cos\alpha - \sin\alpha)",
        _VELOCITY,
        "Sec. Two sliders, Eq. (velocity_th_2_cycle_corrected)",
        "derivations/two_sliders.py, staircase and phase average",
        "inconsistent",
        Form("l0 A - a", lambda l0, amplitude, a: l0 * amplitude - a, _TWO),
        _PHASE_AVERAGE,
        _STAIRCASE,
    ),
    Law(
        "threshold_th_2_cycle_corrected",
        r"A_\theta^* = (\overline{\mu}_\mathrm{s}\cos\alpha - \sin\alpha)/l_0",
        _AMPLITUDE,
        "Sec. Two sliders, Eq. (threshold_th_2_cycle_corrected)",
        "derivations/two_sliders.py, threshold",
        "exact",
        Form("a/l0", lambda a, l0: a / l0, _TWO),
        None,
        Form(
            "a/l0: sigma_mu = 0, from the relaxed chain; (a - |r0|)/l0 from any other",
            lambda a, l0: a / l0,
            _CLEAN,
        ),
    ),
    Law(
        "velocity_th_2_gaussienne_corrected",
        r"\tau_\mathrm{th}\langle v_G\rangle \approx \frac{l_0}{\sqrt{\pi}}\sigma_\theta"
        r" - \frac{2}{3}(\overline{\mu}_\mathrm{s}\cos\alpha - \sin\alpha)",
        _VELOCITY,
        "Sec. Two sliders, Eq. (velocity_th_2_gaussienne_corrected)",
        "derivations/gaussian.py, two sliders",
        "inconsistent",
        Form(
            "l0 sigma/sqrt(pi) - (2/3) a",
            lambda l0, sigma_theta, a: l0 * sigma_theta / root_of_pi(l0) - 2 * a / 3,
            _TWO,
        ),
        _GAUSSIAN_TWO_SERIES,
        _GAUSSIAN_TWO,
    ),
    Law(
        "threshold_th_2_gaussienne_corrected",
        r"\sigma_\theta^* = \frac{2\sqrt{\pi}}{3 l_0}"
        r"(\overline{\mu}_\mathrm{s}\cos\alpha - \sin\alpha)",
        _AMPLITUDE,
        "Sec. Two sliders, Eq. (threshold_th_2_gaussienne_corrected)",
        "derivations/gaussian.py, two sliders",
        "inconsistent",
        Form("2 sqrt(pi)/(3 l0) a", lambda a, l0: 2 * root_of_pi(l0) * a / (3 * l0), _TWO),
        Form("2 sqrt(pi)/(3 l0) m", lambda m, l0: 2 * root_of_pi(l0) * m / (3 * l0), _TWO),
    ),
    Law(
        "critical_angle",
        r"\tan\alpha_{N,i}^* = \mu_\mathrm{d}\bigl[1 - 2\frac{i-1}{N}\bigr] + \frac{\Delta\mu}{N}",
        _SLOPE,
        "Sec. Large systems, Eq. (critical_angle)",
        "derivations/pivots.py, critical angle",
        "exact",
        Form(
            "mu_d (1 - 2(i-1)/N) + (mu_s - mu_d)/N",
            lambda mu_d, mu_s, i, n: mu_d * (1 - 2 * (i - 1) / n) + (mu_s - mu_d) / n,
        ),
    ),
    Law(
        "vitesse",
        r"\tau_\mathrm{th} v_{N,i}^* = (N+3-2i)\,l_0 A_\theta",
        _VELOCITY,
        "Sec. Large systems, Eq. (vitesse)",
        "derivations/plateaus.py, plateau velocity",
        "approximation",
        Form("(N+3-2i) l0 A", lambda steps, l0, amplitude: steps * l0 * amplitude),
        None,
        _SLIDING,
    ),
    Law(
        "vitesse_random",
        r"\tau_\mathrm{th} v_{N,i}^* = (N+3-2i)\,l_0\sigma_\theta/\sqrt{\pi}",
        _VELOCITY,
        "Sec. Large systems, after Eq. (vitesse) (inline)",
        "derivations/gaussian.py, free motion",
        "approximation",
        Form(
            "(N+3-2i) l0 sigma/sqrt(pi)",
            lambda steps, l0, sigma_theta: steps * l0 * sigma_theta / root_of_pi(l0),
        ),
        None,
        _GAUSSIAN_CHAIN,
    ),
    Law(
        "forcestatique",
        r"f_{i-1\to i} + [N-(i-1)](\sin\alpha - \mu_\mathrm{d}\cos\alpha) = 0",
        "force, in m g",
        "Sec. Large systems, Eq. (forcestatique)",
        "derivations/thresholds.py, end of a dilation",
        "exact",
        Form("(N+1-i) m", lambda n, i, m: (n + 1 - i) * m),
    ),
    Law(
        "seuil",
        r"A_\theta^* = \frac{N}{2 l_0}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)",
        _AMPLITUDE,
        "Sec. Large systems, Eq. (seuil)",
        "derivations/thresholds.py, threshold",
        "approximation",
        Form("N m/(2 l0)", lambda n, m, l0: n * m / (2 * l0)),
        Form(
            "(N m + D)/(2 l0): the whole chain is set in motion",
            lambda n, m, D, l0: (n * m + D) / (2 * l0),
        ),
    ),
    Law(
        "vitesse_seuil",
        r"\tau_\mathrm{th} v_{N,i}^* = (N+3-2i)\,l_0\Bigl[A_\theta"
        r" - \frac{N}{2 l_0}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)\Bigr]",
        _VELOCITY,
        "Sec. Large systems, Eq. (vitesse_seuil)",
        "derivations/sliding_limit.py, cycles",
        "exact",
        Form(
            "(N+3-2i) (l0 A - N m/2)",
            lambda steps, l0, amplitude, n, m: steps * (l0 * amplitude - n * m / 2),
        ),
        _SLIDING,
        _SLIDING,
    ),
    Law(
        "sigma_theta_star",
        r"\sigma_\theta^* = \frac{2}{3}\sqrt{\pi} A_\theta^*",
        _AMPLITUDE,
        "Sec. Large systems, before Eq. (vitesse_seuil_random) (inline)",
        "derivations/gaussian.py, chains",
        "exact",
        Form("(2/3) sqrt(pi) N m/(2 l0)", lambda n, m, l0: root_of_pi(l0) * n * m / (3 * l0)),
    ),
    Law(
        "vitesse_seuil_random",
        r"\tau_\mathrm{th} v_{N,i}^* = (N+3-2i)\,l_0\Bigl[\frac{\sigma_\theta}{\sqrt{\pi}}"
        r" - \frac{N}{3 l_0}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)\Bigr]",
        _VELOCITY,
        "Sec. Large systems, Eq. (vitesse_seuil_random)",
        "derivations/gaussian.py, chains",
        "approximation",
        Form(
            "(N+3-2i) (l0 sigma/sqrt(pi) - N m/3)",
            lambda steps, l0, sigma_theta, n, m: (
                steps * (l0 * sigma_theta / root_of_pi(l0) - n * m / 3)
            ),
        ),
        None,
        _GAUSSIAN_CHAIN,
    ),
    Law(
        "vitessecontinue",
        r"\tau_\mathrm{th} v_G = L\frac{\tan\alpha}{\mu_\mathrm{d}}\Bigl[A_\theta"
        r" - \frac{g\rho L}{2Y}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)\Bigr]",
        _VELOCITY,
        "Sec. Discussion, Eq. (vitessecontinue)",
        "derivations/continuum.py, solid",
        "approximation",
        Form(
            "N l0 (tan(alpha)/mu_d) [A - N m/(2 l0)], with L = N l0 and g rho L/Y = N/l0",
            lambda n, tan_alpha, mu_d, l0, amplitude, m: (
                n * (tan_alpha / mu_d) * (l0 * amplitude - n * m / 2)
            ),
        ),
        None,
        _SLIDING,
    ),
    Law(
        "delta_T_star",
        r"\Delta T^* = \frac{g\rho L}{2Y\kappa}(\mu_\mathrm{d}\cos\alpha - \sin\alpha)",
        "kelvin",
        "Sec. Discussion, after Eq. (vitessecontinue)",
        "derivations/continuum.py, solid",
        "approximation",
        Form(
            "N m/(2 l0 kappa), with g rho L/Y = N/l0",
            lambda n, m, l0, kappa: n * m / (2 * l0 * kappa),
        ),
        Form("(N m + D)/(2 l0 kappa)", lambda n, m, D, l0, kappa: (n * m + D) / (2 * l0 * kappa)),
    ),
    Law(
        "largest_chain",
        r"N^* = 2 l_0 A_\theta/(\mu_\mathrm{d}\cos\alpha - \sin\alpha)",
        "number of sliders above which cycles no longer make the chain creep",
        "Sec. Discussion, granular matter (inline)",
        "derivations/thresholds.py, largest chain",
        "approximation",
        Form("2 l0 A/m", lambda l0, amplitude, m: 2 * l0 * amplitude / m),
        Form(
            "(2 l0 A - D)/m: the longest chain that is set in motion as a whole",
            lambda l0, amplitude, m, D: (2 * l0 * amplitude - D) / m,
        ),
    ),
)


LAWS: Mapping[str, Law] = MappingProxyType({law.label: law for law in _ALL})
"""The laws of the paper by label."""


def critical_amplitude(parameters: Mapping[str, Any]) -> float:
    """Return the critical amplitude A* of Eq. (seuil) for the parameters of a chain."""
    return law_values(LAWS["seuil"].printed, parameters)[0]
