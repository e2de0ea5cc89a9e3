"""Where names, commands, options and solvers of earlier versions went, as messages say it."""

NAMES = {
    "Path": "is exactcreep.Targets now",
    "resume": "is gone: the same call goes on, creep(..., checkpoint=path)",
    "plan": "is gone: compare(experiment) begins with what a scene needs",
    "Plan": "is gone: compare(experiment) begins with what a scene needs",
    "Method": "is gone: compare takes experiments, each with its solver",
    "intercept": 'is gone: threshold(chain, kind="intercept") takes its place',
    "Intercept": 'is gone: threshold(chain, kind="intercept") returns a Threshold',
    "GivenUp": "is gone: the reason of a Threshold takes its place",
    "Descent": "is exactcreep.results.Walk now, of a solid as of a pipeline",
    "quiescent": "is gone: a cell of the notebook From jumps to steady creep takes its place",
    "Quiescence": "is gone: a cell of the notebook From jumps to steady creep takes its place",
}
"""Of names that stood in `exactcreep`; those in `exactcreep.results` are known by themselves."""
COMMANDS = {
    "export": "in Python, Creep.load(FILE).to_pandas(TABLE).to_csv(FILE) writes a table",
    "resume": "the command that began the run goes on: exactcreep run SCENE --checkpoint FILE",
    "sweep": "a scene that varies is run by exactcreep run SCENE, with --out DIR to save its cells",
    "plan": "what a scene needs, with the law, is said by exactcreep compare SCENE",
    "intercept": "exactcreep threshold --kind intercept finds where v(A) begins",
    "quiescent": "the notebook From jumps to steady creep finds the rests of a run",
    "half-life": "exactcreep survival at a few amplitudes tells how many starts still creep",
    "reproduce": "the paper's figures are scenes: exactcreep run chain-amplitude --plot FILE",
}
OPTIONS = {
    "--criterion": "exactcreep threshold takes --kind, and --after for the edge of a cycle",
    "--bracket": "exactcreep threshold --from LO --to HI --points 1 finds the edge between two",
    "--windows": "exactcreep threshold --edges lists every edge of the scan",
    "--solver": "float64 answers first, and certified then proves it",
    "--mend": "mend the series in pandas, as the page Use my own temperature record shows",
    "--member": "name the file of one run, which exactcreep run SCENE --out DIR wrote",
    "--resume": "the same command goes on",
    "--scheduler": "in Python, sweep(scene, executor=client.get_executor(pure=False))",
}
SOLVERS = dict.fromkeys(("reference", "mpmath"), "is no longer there, use certified with digits")
