import matplotlib.pyplot as plt
import numpy as np

from exactcreep import laws

plt.figure(figsize=(6.5, 3.2), layout="constrained")
amplitudes = np.linspace(0.0003, 0.004, 200)
for n in (2, 6, 30):
    law = laws.creep_velocity(n=n, l0=1000, mu_d=0.5, tan_alpha=0.2499, amplitude=amplitudes)
    plt.plot(1e3 * amplitudes, np.maximum(law, 0), label=f"N = {n}")
plt.xlabel(r"$10^3\,A_\theta$")
plt.ylabel(r"velocity per half-cycle ($g\,\tau_\mathrm{dyn}^2$)")
plt.legend()
plt.savefig("creep_velocity.png")
