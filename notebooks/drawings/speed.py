"""Time per half-cycle of exact and of Verlet, as it was measured."""

import matplotlib.pyplot as plt
import pandas as pd
from pages import BOOK

measured = pd.read_csv(BOOK / "pictures" / "half-cycles.csv").query("amplitude == '0.01' and sigma_mu == 0.01")
figure, axes = plt.subplots(figsize=(7.5, 3.4), layout="constrained")
for method in measured.columns[3:]:
    axes.loglog(measured["n"], measured[method], "o-", ms=4, label=method)
axes.set(xlabel="sliders", ylabel="time per half-cycle (us)")
axes.legend(frameon=False)
