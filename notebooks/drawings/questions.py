"""Processor time to the answer of a question, by method, as it was measured."""

import json

import matplotlib.pyplot as plt
from pages import BOOK

measured = json.loads((BOOK / "pictures" / "benchmark.json").read_text())["answers"]
asked = list(dict.fromkeys(f"{row['question']}, N = {row['n']}" for row in measured))
figure, axes = plt.subplots(figsize=(7.5, 5.6), layout="constrained")
methods = dict.fromkeys(row["method"] for row in measured)
for method, mark in zip(methods, "os^D*<>P", strict=True):
    points = [
        (row["seconds"], asked.index(f"{row['question']}, N = {row['n']}"))
        for row in measured
        if row["method"] == method and row["seconds"] is not None
    ]
    axes.semilogx(*zip(*points, strict=True), mark, ms=7, label=method)
axes.set(xlabel="processor time to the answer (s)", yticks=range(len(asked)), yticklabels=asked)
axes.grid(axis="y", linewidth=0.5)
axes.invert_yaxis()
figure.legend(frameon=False, loc="outside lower center", ncols=4)
