import matplotlib.pyplot as plt
import numpy as np

from exactcreep import laws

plt.figure(figsize=(6.5, 3.2), layout="constrained")
amplitudes = np.linspace(0.0001, 0.0015, 600)
chain = {"l0": 1000, "mu_d": 0.5, "tan_alpha": 0.25, "amplitude": amplitudes}
plt.plot(1e3 * amplitudes, laws.staircase_two_sliders(mu_s=0.6, **chain), label="two relaxed sliders, exact")
plt.plot(1e3 * amplitudes, laws.sliding_velocity(n=2, **chain), "--", label="mean over all starts")
plt.xlabel(r"$10^3\,A_\theta$")
plt.ylabel(r"velocity per half-cycle ($g\,\tau_\mathrm{dyn}^2$)")
plt.legend()
plt.savefig("staircase_two_sliders.png")
