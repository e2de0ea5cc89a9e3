"""From jumps to steady creep: the velocity near its onset, the lives of short chains, the rests of long ones."""

import csv

import matplotlib.pyplot as plt
import numpy as np
from pages import BOOK

DATA = BOOK / "pictures"
LONG, SHORT = {20: "o", 30: "s", 50: "D", 100: "^"}, {6: "v", 10: "<", 12: ">", 15: "p"}
COLORS = dict(zip((*LONG, *SHORT), ("C0", "C1", "C2", "C3", "0.75", "0.55", "0.35", "0"), strict=True))
EXCESS = "$x = (l_0 A_\\theta - N m/2)/D$"
D = 0.1 / (1 + 0.25**2) ** 0.5  # (mu_s - mu_d) cos(alpha); tan(alpha) = 0.25, mu_d = 0.5


def table(name):
    """Return the rows of a file of the map."""
    with (DATA / name).open() as file:
        return list(csv.DictReader(file))


def points(n, groups=("small", "thirty", "fifty", "hundred", "further")):
    """Return x, the velocity in units of N (tan/mu_d) D, and its error, of a chain without disorder."""
    rows = [row for row in table("transition.csv") if int(row["n"]) == n and row["group"] in groups]
    kept = [[float(row[name]) / unit for name, unit in columns(n)] for row in rows]
    return np.array(sorted(kept)).reshape(-1, 3).T  # by x: lines join neighbours


def columns(n):
    return (("x", 1), ("velocity", n * D / 2), ("velocity_error", n * D / 2))


def velocity():
    """Draw the velocity over the excess of the dilation: long chains on one curve, short ones cut off."""
    figure, (linear, logarithmic) = plt.subplots(1, 2, figsize=(7.5, 3.9), layout="constrained")
    x = np.linspace(0, 9, 200)
    for axes in (linear, logarithmic):
        axes.plot(x, x, "k--", lw=1, label="Eq. 23, long chains: y = x")
    for n, mark in (LONG | SHORT).items():
        x, y, error = points(n)
        for axes in (linear, logarithmic) if n in LONG else (linear,):
            face = {} if n in LONG else {"mfc": "none"}
            kept = np.ones(len(x), bool) if axes is linear else y > 2 * error
            axes.errorbar(
                x[kept], y[kept], error[kept], fmt=mark, ms=5, lw=1,
                ls="none" if n == 100 else ":",  # few points, far apart
                color=COLORS[n], label=f"N = {n}", **face,
            )  # fmt: skip
    name = "$y = v\\,/\\,(N D \\tan\\alpha/\\mu_\\mathrm{d})$"
    linear.set(xlabel=EXCESS, ylabel=name, xlim=(-1.5, 4.2), ylim=(-0.15, 4.5))
    logarithmic.set(xlabel=EXCESS, yscale="log", xlim=(-1.5, 4.2), ylim=(1e-3, 6), title="long chains")
    linear.legend(frameon=False, fontsize=8)


def lives():
    """Draw how long short chains creep before they are locked, forty starts over 4000 cycles each."""
    figure, axes = plt.subplots(figsize=(7.5, 3.4), layout="constrained")
    rows = table("transition-lives.csv")
    for index, n in enumerate(sorted({int(row["n"]) for row in rows})):
        own = sorted((float(row["e"]), int(row["locked"]), int(row["cycles_lived"])) for row in rows if int(row["n"]) == n)
        e, locked, lived = np.array(own, float).T
        mean = lived / np.maximum(locked, 1)
        axes.semilogy(e, mean, "-", lw=0.8, color=f"C{index}")
        ends = locked > 0
        error = mean[ends] / np.sqrt(locked[ends])
        axes.errorbar(e[ends], mean[ends], error, fmt="o", ms=5, color=f"C{index}", label=f"N = {n}")
        axes.plot(e[~ends], mean[~ends], "^", mfc="none", ms=7, color=f"C{index}")
    axes.set(xlabel="$e = A_\\theta/A_c - 1$", ylabel="mean life (cycles)")
    axes.plot([], [], "k^", mfc="none", ms=7, label="none of 40 locked")
    axes.legend(frameon=False, ncols=2)


def rests():
    """Draw how many rests are longer than so many cycles, near x = 1/2."""
    figure, axes = plt.subplots(figsize=(7.5, 3.6), layout="constrained")
    rows = [row for row in table("transition-waits.csv") if float(row["e"]) == 0]
    for index, n in enumerate((20, 30, 50)):
        own = sorted((int(row["wait"]), int(row["count"])) for row in rows if int(row["n"]) == n)
        total = {}
        for wait, count in own:
            if wait > 1:
                total[wait] = total.get(wait, 0) + count
        wait, count = np.array(list(total)), np.array(list(total.values()))
        mean = (wait * count).sum() / count.sum()
        share = 1 - np.concatenate([[0], np.cumsum(count)[:-1]]) / count.sum()
        axes.loglog(wait / mean, share, drawstyle="steps-post", color=f"C{index}", label=f"N = {n}, mean {mean:.1f} cycles")
    time = np.geomspace(0.15, 60, 200)
    axes.loglog(time, np.exp(-time), "k--", lw=1, label="exponential")
    axes.loglog(time, 0.25 * time**-0.5, "k:", lw=1, label="power law, exponent 3/2")
    axes.loglog(time[80:], 0.2 / time[80:], "k-.", lw=1, label="power law, exponent 2")
    axes.set(xlabel="rest, over its mean", ylabel="share of longer ones", xlim=(0.15, 60), ylim=(2e-4, 1.2))
    axes.legend(frameon=False, loc="lower left")
