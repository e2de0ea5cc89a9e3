import matplotlib.pyplot as plt

from exactcreep import Chain, Cycles, creep, quiescent

chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
rests = quiescent([creep(chain, Cycles("0.0008", 200), seed=seed) for seed in range(4)])
plt.figure(figsize=(6.5, 3.2), layout="constrained")
plt.hist(rests.table["waited"].dropna(), bins=range(1, 12))
plt.xlabel("cycles from one jump to the next")
plt.ylabel("jumps")
plt.savefig("quiescent.png")
