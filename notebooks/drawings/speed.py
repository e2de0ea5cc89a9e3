"""Time per half-cycle of exact and of Verlet, as it was measured."""

import json

import matplotlib.pyplot as plt
from pages import BOOK

measured = json.loads((BOOK / "pictures" / "half-cycles.json").read_text())
figure, axes = plt.subplots(figsize=(7.5, 3.4), layout="constrained")
for method in measured[0]["seconds"]:
    points = [(row["n"], 1e6 * row["seconds"][method]) for row in measured if method in row["seconds"]]
    axes.loglog(*zip(*points, strict=True), "o-", ms=4, label=method)
axes.set(xlabel="sliders", ylabel="time per half-cycle (us)")
axes.legend(frameon=False)
