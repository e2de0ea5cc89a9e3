"""The chain of the paper's captions, and the order of events in a run."""

from __future__ import annotations

from exactcreep.model.chain import Chain
from exactcreep.solvers.solver import Stretch

PAPER = {"l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": "0.25"}


def paper_chain(n: int, sigma_mu: str = "0.01", **changed: object) -> Chain:
    """Return a chain as in the captions, with random static coefficients unless told otherwise."""
    return Chain(n=n, sigma_mu=sigma_mu, **(PAPER | changed))


def captions(n: int, sigma_mu: str = "0", **changed: object) -> Chain:
    """Return a chain as in the captions, without random coefficients unless told otherwise."""
    return paper_chain(n, sigma_mu, **changed)


def event_rows(stretch: Stretch) -> list[tuple[int, ...]]:
    """Return number, kind, slider and sign of every event that was recorded, in order."""
    names = ("event_number", "event_kind", "event_slider", "event_sign")
    return list(zip(*(stretch.recorded[name].tolist() for name in names), strict=True))
