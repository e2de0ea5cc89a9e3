"""What theory predicts: the paper's formulas, their corrections and the exact laws behind them.

``LAWS[label]`` is the law of the paper's equation ``label`` (formulas without a label have a name
of their own). Each law has a ``printed`` form, and a ``corrected`` and an ``exact`` form where they
exist (``None`` where they do not)::

    >>> from fractions import Fraction
    >>> LAWS["seuil"].printed(n=30, l0=1000, mu_d=Fraction(1, 2), tan_alpha=Fraction(7, 24))
    Fraction(3, 1000)

``EDGES[label]`` is a theorem beyond the paper: an amplitude of cycles between two fates of a chain.

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

from exactcreep.laws.closed_forms import gaussian_integral, staircase_two_sliders
from exactcreep.laws.forms import VOCABULARY, Form, Law, law_values
from exactcreep.laws.operands import cosine
from exactcreep.laws.paper import LAWS, critical_amplitude
from exactcreep.laws.plateaus import PivotWindow, pivot, pivot_window, pivots
from exactcreep.laws.theorems import EDGES, Theorem, at_rest_amplitude, edges
from exactcreep.laws.velocities import Prediction, prediction

__all__ = [
    "EDGES",
    "LAWS",
    "VOCABULARY",
    "Form",
    "Law",
    "PivotWindow",
    "Prediction",
    "Theorem",
    "at_rest_amplitude",
    "cosine",
    "critical_amplitude",
    "edges",
    "gaussian_integral",
    "law_values",
    "pivot",
    "pivot_window",
    "pivots",
    "prediction",
    "staircase_two_sliders",
]
