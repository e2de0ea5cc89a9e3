"""Four sliders on an incline, and the forces on one of them."""

import matplotlib.pyplot as plt
import numpy as np

SLOPE = 0.25
along, across = np.array([1, -SLOPE]) / np.hypot(1, SLOPE), np.array([SLOPE, 1]) / np.hypot(1, SLOPE)
figure, axes = plt.subplots(figsize=(7.5, 2.9), layout="constrained")
ends = np.array([-1 * along, 8.4 * along])
axes.fill_between(ends[:, 0], ends[:, 1], -2.5, color="0.88", lw=0)
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
tilt = {"rotation": -np.degrees(np.arctan(SLOPE)), "rotation_mode": "anchor", "ha": "center"}
axes.text(*(1.7 * along + 0.6 * across), r"$k,\ l_0(1+\theta)$", color="0.3", **tilt)
middle = (0.2 + 4.4 + 0.4) * along
for side, name, arrow in (
    (0.4, "tension below", 1.2 * along),
    (-0.4, "tension above", -1.2 * along),
):
    start = middle + 0.75 * across + side * along
    axes.annotate("", start + arrow, start, arrowprops={"arrowstyle": "-|>", "color": "#d95f0e"})
    axes.text(*(start + 0.6 * arrow + 0.12 * across), name, fontsize=9, color="#d95f0e", **tilt)
axes.annotate("", middle + [0, -1.0], middle, arrowprops={"arrowstyle": "-|>", "color": "k"})
axes.text(*(middle + [0.1, -0.95]), r"weight $mg$", fontsize=9)
start = middle - 0.12 * across
axes.annotate("", start - 1.6 * along, start, arrowprops={"arrowstyle": "-|>", "color": "#7a0177"})
axes.text(*(start - 0.9 * along - 0.32 * across), "friction", fontsize=9, color="#7a0177", **tilt)
corner = 8.1 * along
axes.plot([corner[0] - 1.6, corner[0]], [corner[1], corner[1]], color="0.3", lw=0.8, ls="--")
axes.text(corner[0] - 1.35, corner[1] + 0.08, r"$\alpha$")
axes.set(aspect="equal", xlim=(-0.6, 8.1), ylim=(-2.5, 0.9))
axes.axis("off")
