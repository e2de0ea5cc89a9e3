"""Velocity of three relaxed sliders over the amplitude, with its proved edge and the law."""

import matplotlib.pyplot as plt
import numpy as np

from exactcreep import Chain, Cycles, creep, laws, threshold
from exactcreep.figures.style import DASHED, DOTTED, VELOCITY

chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
edge = float(threshold(chain, digits=9, low="0.00045", high="0.00046", points=1).lower)
amplitudes = np.linspace(0.00032, 0.00056, 97)
settled = [creep(chain, Cycles(float(size), 40), burn_in=40, record=()).velocity for size in amplitudes]
figure, axes = plt.subplots(figsize=(6.5, 3.4), layout="constrained")
axes.plot(1e3 * amplitudes, settled, ".", ms=4, color="black", label="relaxed chain, cycles 20 to 40")
axes.axvline(1e3 * edge, color="C0", label="proved edge of lasting creep")
for size, name, ink in (
    (laws.threshold_amplitude(n=3, l0=1000, mu_d=0.5, tan_alpha=0.25), "Eq. 22", "C1"),
    (laws.onset_amplitude(n=3, l0=1000, mu_d=0.5, mu_s=0.6, tan_alpha=0.25), "Eq. 22 with the term that it drops", "C3"),
):
    axes.axvline(1e3 * size, color=ink, ls=DASHED if ink == "C1" else DOTTED, label=name)
axes.set(xlabel=r"$10^3\,A_\theta$", ylabel=VELOCITY)
figure.legend(loc="outside lower center", ncols=2)
