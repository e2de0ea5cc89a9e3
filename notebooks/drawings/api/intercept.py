from exactcreep import Chain, intercept
from exactcreep.figures.threshold import draw_threshold

chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
draw_threshold(intercept(chain, cycles=100)).savefig("intercept.png")
