"""The laws of theory: the formulas of the paper, their corrections, and the exact laws behind them.

Every law is a function of the numbers that describe a chain and its drive, by name::

    >>> from exactcreep import laws
    >>> laws.critical_angle(n=7, i=3, mu_d=Fraction(1, 2), mu_s=Fraction(3, 5))
    Fraction(8, 35)

The result has the type of the arguments: rationals (``int``, ``Fraction``) give rationals where the
result is rational, floats give floats, arrays broadcast to float64 arrays, mpmath numbers give
mpmath numbers of their context. On which side of a boundary an argument lies is always decided
exactly. `exactcreep.laws.paper` has the units and symbols, ``derivations/ledger.toml`` the proofs.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
