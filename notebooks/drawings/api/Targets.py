from exactcreep import Chain, Targets, creep

chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
creep(chain, Targets(["0.01", "0", "0.006", "0.002"] * 5), record=("x_G", "x")).plot().figure.savefig("Targets.png")
