"""Four sliders on an incline, and the forces on one of them."""

import matplotlib.pyplot as plt
import numpy as np

SLOPE = 0.25
along, across = np.array([1, -SLOPE]) / np.hypot(1, SLOPE), np.array([SLOPE, 1]) / np.hypot(1, SLOPE)
figure, axes = plt.subplots(figsize=(7.5, 3.2), layout="constrained")
ends = np.array([-1 * along, 8.4 * along])
axes.fill_between(ends[:, 0], ends[:, 1], -2.9, color="0.85", lw=0)
axes.plot(*ends.T, color="0.3")
for k in range(4):
    foot = (0.2 + 2.2 * k) * along
    corners = np.array([foot, foot + 0.8 * along, foot + 0.8 * along + 0.6 * across, foot + 0.6 * across])
    axes.add_patch(plt.Polygon(corners, color="#2b7bba" if k != 2 else "#d95f0e"))
    axes.text(*(foot + 0.4 * along + 0.3 * across), str(k + 1), color="w", ha="center", va="center")
    if k < 3:
        s = np.linspace(0, 1, 200)
        wave = 0.12 * np.sin(2 * np.pi * 6 * s) * (s > 0.1) * (s < 0.9)
        line = foot + 0.8 * along + 1.4 * s[:, None] * along + (0.3 + wave)[:, None] * across
        axes.plot(*line.T, color="0.4", lw=1)
middle = (0.2 + 4.4 + 0.4) * along + 0.3 * across
arrows = {"tension below": 1.6 * along, "tension above": -1.6 * along}
for height, (name, arrow) in zip((0.75, 0.75), arrows.items(), strict=True):
    start = middle + height * across
    axes.annotate("", start + arrow, start, arrowprops={"arrowstyle": "-|>", "color": "#d95f0e"})
    axes.text(*(start + arrow + 0.2 * across), name, ha="center", fontsize=9)
axes.annotate("", middle + [0, -1.5], middle, arrowprops={"arrowstyle": "-|>", "color": "k"})
axes.text(*(middle + [0.1, -1.5]), "weight", fontsize=9)
start = middle - 0.3 * across
axes.annotate("", start - 1.3 * along, start, arrowprops={"arrowstyle": "-|>", "color": "#7a0177"})
axes.text(*(start - 1.9 * along - 0.45 * across), "friction", fontsize=9, color="#7a0177")
axes.set(aspect="equal", xlim=(-0.6, 8.1), ylim=(-2.9, 1.4))
axes.axis("off")
