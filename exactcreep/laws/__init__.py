"""The laws of theory: the formulas of the paper, their corrections, and the exact laws behind them.

Every law is a function of the numbers that describe a chain and its drive, by name::

    >>> from exactcreep import laws
    >>> laws.critical_angle(n=7, i=3, mu_d=Fraction(1, 2), mu_s=Fraction(3, 5))
    Fraction(8, 35)

The result has the type of the arguments: rationals (``int``, ``Fraction``) give rationals where the
result is rational, floats give floats, arrays broadcast to float64 arrays, mpmath numbers give
mpmath numbers of their context. On which side of a boundary an argument lies is always decided
exactly. `exactcreep.laws.paper` has the symbols, ``derivations/ledger.toml`` the proofs.

Parameters
----------
n : int
    Number of sliders N.
i : int
    Index of the plateau: slider i - 1 rests in dilations. Default, if any: by the slope.
l0 : number
    Natural length of a spring, unit ``g tau_dyn**2``.
mu_d, mu_s : number
    Sliding and static friction coefficient; of sliders 1..N where a sequence is asked for.
sigma_mu : number
    Standard deviation of the static coefficients.
tan_alpha : number
    Slope.
amplitude : number
    Amplitude of the cycles of dilation.
sigma_theta : number
    Standard deviation of the random dilations.
r0 : number
    x_2 - x_1 - l0 at theta = 0, unit ``g tau_dyn**2``, conserved modulo 2D.
end_forces : pair of numbers
    Forces on slider 1 and on slider N, downhill positive, unit ``m g``.
coefficients : sequence of number
    Static coefficients of sliders 1..N, two or more.
expansion : sequence of number
    Weights of springs 1..N - 1, positive, by which the dilation is multiplied.
parameters : mapping of str to number
    A chain and its drive, by the names that laws use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
