"""Steps of guaranteed length up to the first root of a sum of cosines."""

import matplotlib.pyplot as plt
import numpy as np

AMPLITUDES, RATES, PHASES, CONSTANT = np.array([0.75, 0.35]), np.array([1.0, 2.6]), np.array([0.1, 2.2]), 0.45
curvature = np.sum(AMPLITUDES * RATES**2)


def value(t):
    return CONSTANT + np.cos(np.multiply.outer(t, RATES) + PHASES) @ AMPLITUDES


def slope(t):
    return -np.sin(np.multiply.outer(t, RATES) + PHASES) @ (AMPLITUDES * RATES)


figure, axes = plt.subplots(figsize=(7.5, 3.4), layout="constrained")
times = np.linspace(0, 4, 600)
axes.plot(times, value(times), color="#2b7bba", label="f(t)")
axes.axhline(0, color="0.3", lw=1)
t, name = 0.0, "bound from below, f cannot cross it"
for _ in range(40):
    f, g = value(t), slope(t)
    step = (g + np.sqrt(g * g + 2 * curvature * f)) / curvature  # where f + g s - curvature s^2/2 vanishes
    s = np.linspace(0, step, 60)
    axes.plot(t + s, f + g * s - curvature * s * s / 2, color="#d95f0e", lw=1.2, label=name)
    axes.plot([t], [f], "o", color="#d95f0e", ms=3)
    t, name = t + step, None
    if f < 1e-6:
        break
axes.plot([t], [0], "k*", ms=10, label="first root: the next event")
axes.set(xlabel=r"time $t/\tau_\mathrm{dyn}$", ylabel="distance to the event", xlim=(0, 4))
axes.legend(frameon=False)
