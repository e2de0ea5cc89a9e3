from exactcreep import load_scene, plot_sweep, sweep

scene = load_scene("two-sliders-cycles").with_settings(
    {"drive.cycles": 100, "vary.drive.amplitude": ["0.002", "0.004", "0.006", "0.008"], "vary.run.seed": [1, 2, 3]}
)
plot_sweep(sweep(scene)).figure.savefig("sweep.png")
