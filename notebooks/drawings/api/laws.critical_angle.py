import matplotlib.pyplot as plt
import numpy as np

from exactcreep import laws

plt.figure(figsize=(6.5, 3.2), layout="constrained")
sizes = np.arange(2, 31)
for i in (2, 3, 4, 5):
    plt.plot(sizes, [laws.critical_angle(n=int(n), i=i, mu_d=0.5, mu_s=0.6) for n in sizes], "o-", ms=3, label=f"i = {i}")
plt.xlabel("number of sliders N")
plt.ylabel(r"$\tan\alpha^*_{N,i}$")
plt.ylim(0, 0.5)
plt.legend()
plt.savefig("critical_angle.png")
