import matplotlib.pyplot as plt

from exactcreep import Chain, disorder

chain = Chain(n=3, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
plt.figure(figsize=(6.5, 3.2), layout="constrained")
for n in (1, 2, 3):
    plt.plot(disorder.static_coefficients(chain, 1, n, 0, 50), ".-", label=f"slider {n}")
plt.xlabel("contact k")
plt.ylabel(r"$\mu_s$")
plt.legend()
plt.savefig("static_coefficients.png")
