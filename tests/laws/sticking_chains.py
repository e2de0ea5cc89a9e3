"""The random chains on which the law of sliders that stick and slip was fitted and judged.

``notebooks/pictures/sticking.csv`` has them, one row each; ``python -m tests.laws.sticking_chains``
runs them again with the solver `exact`, a quarter of an hour on one core. The chains were drawn
before any of them was run: N from 4 to 60; x = G/D from 2 to 100, half of them below 8; slopes up
to 0.85 mu_d, half of them near the end of a plateau; mu_s - mu_d from 0.03 to 2/3 of mu_d; sigma_mu
up to mu_s - mu_d. The law was fitted on two of three of the first 490, together with chains that
differ (`drawn_chains`). Its deviation was fitted on all.
"""

from __future__ import annotations

import warnings
from fractions import Fraction
from pathlib import Path
from typing import Any

from exactcreep.results import PhysicsWarning
from tests.laws.drawn_chains import measured
from tests.laws.kept import Row, renew

FILE = Path(__file__).parents[2] / "notebooks" / "pictures" / "sticking.csv"
CHAIN = ("n", "mu_d", "mu_s", "sigma_mu", "tan_alpha")


def parameters(row: Row) -> dict[str, Any]:
    """Return a chain and its drive, by the names that laws use."""
    size = "sigma_theta" if row["kind"] == "random" else "amplitude"
    numbers = {name: Fraction(row[name]) for name in CHAIN}
    return numbers | {"n": int(row["n"]), "l0": 1000, size: Fraction(row["size"])}


def held_out(row: Row) -> bool:
    """Return whether a chain was left out of the fit of the law."""
    return int(row["number"]) % 3 == 2 or int(row["number"]) >= 490


def run(row: Row) -> dict[str, float]:
    """Return the velocity of a chain with its standard error."""
    found = measured(parameters(row) | {"end_forces": [0, 0]})
    return {name: found[name] for name in ("velocity", "error")}


if __name__ == "__main__":
    warnings.simplefilter("ignore", PhysicsWarning)  # draws below mu_d belong to the ranges
    renew(FILE, run)
