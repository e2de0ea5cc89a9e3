"""Make `whole_rearrangements.npz`: whole rearrangements, integrated independently.

Run from a checkout: ``python -m tests.data.make_whole_rearrangements``.

Every case is a chain at rest with a direction of the ramp, and what the independent integration of
`tests.oracle.rearrangement` says of it. The rest states are random static ones (the forces drawn
at random within the static condition, by the seed in the label), or come from a burned-in run
(velocity Verlet with located events, so that they owe nothing to the solver under test; they are
stored). A state is refused if the integration cannot decide its itinerary, or if tensions wrong by
1e-13 move the outcome by more than 1e-9: double precision promises nothing there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.keyed_disorder import static_coefficient
from exactcreep.model.state import State
from exactcreep.solvers.verlet.solver import Verlet
from tests.oracle.rearrangement import Trajectory, Undecided, integrate

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
        return State(
            tensions=self.tensions,
            displacements=np.zeros(self.n),
            coefficients=coefficients(self.chain, self.seed, self.draws),
            draws=self.draws,
            theta=0.0,
        )


def coefficients(chain: Chain, seed: int, draws: np.ndarray) -> np.ndarray:
    """Return the static coefficients that hold after so many draws."""
    return np.array(
        [float(static_coefficient(chain, seed, i + 1, int(k) - 1)) for i, k in enumerate(draws)]
    )


def random_rest(
    chain: Chain, seed: int, direction: int, primed: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return tensions and draws of a static chain whose forces are random.

    The forces on the `primed` sliders beside the end that starts are within a tenth of their
    thresholds; the others take up what the weight leaves.
    """
    n = chain.n
    draws = rng.integers(1, 40, n)
    thresholds = np.maximum(coefficients(chain, seed, draws), float(chain.mu_d)) * chain.cos_alpha
    beside = np.arange(n) if direction < 0 else np.arange(n)[::-1]
    forces = rng.uniform(-1.0, 1.0, n) * thresholds
    forces[beside[:primed]] = rng.uniform(0.9, 0.999, primed) * thresholds[beside[:primed]]
    free = beside[primed:] if primed < n else beside
    for _ in range(200):
        forces[free] += (n * chain.sin_alpha - forces.sum()) / free.size
        forces[free] = np.clip(forces[free], -0.999 * thresholds[free], 0.999 * thresholds[free])
    if abs(n * chain.sin_alpha - forces.sum()) > 1e-9:
        raise Undecided("no static state with so many primed sliders")
    return np.cumsum(forces - chain.sin_alpha)[:-1], draws


def trusted(case: Case) -> Trajectory:
    """Return the integration of a case that double precision can be held to, or `Undecided`."""
    found = integrate(case.chain, case.tensions, case.draws, case.direction, case.seed)
    rng = np.random.default_rng(1)
    for _ in range(2):
        tensions = case.tensions + 1e-13 * rng.uniform(-1.0, 1.0, case.n - 1)
        again = integrate(case.chain, tensions, case.draws, case.direction, case.seed)
        if again.itinerary != found.itinerary:
            raise Undecided("the itinerary depends on the last digits")
        if np.abs(again.displacements - found.displacements).max() > 1e-9:
            raise Undecided("the positions depend on the last digits")
    return found


def random_cases() -> list[Case]:
    """Return the cases from random static tensions."""
    plan = [
        # n, friction, tan_alpha, primed, how many
        (2, ("0.5", "0.6", "0.01"), "0.25", 0, 8),
        (2, ("0.5", "0.6", "0.01"), "0.49", 1, 8),
        (2, ("0.3", "0.5", "0"), "0.29", 1, 4),
        (3, ("0.5", "0.6", "0.01"), "0.25", 1, 10),
        (3, ("0.5", "0.6", "0.01"), "0.495", 2, 12),
        (3, ("0.5", "0.6", "0.06"), "0.4", 2, 10),
        (6, ("0.5", "0.6", "0.01"), "0.25", 2, 12),
        (6, ("0.5", "0.6", "0.01"), "0.48", 5, 16),
        (6, ("0.5", "0.6", "0.06"), "0.4", 4, 12),
        (6, ("0.2", "0.7", "0.05"), "0.1", 1, 8),
        (10, ("0.5", "0.6", "0.01"), "0.25", 4, 12),
        (10, ("0.5", "0.6", "0.01"), "0.485", 8, 16),
        (10, ("0.5", "0.6", "0.06"), "0.4", 6, 12),
        (10, ("0.5", "0.6", "0.01"), "0", 3, 6),
        (30, ("0.5", "0.6", "0.01"), "0.25", 10, 14),
        (30, ("0.5", "0.6", "0.01"), "0.4", 15, 14),
        (30, ("0.5", "0.6", "0.01"), "-0.25", 3, 6),
        (30, ("0.3", "0.35", "0.005"), "0.2", 12, 10),
    ]
    cases = []
    for row, (n, friction, tan_alpha, primed, count) in enumerate(plan):
        for k in range(count):
            rng = np.random.default_rng([row, k])
            direction = 1 if k % 2 == 0 else -1
            mu_d, mu_s, sigma_mu = friction
            chain = Chain(n, 1000, mu_d, mu_s, sigma_mu, tan_alpha=tan_alpha)
            seed = 1000 * row + k
            try:
                tensions, draws = random_rest(chain, seed, direction, primed, rng)
            except Undecided:
                continue
            label = f"random static [{row}, {k}]"
            cases.append(Case(label, n, friction, tan_alpha, seed, direction, tensions, draws))
    return cases


def burned_cases() -> list[Case]:
    """Return the cases from burned-in runs: every few rearrangements of two ramps."""
    plan = [
        # n, sigma_mu, tan_alpha, amplitude, half-cycles of burn-in, how many, one in
        (2, "0.01", "0.25", "0.01", 9, 10, 3),
        (3, "0.01", "0.25", "0.01", 9, 14, 3),
        (3, "0.01", "0.45", "0.01", 9, 10, 3),
        (6, "0.01", "0.25", "0.01", 9, 22, 5),
        (6, "0.01", "0.45", "0.01", 9, 14, 5),
        (10, "0.01", "0.25", "0.01", 9, 24, 7),
        (10, "0.01", "0.4", "0.01", 9, 18, 7),
        (30, "0.01", "0.25", "0.005", 21, 28, 11),
        (30, "0.01", "0.25", "0.01", 21, 20, 23),
    ]
    cases = []
    for row, (n, sigma_mu, tan_alpha, amplitude, burn_in, count, every) in enumerate(plan):
        friction = ("0.5", "0.6", sigma_mu)
        chain = Chain(n, 1000, *friction, tan_alpha=tan_alpha)
        seed = 77 + row
        solver = Verlet(dt=0.01, locate=True)
        simulation = solver.simulation(chain, State.relaxed(chain, seed), seed, ())
        simulation.follow(Cycles(amplitude, burn_in), 1, burn_in)
        state = simulation.state()
        for k in range(count * every):
            # one ramp down, then one up
            direction = -1 if (k // (count * every // 2 + 1)) % 2 == 0 else 1
            if k % every == every - 1:
                label = f"burned in [{row}, {k}]"
                rest = np.array(state.tensions), np.array(state.draws)
                cases.append(Case(label, n, friction, tan_alpha, seed, direction, *rest))
            state = solver.rearrange(chain, state, direction, seed).state
    return cases


def save(cases: list[Case], results: list[Trajectory]) -> None:
    """Write cases and results, end to end."""
    about = ("label", "n", "friction", "tan_alpha", "seed", "direction")
    events = [event for found in results for event in found.itinerary]
    np.savez_compressed(
        FILE,
        **{name: np.array([getattr(case, name) for case in cases]) for name in about},
        tensions=np.concatenate([case.tensions for case in cases]),
        draws=np.concatenate([case.draws for case in cases]),
        ramp=np.array([found.ramp for found in results]),
        displacements=np.concatenate([found.displacements for found in results]),
        final_tensions=np.concatenate([found.tensions for found in results]),
        final_draws=np.concatenate([found.draws for found in results]),
        events=np.array([len(found.times) for found in results]),
        time=np.concatenate([found.times for found in results]),
        stop=np.array([kind == "stop" for kind, _, _ in events]),
        slider=np.array([who[0] for _, who, _ in events]),
        sign=np.array([way[0] for _, _, way in events]),
    )


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


def main() -> None:
    """Make the file anew."""
    kept: list[Case] = []
    results: list[Trajectory] = []
    for case in random_cases() + burned_cases():
        try:
            results.append(trusted(case))
        except Undecided as reason:
            print(f"refused: {case.label}, n = {case.n}: {reason}")
        else:
            kept.append(case)
    save(kept, results)
    print(len(kept), "rearrangements of", sum(len(found.times) for found in results), "events")


if __name__ == "__main__":
    main()
