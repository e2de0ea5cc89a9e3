import matplotlib.pyplot as plt
import numpy as np

from exactcreep import laws

plt.figure(figsize=(6.5, 3.2), layout="constrained")
sigmas = np.linspace(0.0002, 0.004, 200)
chain = {"n": 6, "l0": 1000, "mu_d": 0.5, "tan_alpha": 0.2499, "sigma_theta": sigmas}
plt.plot(1e3 * sigmas, laws.sliding_velocity_random(**chain), label=r"exact for $\mu_s\to\mu_d$")
plt.plot(1e3 * sigmas, laws.creep_velocity_random(**chain), "--", label="Eq. 24")
plt.xlabel(r"$10^3\,\sigma_\theta$")
plt.ylabel(r"velocity per target ($g\,\tau_\mathrm{dyn}^2$)")
plt.legend()
plt.savefig("sliding_velocity_random.png")
