"""Two sliders a little below and a little above the amplitude from which on they creep."""

import matplotlib.pyplot as plt

from exactcreep import Chain, Cycles, creep

chain = Chain(n=2, l0=1000, mu_d="0.5", mu_s="0.6", tan_alpha="0.25")
figure, axes = plt.subplots(figsize=(7.5, 3.2), layout="constrained")
for amplitude, color in (("0.0003", "#2b7bba"), ("0.0005", "#d95f0e"), ("0.0008", "#7a0177")):
    result = creep(chain, Cycles(amplitude=amplitude, cycles=20))
    label = f"A = {amplitude}: {result.outcome.value.replace('_', ' ')}"
    axes.step(range(1, 41), result.dataset.x_G, where="post", color=color, label=label)
axes.set(xlabel="half-cycle", ylabel=r"$x_G$  ($g\,\tau_\mathrm{dyn}^2$)")
axes.legend(frameon=False)
