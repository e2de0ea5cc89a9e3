from exactcreep import load_scene, sweep
from exactcreep.figures.sweep import draw_sweep

scene = load_scene("two-sliders-cycles").with_settings(
    {"drive.cycles": 100, "vary.drive.amplitude": ["0.002", "0.004", "0.006", "0.008"], "vary.run.seed": [1, 2, 3]}
)
draw_sweep(sweep(scene)).savefig("sweep.png")
