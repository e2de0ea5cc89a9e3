import matplotlib.pyplot as plt
import numpy as np

from exactcreep import laws

plt.figure(figsize=(6.5, 3.2), layout="constrained")
slopes = np.linspace(0.02, 0.45, 300)
chain = {"n": 6, "l0": 1000, "mu_d": 0.5, "amplitude": 0.01}
sticky = chain | {"mu_s": 0.6, "sigma_mu": 0.01}
fitted = [laws.sticking_velocity(sticky | {"tan_alpha": slope}) for slope in slopes]
plt.plot(slopes, fitted, label="sliders that stick and slip, fitted")
plt.plot(slopes, laws.creep_velocity(**chain, tan_alpha=slopes), "--", label="Eq. 23")
plt.xlabel(r"$\tan\alpha$")
plt.ylabel(r"velocity per half-cycle ($g\,\tau_\mathrm{dyn}^2$)")
plt.legend()
plt.savefig("sticking_velocity.png")
