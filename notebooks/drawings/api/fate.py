from exactcreep import Chain, fate

chain = Chain(n=5, l0=1000, mu_d="0.5", mu_s="0.6", tan_alpha="0.25")
fate(chain, "0.000759").plot().savefig("fate.png")
