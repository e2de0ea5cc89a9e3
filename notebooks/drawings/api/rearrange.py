import matplotlib.pyplot as plt
import numpy as np

from exactcreep import Chain, State, rearrange

chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
state = State.relaxed(chain, seed=1)
while len((avalanche := rearrange(chain, state, direction=+1, seed=1)).events) < 6:
    state = avalanche.state
times = np.linspace(0, avalanche.duration, 400)
plt.figure(figsize=(6.5, 3), layout="constrained")
for n, velocity in enumerate(avalanche.sol(times).velocities, 1):
    plt.plot(times, velocity, label=f"slider {n}")
plt.xlabel(r"time ($\tau_\mathrm{dyn}$)")
plt.ylabel(r"velocity ($g\,\tau_\mathrm{dyn}$)")
plt.legend()
plt.savefig("rearrange.png")
