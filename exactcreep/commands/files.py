"""Commands about scenes and files: list, show, animate, explore."""

from __future__ import annotations

import importlib.util
import os
import runpy
import secrets
import socket
import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import exactcreep
from exactcreep.commands.answer import Drawing, Output, Printed, drawing, put
from exactcreep.commands.values import (
    File,
    Flag,
    Force,
    Name,
    Number,
    Run,
    SceneName,
    Seed,
    Settings,
    Solver,
    Whole,
    scene_of,
    taken,
    whole,
)
from exactcreep.watch import interrupts, terminal
from exactcreep.watch.display import Display

DEFAULT = Printed()

_MOST_DRAWN = 2000  # sliders of an animation; a frame of more takes seconds


def scenes(scene: Name | None = None, /, *, output: Printed = DEFAULT) -> None:
    """List the built-in scenes, or print one that you can edit.

    A scene is a TOML file: a chain, its drive, recorded quantities, and varied parameters.

    Parameters
    ----------
    scene : NAME
        Print the TOML text of this scene.

    Examples
    --------
    exactcreep scenes chain-jumps > my-scene.toml
    """
    from exactcreep.model.names import one_of
    from exactcreep.scene import builtin_scenes

    texts = builtin_scenes()
    if scene is not None:
        if scene not in texts:
            raise exactcreep.InputError("scene", scene, one_of(scene, texts))
        about = {"name": scene, "toml": texts[scene]}
        return output.deliver(about, lambda: put(texts[scene], end=""))
    loaded = [exactcreep.load_scene(name) for name in texts]
    listed = [
        {"name": each.name, "title": each.title, "members": len(each.settings())} for each in loaded
    ]
    width = max(len(each.name) for each in loaded)
    lines = "\n".join(f"{each.name:<{width}}  {each.title}" for each in loaded)
    output.deliver({"scenes": listed}, lambda: put(lines))


def show(
    run: Run,
    /,
    *,
    half_cycle: Whole | None = None,
    window: Whole = "4",
    max_seconds: Number = "60",
    out: File | None = None,
    force: Force = False,
) -> None:
    """Draw a saved run: x_G over time, and the half-cycles around one from inside.

    Inside are every rearrangement with its duration, and every slip. Quantities that the run did
    not record are computed again, bit for bit.

    Parameters
    ----------
    half_cycle : int
        Show the half-cycles around half-cycle K. Default: the last.
    window : int
        Number of half-cycles that are drawn from inside.
    max_seconds : number
        Stop computing again after this time. Default: 60.
    out : path
        PNG, PDF or SVG file. Default: RUN.png.

    Examples
    --------
    exactcreep show run.nc
    exactcreep show run.nc --half-cycle 37 --window 10 --out inside.pdf
    """
    from exactcreep.commands.run import known_text
    from exactcreep.figures.run import inside
    from exactcreep.watch.limits import Limits

    output = Output(plot=out or run.with_suffix(".png"), force=force)
    output.check(run=run)
    limits = Limits.of(max_seconds=max_seconds)
    seen = exactcreep.Creep.load(run)
    wide, wanted = whole(window, "window"), whole(half_cycle, "half_cycle", 0, seen.half_cycles)
    around = seen.half_cycles if wanted is None else wanted
    with Display(after=1.0) as display:
        view = inside(seen, around, wide or 1, limits, display.show)
    said = partial(put, f"trajectory {known_text(seen)}")
    remark = "" if view else "nothing is drawn from inside: no rearrangement, or more than 20000"
    output.deliver({}, said, draw=drawing("run:draw_run", seen, run.stem, view), remark=remark)


def animate(
    scene: SceneName,
    /,
    *,
    settings: Settings = None,
    rearrangement: Whole | None = None,
    solver: Solver = None,
    seed: Seed = None,
    frames: Whole = "120",
    max_seconds: Number | None = None,
    out: File | None = None,
    force: Force = False,
) -> None:
    """Animate one avalanche, computed from the closed form of its motion.

    Rearrangements are numbered from 0 along the drive, as in a run that records its events.

    Parameters
    ----------
    rearrangement : int
        Its number, from 0. Default: the one with most events in 100 half-cycles.
    frames : int
        Frames of the GIF file.
    max_seconds : number
        Stop searching for the rearrangement after this time.
    out : path
        GIF file. Default: SCENE.gif.

    Examples
    --------
    exactcreep animate six-sliders-cycles --rearrangement 5 --out one.gif
    exactcreep animate thirty-sliders-cycles --frames 60
    """
    from exactcreep.figures.animation import draw_avalanche, find_avalanche
    from exactcreep.watch.limits import Limits

    limits = Limits.of(max_seconds=max_seconds)
    wanted = scene_of(scene, settings, solver=solver, seed=seed)
    experiment = wanted.experiment(wanted.settings()[0])
    whole(str(experiment.chain.n), "chain.n", 1, _MOST_DRAWN)
    if out is not None and out.suffix.lower() != ".gif":
        raise exactcreep.InputError("out", str(out), "must end in .gif")
    count = whole(frames, "frames", 2, 10_000) or 2
    number = whole(rearrangement, "rearrangement", 0)
    output = Drawing(out=out or Path(f"{wanted.name}.gif"), force=force)
    output.check()
    with Display() as display:
        found = find_avalanche(experiment, number, limits, progress=display.show)

    def save(path: Path, *, force: bool) -> None:
        with Display() as display:
            draw_avalanche(
                found, path, frames=count, force=force, limits=limits, progress=display.show
            )

    motion = found.rearrangement
    said = (
        f"rearrangement {found.number}, half-cycle {found.half_cycle}:"
        f" {len(motion.events)} events in {float(motion.duration):.4g} tau_dyn"
    )
    output.deliver({}, partial(put, said), save=save)


def explore(*, port: Annotated[str | None, taken("PORT")] = None, headless: Flag = False) -> None:
    """Play with a chain in the browser: sliders for its parameters, its run, its law, its fate.

    Starts a marimo app (the extra "explore") that only this machine can reach, until Ctrl-C.

    Parameters
    ----------
    port : PORT
        Port of the app. Default: a free port.
    headless : bool
        Do not open a browser.

    Examples
    --------
    exactcreep explore
    exactcreep explore --port 8000 --headless
    """
    number = whole(port, "port", 1, 65_535)
    if importlib.util.find_spec("marimo") is None:
        needed = "needs marimo: pip install '.[explore]' in a clone"
        raise exactcreep.InputError("explore", "marimo", needed)
    # marimo's own token is a hash, which PYTHONHASHSEED decides
    words = ["--token", f"--token-password={secrets.token_urlsafe(16)}"]
    words += ["--headless"] if headless else []
    if number is not None:
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", number))
            except OSError as error:
                allowed = f"cannot be used: {error.strerror}"
                raise exactcreep.InputError("port", number, allowed) from None
        words += ["--port", str(number)]
    from exactcreep.compiling import told
    from exactcreep.figures import explorer
    from exactcreep.watch.display import COMPILING

    with told(lambda: print(COMPILING, file=terminal.stream("stderr"), flush=True)):
        explorer.prepare()
    app = Path(exactcreep.__file__).parent / "figures" / "explorer_app.py"
    os.environ["MARIMO_SKIP_UPDATE_CHECK"] = "1"  # no request leaves this machine
    sys.argv = ["marimo", "--yes", "run", str(app), *words]
    try:  # within this process, so that no server is left behind
        runpy.run_module("marimo", run_name="__main__", alter_sys=True)
    except SystemExit as leaving:
        if leaving.code and interrupts.status() is None:
            raise
    raise KeyboardInterrupt  # marimo also handles Ctrl-C, and then returns normally
