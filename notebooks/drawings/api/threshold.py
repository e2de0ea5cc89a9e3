from exactcreep import Chain, threshold

chain = Chain(n=3, l0=1000, mu_d="0.5", mu_s="0.6", tan_alpha="0.25")
threshold(chain, edges=True, digits=9, points=60).plot().savefig("threshold.png")
