from exactcreep import Chain, intercept

chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
intercept(chain, cycles=100).plot().savefig("intercept.png")
