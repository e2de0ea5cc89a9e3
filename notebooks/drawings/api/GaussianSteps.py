from exactcreep import Chain, GaussianSteps, creep

chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
creep(chain, GaussianSteps(sigma_theta="0.005", steps=40), seed=1, record=("x_G", "x")).plot().figure.savefig("GaussianSteps.png")
