"""The chain of the paper's captions, and the order of events in a run."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from exactcreep.model.chain import Chain
from exactcreep.model.state import State
from exactcreep.solvers.interface import Stretch

PAPER = {"l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": "0.25"}


def paper_chain(n: int, sigma_mu: str = "0.01", **changed: object) -> Chain:
    """Return a chain as in the captions, with random static coefficients unless told otherwise."""
    return Chain(n=n, sigma_mu=sigma_mu, **(PAPER | changed))


def captions(n: int, sigma_mu: str = "0", **changed: object) -> Chain:
    """Return a chain as in the captions, without random coefficients unless told otherwise."""
    return paper_chain(n, sigma_mu, **changed)


def unstable_chain(rng: Random) -> tuple[Chain, State]:
    """Return a random chain, and a state drawn with seed 3 in which some of its sliders start."""
    mu_d = Fraction(rng.choice([1, 5, 20, 100, 300, 600]), 1000)
    mu_s = mu_d + Fraction(rng.choice([20, 100, 1000]), 1000)
    tangent = mu_d * Fraction(rng.randint(-9, 9), 10)
    n = rng.randint(2, 12)
    chain = Chain(n, 1, mu_d, mu_s, rng.choice(["0", "0.01"]), tan_alpha=tangent)
    unit = Fraction(chain.times_cosine(mu_s))
    tensions = [unit * Fraction(rng.randint(-150, 150), 100) for _ in range(n - 1)]
    return chain, State.prepared(chain, tensions, seed=3)


def event_rows(stretch: Stretch) -> list[tuple[int, ...]]:
    """Return number, kind, slider and sign of every event that was recorded, in order."""
    names = ("event_number", "event_kind", "event_slider", "event_sign")
    return list(zip(*(stretch.recorded[name].tolist() for name in names), strict=True))
