"""The model at its extremes: for each quantity experiments that take it to its end."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from exactcreep import Chain, Creep, Cycles, Drive, Experiment, Path, State
from exactcreep.model.enclosure import exact_value
from exactcreep.model.numbers import nearest_float
from exactcreep.quasistatic.creep import PhysicsWarning

SEED = 1
PAIR = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
START = State.prepared(PAIR, [Fraction(1, 32)])


def chain_of(n: int = 3, l0: Any = 1000, **changed: Any) -> Chain:
    usual: dict[str, Any] = {"mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01", "tan_alpha": "0.25"}
    return Chain(n, l0, **usual | changed)


def _cycles(chain: Chain, reach: Any, cycles: int = 1) -> Cycles:
    """Return cycles of the amplitude at which ``l0 A = reach``."""
    return Cycles(Fraction(reach) / chain.l0, cycles)


def hard_experiments() -> dict[str, Experiment]:
    """Return the experiments by what is extreme in them."""
    with warnings.catch_warnings(action="ignore", category=PhysicsWarning):
        return {
            name: Experiment(chain, drive, seed=SEED, start=State.relaxed(chain, SEED), record=())
            for name, chain, drive in _hard()
        }


def _hard() -> Iterator[tuple[str, Chain, Drive]]:
    for n, reach in ((2, "1.5"), (3, "1.5"), (30, "2"), (1000, "2")):
        chain = chain_of(n, sigma_mu=0 if n == 1000 else "0.01")
        yield f"N = {n}", chain, _cycles(chain, reach)
    for l0 in ("1e-6", "1", "1e6", "1e15"):
        chain = chain_of(3, l0)
        yield f"l0 = {l0}", chain, _cycles(chain, 2)
        chain = chain_of(2, l0)
        yield f"l0 A = 20, l0 = {l0}", chain, Path([Fraction(20) / chain.l0])
    yield "A = 2e-15", chain_of(3, "1e15"), Cycles("2e-15", 2)
    for gap in ("1e-12", "1e-9", "1e-6", "1e-3", "1", "10"):
        for n in (2, 3):
            chain = chain_of(n, mu_s=Fraction(1, 2) + Fraction(gap), sigma_mu=0)
            onset = Fraction(chain.times_cosine(chain.mu_s - chain.tan_alpha))
            theta = (onset + (6 * n + Fraction(1, 3)) * Fraction(chain.excess)) / chain.l0
            yield f"mu_s - mu_d = {gap}, N = {n}", chain, Path([theta, -theta])
    yield "mu_s = mu_d, sigma_mu = 0.01", chain_of(3, mu_s="0.5"), Path(["0.001"])
    for steep, sigma in (("0", "0"), ("0.05", "0.01")):
        chain = chain_of(2, mu_d=0, mu_s="0.1", sigma_mu=sigma, tan_alpha=steep)
        yield f"mu_d = 0, tan_alpha = {steep}", chain, _cycles(chain, "0.2")
    for sigma in ("0", "1e-12", "0.1", "0.3", "1", "10"):
        chain = chain_of(3, sigma_mu=sigma)
        yield f"sigma_mu = {sigma}", chain, _cycles(chain, 2)
    beside = {"mu_d - 1e-12": "-1e-12", "mu_d": "0", "mu_d + 0.05": "0.05"}
    slopes = {"0": Fraction(0), "1e-15": Fraction("1e-15")}
    slopes |= {name: Fraction(1, 2) + Fraction(off) for name, off in beside.items()}
    for name, slope in slopes.items():
        for sigma in ("0", "0.01"):
            chain = chain_of(2, sigma_mu=sigma, tan_alpha=slope)
            # near mu_d one avalanche is long enough
            drive = Path([Fraction("0.3") / chain.l0]) if name in beside else _cycles(chain, 1)
            yield f"tan_alpha = {name}, sigma_mu = {sigma}", chain, drive
    repeated = Path(["0.001", "0.001", "0.002", "0.002", "0.002", "-0.001", "-0.001", 0, 0])
    yield "repeated targets", chain_of(3), repeated
    for n in (3, 4, 6):
        chain = chain_of(n, sigma_mu=0, tan_alpha=0)
        yield f"tie by symmetry, N = {n}", chain, _cycles(chain, 1)
    chain = chain_of(3, sigma_mu=0, tan_alpha="0.2")
    yield "tie by numbers, tan_alpha = 1/5", chain, _cycles(chain, 1)
    chain = chain_of(4, 5, mu_d=1, mu_s="1.2", sigma_mu=0, tan_alpha="3/4")
    yield "tie by numbers, tan_alpha = 3/4", chain, _cycles(chain, 2)


def remainder_error(result: Creep) -> float:
    """Return how far ``r0 = (x_2 - x_1 - l0) mod 2D`` of two sliders is from where it began.

    In rational arithmetic, of the final tension and dilation.
    """
    chain, state, begin = result.chain, result.state, result.experiment.initial
    stretched = Fraction(float(state.tensions[0])) + chain.l0 * exact_value(state.theta)
    before = Fraction(begin.tensions[0]) + chain.l0 * exact_value(begin.theta)
    period = 2 * Fraction(chain.excess)
    left = (stretched - before) / period
    return nearest_float(abs(left - round(left)) * period)
