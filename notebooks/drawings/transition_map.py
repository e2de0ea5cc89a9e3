"""Data of the notebook *From jumps to steady creep*: creep near its onset (an hour of two cores).

``python notebooks/drawings/transition_map.py FOLDER [GROUP ...]`` follows the starts that FOLDER does not hold
yet, one file for each, and can be stopped and called again; two processes need groups of their own. Without
groups it then writes ``transition.csv``, ``transition-rests.csv`` and ``transition-lives.csv`` into
``notebooks/pictures``.
"""

import csv
import sys
import warnings
from collections import Counter
from fractions import Fraction
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from exactcreep import Chain, Cycles, State, creep, laws, survival

PICTURES = Path(__file__).parents[1] / "pictures"
L0, MU_D, MU_S = 1000, Fraction(1, 2), Fraction(3, 5)
FEW = (-0.06, -0.03, -0.01, 0.01, 0.02, 0.04, 0.06, 0.08, 0.12, 0.16, 0.24, 0.32, 0.5)
MANY = (-0.12, -0.09, *FEW[:10])


class Group(NamedTuple):
    """Chains at amplitudes e = A/A_c - 1, each from so many starts over so many cycles."""

    lengths: tuple[int, ...]
    e: tuple[float, ...]
    starts: range
    cycles: int
    sigma: str = "0"
    tan: str = "0.25"


GROUPS = {
    "critical": [
        Group((20,), (0,), range(101, 141), 4000),
        Group((30,), (0,), range(101, 176), 4000),
        Group((50,), (0,), range(101, 141), 1500),
        Group((100,), (0,), range(101, 131), 800),
    ],
    "small": [Group((6, 8, 10, 12, 15, 20), FEW, range(1, 7), 4000)],
    "thirty": [Group((30,), MANY, range(1, 7), 2000)],
    "fifty": [Group((50,), MANY, range(1, 5), 1500)],
    "hundred": [Group((100,), (0.04, -0.06, 0.02, -0.03, 0.08, -0.09), range(1, 3), 800)],
    "disorder": [
        group
        for sigma in ("0.001", "0.01")
        for group in (
            Group((10,), (-0.06, -0.01, 0.01, 0.04, 0.08, 0.16, 0.32), range(1, 5), 4000, sigma),
            Group((30,), (-0.12, -0.06, -0.01, 0, 0.01, 0.04, 0.08, 0.16), range(1, 5), 1500, sigma),
        )
    ],
    "slope": [Group((30,), (-0.12, -0.06, -0.01, 0.01, 0.04, 0.08, 0.16), range(1, 4), 2000, "0", "0.2")],
}
HEAD = (
    "group", "n", "tan_alpha", "sigma_mu", "e", "amplitude", "x", "starts", "cycles", "still_at_the_end",
    "velocity", "velocity_error", "moving", "moving_error",
)  # fmt: skip
LIVES = {
    6: (0.2, 0.24, 0.28, 0.3),
    8: (0.12, 0.16, 0.18, 0.2, 0.22),
    10: (0.08, 0.12, 0.14, 0.16, 0.18, 0.2, 0.22, 0.24, 0.26, 0.28),
    12: (0.03, 0.04, 0.045, 0.05, 0.055, 0.056, 0.057, 0.058, 0.059, 0.06),
    15: (0.06, 0.08, 0.085, 0.09, 0.095, 0.1, 0.105, 0.11, 0.12),
}


def amplitude_of(n, e, tan="0.25"):
    """Return the amplitude (1 + e) A_c, A_c of Eq. 22 corrected, rounded to twelve digits."""
    onset = laws.onset_amplitude(n=n, l0=L0, mu_d=float(MU_D), mu_s=float(MU_S), tan_alpha=float(tan))
    return f"{onset * (1 + e):.12f}"


def chain_of(n, sigma="0", tan="0.25"):
    return Chain(n, L0, MU_D, MU_S, sigma, tan_alpha=tan)


def follow(n, e, k, cycles, sigma="0", tan="0.25"):
    """Return how far x_G advances in each cycle after the first tenth, from the start number k."""
    chain = chain_of(n, sigma, tan)
    start = State.perturbed(chain, "1e-6", start_seed=k, seed=k)
    run = creep(chain, Cycles(amplitude_of(n, e, tan), cycles), start=start, seed=k)
    return np.diff(run.recorded["x_G"][1::2], prepend=0.0)[-(-run.burn_in // 2) :]


def points(name):
    """Yield each group, length and amplitude of a name in `GROUPS`."""
    for group in GROUPS[name]:
        yield from ((group, n, e) for n in group.lengths for e in group.e)


def file_of(folder, group, n, e, k):
    return folder / f"n{n}_e{e}_k{k}_c{group.cycles}_s{group.sigma}_t{group.tan}.npy"


def compute(folder, names):
    """Follow what the folder does not hold, the first starts of all points before the second."""
    folder.mkdir(parents=True, exist_ok=True)
    every = [(k, group, n, e) for name in names for group, n, e in points(name) for k in group.starts]
    for k, group, n, e in sorted(every, key=itemgetter(0)):
        file = file_of(folder, group, n, e, k)
        if not file.exists():
            np.save(file, follow(n, e, k, group.cycles, group.sigma, group.tan))


def lives(folder):
    """Follow forty starts over 4000 cycles: how many were locked, after how many cycles in all."""
    file = folder / "lives.csv"
    done = set()
    if file.exists():
        done = {(int(row["n"]), float(row["e"])) for row in csv.DictReader(file.open())}
    else:
        file.write_text("n,e,starts,cycles,locked,cycles_lived\n")
    for n, e in ((n, e) for n, several in LIVES.items() for e in several):
        if (n, e) not in done:
            answer = survival(chain_of(n), amplitude_of(n, e), starts=40, cycles=4000, progress=False)
            with file.open("a") as out:
                out.write(f"{n},{e},40,4000,{answer.lifetimes.size},{answer.durations.sum()}\n")


def excess(chain, e):
    """Return x = (l0 A - N m/2)/D, by which the dilation exceeds what the middle slider bears."""
    bears = chain.n * (chain.friction - chain.sin_alpha)
    return ((1 + e) * (bears + chain.excess) - bears) / (2 * chain.excess)


def with_error(values, digits):
    """Return the mean over the starts, and its standard error, in so many digits."""
    error = values.std(ddof=1) / values.size**0.5
    return f"{values.mean():.{digits}f}", f"{error:.{digits}f}"


def rests_of(jumped):
    """Return the lengths of the rests between two jumps of a run, and of the rest at its end."""
    at = np.flatnonzero(jumped)
    between = np.diff(at) - 1
    return between[between > 0].tolist(), [jumped.size - 1 - at[-1]] if at.size else []


def collect(folder):
    """Write what the files of FOLDER come to, starts of a group pooled."""
    rows, rests = [], []
    for name, (group, n, e) in ((name, point) for name in GROUPS for point in points(name)):
        runs = [np.load(file_of(folder, group, n, e, k)) for k in group.starts]
        chain = chain_of(n, group.sigma, group.tan)
        jumped = [np.abs(run) > n * chain.excess / 4 for run in runs]
        still = sum(not np.any(each[-each.size // 10 :]) for each in jumped)
        rows.append([
            name, n, group.tan, group.sigma, e, amplitude_of(n, e, group.tan),
            round(excess(chain, e), 4), len(runs), group.cycles, still,
            *with_error(np.array([run.mean() / 2 for run in runs]), 6),
            *with_error(np.array([each.mean() for each in jumped]), 5),
        ])  # fmt: skip
        if name == "critical":
            for half in range(2):  # of the starts
                several = [rests_of(each) for each in jumped[half::2]]
                ended = Counter(rest for between, _ in several for rest in between)
                cut = Counter(rest for _, last in several for rest in last if rest)
                rests += [[n, half, rest, ended[rest], cut[rest]] for rest in sorted(ended | cut)]
    written("transition.csv", HEAD, rows)
    written("transition-rests.csv", ["n", "half", "rest", "ended", "cut"], rests)
    (PICTURES / "transition-lives.csv").write_text((folder / "lives.csv").read_text())


def written(name, head, rows):
    with (PICTURES / name).open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])


def main(folder, *groups):
    warnings.simplefilter("ignore")
    folder = Path(folder)
    compute(folder, [name for name in groups or GROUPS if name != "lives"])
    if not groups or "lives" in groups:
        lives(folder)
    if not groups:
        collect(folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
