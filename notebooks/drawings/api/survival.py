from exactcreep import Chain, survival

chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", tan_alpha="0.25")
survival(chain, "0.000969", starts=20, cycles=4000).plot().savefig("survival.png")
