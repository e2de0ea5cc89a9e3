from exactcreep import Chain, threshold
from exactcreep.figures.threshold import draw_threshold

chain = Chain(n=3, l0=1000, mu_d="0.5", mu_s="0.6", tan_alpha="0.25")
draw_threshold(threshold(chain, windows=True, digits=9, points=60)).savefig("threshold.png")
