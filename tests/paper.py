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


def unlike_chain(rng: Random, least: int = 40) -> Chain:
    """Return a chain that differs in friction, at its ends, in its dilations, or in all of them."""
    n, kinds = rng.randint(2, 7), rng.randint(1, 7)
    friction = [Fraction(rng.randint(least, 60), 100) for _ in range(n)]
    friction = friction if kinds & 1 else friction[:1] * n
    return Chain(
        n, 1000,
        mu_d=friction,
        mu_s=[mu + Fraction(rng.randint(2, 15) if kinds & 1 else 10, 100) for mu in friction],
        sigma_mu=Fraction(rng.choice((0, 5, 10)), 1000),
        tan_alpha=Fraction(rng.randint(-20, 25), 100),
        end_forces=[Fraction(rng.randint(-12, 12), 100) for _ in "12"] if kinds & 2 else (0, 0),
        expansion=[Fraction(rng.randint(30, 150), 100) for _ in range(n - 1)] if kinds & 4 else (),
    )  # fmt: skip


def event_rows(stretch: Stretch) -> list[tuple[int, ...]]:
    """Return number, kind, slider and sign of every event that was recorded, in order."""
    names = ("event_number", "event_kind", "event_slider", "event_sign")
    return list(zip(*(stretch.recorded[name].tolist() for name in names), strict=True))
