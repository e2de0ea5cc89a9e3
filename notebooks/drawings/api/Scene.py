from exactcreep import Scene, sweep
from exactcreep.figures.sweep import draw_sweep

scene = Scene.from_text("""
title = "Six sliders on nine slopes"
chain = { n = 6, l0 = 1000, mu_d = 0.5, mu_s = 0.6, sigma_mu = 0.01 }
drive = { kind = "cycles", amplitude = 0.01, cycles = 20 }
vary = { "chain.tan_alpha" = { from = 0.05, to = 0.45, step = 0.05 } }
""", name="slopes")
draw_sweep(sweep(scene)).savefig("Scene.png")
