"""The arithmetics, and what a comparison in each of them is worth."""

import matplotlib.pyplot as plt

STOREYS = (
    ("float64", "exact, verlet", "computed: decided by more than a bound of its rounding"),
    ("balls", "certified", "proved where balls do not overlap; else more precision"),
    ("rationals", "ties, lone slips, pivots", "proved, equality included"),
)
figure, axes = plt.subplots(figsize=(7.5, 2.2), layout="constrained")
for k, (name, who, claim) in enumerate(STOREYS):
    axes.add_patch(
        plt.Rectangle((0.35 * k, k), 10 - 0.7 * k, 0.9, color=plt.cm.Blues(0.2 + 0.12 * k))
    )
    axes.text(5, k + 0.6, f"{name}   ({who})", ha="center", va="center", weight="bold", fontsize=10)
    axes.text(5, k + 0.25, claim, ha="center", va="center", fontsize=9)
axes.set(xlim=(0, 10), ylim=(0, 3))
axes.axis("off")
