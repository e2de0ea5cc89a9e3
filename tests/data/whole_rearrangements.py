"""Read `whole_rearrangements.npz`: rearrangements that SciPy's DOP853 integrated independently.

Every case is a chain at rest with a direction of the ramp, and what the integration came to, at a
relative tolerance of 1e-13. The rest states are random ones, or come from runs of velocity Verlet.
Tensions wrong by 1e-13 move no outcome by more than 1e-9. The power series of
`tests.oracle.rearrangement` reproduce all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exactcreep.model.chain import Chain
from exactcreep.model.keyed_disorder import static_coefficient
from exactcreep.model.state import State
from tests.oracle.rearrangement import Trajectory

FILE = Path(__file__).with_name("whole_rearrangements.npz")


@dataclass(frozen=True)
class Case:
    """A chain at rest, about to be ramped."""

    label: str
    n: int
    friction: tuple[str, str, str]  # mu_d, mu_s, sigma_mu
    tan_alpha: str
    seed: int
    direction: int
    tensions: np.ndarray
    draws: np.ndarray

    @property
    def chain(self) -> Chain:
        """The chain."""
        mu_d, mu_s, sigma_mu = self.friction
        return Chain(self.n, 1000, mu_d, mu_s, sigma_mu, tan_alpha=self.tan_alpha)

    @property
    def state(self) -> State:
        """The chain at rest at theta = 0."""
        drawn = [
            float(static_coefficient(self.chain, self.seed, i, int(k) - 1))
            for i, k in enumerate(self.draws, 1)
        ]
        return State(self.tensions, np.zeros(self.n), np.array(drawn), self.draws, 0.0)


def load() -> tuple[list[Case], list[Trajectory]]:
    """Return the stored cases and results."""
    with np.load(FILE) as file:
        data = dict(file)
    ends = {"sliders": data["n"], "springs": data["n"] - 1, "events": data["events"]}

    def parts(name: str, of: str) -> list[np.ndarray]:
        return np.split(data[name], np.cumsum(ends[of])[:-1])

    about = [data[name].tolist() for name in ("label", "n", "friction", "tan_alpha", "seed")]
    starts = data["direction"].tolist(), parts("tensions", "springs"), parts("draws", "sliders")
    cases = [
        Case(label, n, tuple(friction), *more, draws.astype(np.int64))
        for label, n, friction, *more, draws in zip(*about, *starts, strict=True)
    ]
    rows = [parts(name, "events") for name in ("stop", "slider", "sign")]
    itineraries = [
        [("stop" if stop else "start", (who,), (way,)) for stop, who, way in zip(*of, strict=True)]
        for of in zip(*([part.tolist() for part in row] for row in rows), strict=True)
    ]
    times = [part.tolist() for part in parts("time", "events")]
    names = {"displacements": "sliders", "final_tensions": "springs", "final_draws": "sliders"}
    ended = [parts(name, of) for name, of in names.items()]
    return cases, [Trajectory(*each) for each in zip(data["ramp"], times, itineraries, *ended,
                                                     strict=True)]  # fmt: skip
