from exactcreep import Chain, Cycles, creep

chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
run = creep(chain, Cycles("0.01", cycles=8), seed=1, record=("x_G", "x"))
run.plot().figure.savefig("creep.png")
