from exactcreep import Chain, half_life

chain = Chain(n=2, l0=1000, mu_d="0.5", mu_s="0.6", tan_alpha="0.25")
half_life(chain, cycles=20, starts=12).plot().savefig("half_life.png")
