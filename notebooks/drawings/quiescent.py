"""Quiescent periods of irregular creep, tested for an exponential distribution (two minutes).

``python notebooks/drawings/quiescent.py [FILE.png]``. Not drawn with the book, but kept in `pictures`.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

from exactcreep import creep, load_scene, quiescent
from exactcreep.figures.style import STYLE

JUMP = 1  # g tau_dyn^2 in a cycle; without a jump a cycle moves x_G by less than .7 either way
QUIET = 10  # cycles; shorter rests belong to one burst
SAMPLES = 999


def distance(rests):
    """Return the largest distance from the geometric distribution of the same mean."""
    ordered, k = np.sort(rests), np.arange(1, rests.max() + 1)
    law = 1 - (1 - 1 / rests.mean()) ** k
    return np.abs(np.searchsorted(ordered, k, side="right") / rests.size - law).max()


def test(rests, generator):
    """Return the distance, and its p-value: samples drawn have a mean of their own, as with Lilliefors."""
    observed, p = distance(rests), 1 / rests.mean()
    drawn = [distance(generator.geometric(p, rests.size)) for _ in range(SAMPLES)]
    return observed, (1 + sum(d >= observed for d in drawn)) / (SAMPLES + 1)


def main(file):
    """Run the scene, print the tests, and draw how many rests are longer than so many cycles."""
    runs = {}
    for member in load_scene("chain-waiting").members():
        asked = member.experiment
        run = creep(
            asked.chain, asked.drive, start=asked.start, seed=asked.seed, record=("x_G",), burn_in=0
        )
        runs.setdefault(asked.drive.amplitude, []).append(quiescent(run, JUMP).waiting)
    generator = np.random.default_rng(1)
    plt.rcParams.update(STYLE)
    figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
    for color, name, waits in zip(("C0", "C1"), ("0.99", "1.01"), runs.values(), strict=True):
        long = [wait[wait > QUIET] - QUIET for wait in waits]
        every = np.sort(np.concatenate(long))
        spread = every.std() / every.mean()
        kept = [rests for rests in long if rests.size >= 10]
        alone = sum(test(rests, generator)[1] < 0.05 for rests in kept)
        print(
            f"{name} A*: {every.size} rests, mean {every.mean():.1f} cycles, std/mean {spread:.2f}; "
            "distance {:.3f}, p = {:.3f}".format(*test(every, generator)),
            f"; {alone} of {len(kept)} starts refuse it alone",
        )
        share = np.arange(every.size, 0, -1) / every.size
        label = f"{name} $A^*$: {every.size} rests, standard deviation {spread:.2f} means"
        axes.semilogy(every / every.mean(), share, color=color, drawstyle="steps-post", label=label)
    time = np.linspace(0, 7, 50)
    axes.semilogy(time, np.exp(-time), "k--", label="exponential")
    axes.set(xlabel="quiescent period, over its mean", ylabel="share of longer ones", xlim=(0, 16), ylim=(1e-3, 1))
    axes.legend()
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "quiescent.png")
