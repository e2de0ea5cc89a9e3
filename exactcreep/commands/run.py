"""``exactcreep run``: run a scene, and every member of a scene that varies."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import exactcreep
from exactcreep.commands import answer
from exactcreep.commands.values import (
    File,
    Flag,
    Name,
    Number,
    SceneName,
    Seconds,
    Seed,
    Settings,
    Whole,
    Workers,
    scene_of,
    taken,
    whole,
)

if TYPE_CHECKING:
    import xarray as xr

    from exactcreep import Creep, Scene
    from exactcreep.quasistatic.checkpoint import Checkpoint
    from exactcreep.results import Walk
    from exactcreep.scene import Member
    from exactcreep.watch.display import Display
    from exactcreep.watch.limits import Limits
    from exactcreep.watch.progress import Progress


_FORETOLD_AFTER, _WORTH_TELLING = 0.3, 1.0  # seconds of a run, and seconds that it still takes
_MOST_ROWS = 50  # most points of a grid that are printed
_ROUNDING = 1e-9  # relative; smaller differences from a law are rounding errors


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Session(answer.Output):
    """The output and the limits of a run.

    Parameters
    ----------
    plot : path
        Draw the run to this PNG, PDF or SVG file: x_G, and what happens inside its first
        half-cycles. A run that records rearrangements is drawn by their sizes, a scene that varies
        by its grid.
    out : path
        Write the result to this NetCDF file. If the scene varies, a directory for the run of every
        member and the grid sweep.nc; the same command goes on.
    force : bool
        Overwrite files that exist, and begin anew what they hold.
    every : SECONDS
        Time between two writings of the checkpoint.
    max_events : int
        Stop a run after K events.
    max_seconds : SECONDS
        Stop after this time.
    """

    every: Seconds = "60"
    max_events: Whole | None = None
    max_seconds: Seconds | None = None
    workers: Workers = None

    def run(self, limits: Limits, wanted: Scene, kept: Checkpoint | None) -> None:
        """Run a scene, then save, draw and print its result, and exit with its status."""
        from exactcreep.quasistatic.creep import run_alone

        (member,) = wanted.members()
        output = self
        if kept is not None and Path(kept.path).exists():  # the same command goes on
            from exactcreep.quasistatic.dataset import is_run_of

            same = self.out is None or is_run_of(self.out, member.experiment)
            output = replace(self, force=self.force or same)
        output.check(checkpoint=None if kept is None else Path(kept.path))
        if self.plot and not {"x_G", "rearrangements"} & {*member.experiment.record}:
            allowed = "needs x_G or rearrangements among the recorded quantities"
            raise exactcreep.InputError("plot", str(self.plot), allowed)
        status, remark = 0, ""
        with answer.shown(quiet=self.json) as display:
            try:
                result = run_alone(
                    member.experiment, progress=foretelling(display), limits=limits,
                    checkpoint=kept,
                )  # fmt: skip
            except exactcreep.results.Interrupted as interrupted:
                result, status, remark = interrupted.partial, answer.INTERRUPTED, "interrupted"
                remark += "; the same command goes on" if kept else ""
        if not status and result.outcome is exactcreep.Outcome.LIMIT:
            status = answer.LIMIT
        if kept is not None and kept.stale:
            status = max(status, answer.STALE)
            remark = f"{kept.stale}; it does not hold the last part"
        moved = None if status == answer.INTERRUPTED else _in_millimetres(result, member)
        summary = {"scene": wanted.name, **result.summary()}
        if moved is not None:
            summary |= {"walk" if math.isnan(moved.time_unit) else "descent": moved.summary()}

        shape, drawn = ("run:draw_run", result) if moved is None else ("walk:draw_walk", moved)
        draw = answer.drawing(shape, drawn, wanted.title)

        def tell() -> None:
            answer.say_heading(wanted.name, wanted.title)
            _print_run(result, moved)

        output.deliver(summary, tell, save=result.save, draw=draw, status=status, remark=remark)

    def sweep(self, limits: Limits, wanted: Scene) -> None:
        """Run every member of a scene, then draw and print the grid, and exit with its status."""
        from exactcreep.watch.preparation import preparing

        with preparing():  # the time to load it does not count
            from exactcreep.studies.sweep import swept
        # the picture of an earlier part may go; a sweep of another scene is refused before that
        goes_on = self.out is not None and (self.out / "sweep.nc").exists()
        output = replace(self, out=None, force=self.force or goes_on)
        output.check()
        if self.out is not None and self.out.suffix == ".nc":
            allowed = "must be a directory, without .nc: this scene varies"
            raise exactcreep.InputError("out", str(self.out), allowed)
        if self.plot:
            from exactcreep.figures.sweep import as_lines

            record = wanted.vary.get("run.record") or wanted.tables["run"].get("record")
            if record is None and as_lines(wanted.vary):
                wanted = wanted.with_settings({"run.record": ["x_G"]})
            elif {*wanted.vary} == {"run.seed"} and "x_G" not in (record or ()):
                allowed = "needs x_G among the recorded quantities"
                raise exactcreep.InputError("plot", str(self.plot), allowed)
        runs: dict[int, Mapping[str, Any]] = {}

        def take(index: int, result: Creep) -> None:
            if self.json:
                runs[index] = result.summary()

        status, remark = 0, ""
        with answer.shown(wanted.name, quiet=self.json) as display:
            try:
                data = swept(
                    wanted, workers=whole(self.workers, "workers"), out=self.out, force=self.force,
                    progress=display.show, limits=limits, take=take,
                )  # fmt: skip
            except exactcreep.results.Interrupted as interrupted:
                data, status, remark = interrupted.partial, answer.INTERRUPTED, "interrupted"
                remark += "; the same command goes on" if self.out else ""
        if not status and not data["finished"].all():
            status = answer.LIMIT
        settings = wanted.settings()
        members = [{"set": settings[index], **run} for index, run in sorted(runs.items())]

        def tell() -> None:
            answer.say_heading(wanted.name, wanted.title)
            _print_grid(data)

        if self.out is not None:
            answer.say_written(self.out / "sweep.nc")
        summary = {"scene": wanted.name, "members": members}
        draw = answer.drawing("sweep:draw_sweep", data, wanted.title or wanted.name)
        output.deliver(summary, tell, draw=draw, status=status, remark=remark)


DEFAULT = Session()


def foretelling(display: Display) -> Callable[[Progress], None]:
    """Show the progress of a run, and say once in its first second what the rest will take."""
    untold = not display.quiet

    def show(progress: Progress) -> None:
        nonlocal untold
        if untold and progress.phase == "running" and progress.seconds >= _FORETOLD_AFTER:
            share, left = progress.share, progress.seconds_left
            if left >= _WORTH_TELLING:  # false if it is not known yet
                events = progress.events * (1 - share) / share  # a checkpoint may hold some
                rest = answer.duration(left)
                display.write(f"expected: about {events:.2g} more events in {rest}")
            untold = math.isnan(left)
        display.show(progress)

    return show


def _in_millimetres(result: Creep, member: Member) -> Walk | None:
    """Return the walk of a single run of a solid or a pipeline, if its units are known."""
    body, targets, known = member.body, result.half_cycles, not math.isnan(member.time_unit)
    walks = targets > 1 and {"x", "tension"} <= {*result.experiment.record}
    if (targets and known) or (walks and isinstance(body, exactcreep.results.Pipeline)):
        return exactcreep.results.Walk(body, result, member.time_unit)
    return None


def run(
    scene: SceneName,
    /,
    *,
    settings: Settings = None,
    solver: Name | None = None,
    dt: Annotated[str | None, taken("DT")] = None,
    locate: bool | None = None,
    digits: Whole | None = None,
    seed: Seed = None,
    accuracy: Number | None = None,
    record: Annotated[list[str] | None, taken("NAMES")] = None,
    seeds: Whole | None = None,
    checkpoint: File | None = None,
    session: Session = DEFAULT,
    twin: Flag = False,
) -> None:
    """Run a scene: drive its chain. A scene that varies is a sweep: all its members, on all cores.

    Exit status: 0 any physical outcome, 2 bad input, 3 a limit was reached, 4 the checkpoint is
    older than the result, 130 Ctrl-C, 143 SIGTERM.

    Parameters
    ----------
    solver : NAME
        exact, certified, verlet or sliding. Default: the solver that the scene names, else exact.
    dt : DT
        Time step of verlet, unit tau_dyn.
    locate : bool
        Let verlet find events inside a step.
    digits : int
        Decimal digits of certified.
    accuracy : X
        Stop when the mean velocity has this relative error, at 95 %, or at the end of the scene's
        drive.
    record : NAMES
        x_G, x, tension, slips, events, rearrangements, slip_table; repeatable or with commas; or
        none.
    seeds : int
        Run every point with the seeds 0 .. K-1.
    checkpoint : path
        Keep this file up to date; the same command continues the run in it.
    twin : bool
        Follow slightly perturbed copies until one differs, however late.

    Examples
    --------
    exactcreep run two-sliders-cycles
    exactcreep run six-sliders-cycles --set chain.tan_alpha=1/5 --plot run.png
    exactcreep run two-sliders-cycles --checkpoint two.ckpt --out two.nc
    exactcreep run bristol-roof --plot roof.png
    exactcreep run chain-plateaus --out plateaus --plot plateaus.png
    exactcreep run two-sliders-cycles --set vary.chain.n=[2,3] --seeds 100
    """
    from exactcreep.quasistatic.checkpoint import Checkpoint
    from exactcreep.watch.limits import Limits

    limits = Limits.of(session.max_events, session.max_seconds)  # the time begins now
    names = None
    if record is not None:
        names = [name for entry in record for name in entry.split(",") if name]
    wanted = scene_of(
        scene, settings, solver=solver, dt=dt, locate=locate, digits=digits, seed=seed,
        accuracy=accuracy, record=[] if names == ["none"] else names, twin=twin or None,
    )  # fmt: skip
    if (count := whole(seeds, "seeds", most=10**6)) is not None:
        wanted = wanted.with_settings({"vary.run.seed": list(range(count))})
    answer.distinct(scene=Path(scene), checkpoint=checkpoint)
    if not wanted.vary:
        kept = None
        if checkpoint is not None:
            kept = Checkpoint(checkpoint, session.every, force=session.force)
        return session.run(limits, wanted, kept)
    if checkpoint is not None:
        allowed = "is of one run, and this scene varies: --out DIR saves each member that has"
        allowed += " finished, and the same command goes on"
        raise exactcreep.InputError("checkpoint", str(checkpoint), allowed)
    session.sweep(limits, wanted)


# --- printing a run -------------------------------------------------------------------------------


def _measured(result: Creep) -> str:
    from exactcreep.model.numbers import with_error

    value, error = result.velocity, result.velocity_error
    if result.velocity_text is not None:
        radius = f", known to {result.velocity_radius}" if result.velocity_radius else ""
        return f"{result.velocity_text} (standard error {error:.2g}{radius})"
    if not math.isfinite(value):
        return "not known" if math.isnan(value) else "unbounded"
    return with_error(value, error)


def _print_run(result: Creep, moved: Walk | None) -> None:
    from exactcreep.laws import prediction
    from exactcreep.model.numbers import in_short

    chain = [pair for pair in result.chain.parameters().items() if pair[0] != "n"]
    numbers = "".join(f", {name} = {in_short(value)}" for name, value in chain)
    options = "".join(f", {name} = {v}" for name, v in result.experiment.options.items())
    solver = f"solver {result.solver}{options}, seed {result.seed}"
    answer.say(f"N = {result.chain.n}{numbers}; {solver}")
    rows: list[tuple[str, Any]] = [
        ("outcome", result.sentence),
        ("trajectory", known_text(result)),
        (f"velocity per {result.drive.per}", _measured(result)),
    ]
    rows += [("  but", result.metastable)] if result.metastable else []
    if result.velocity_reason and math.isfinite(result.velocity):
        rows.append(("  standard error", f"not known: {result.velocity_reason}"))
    elif math.isnan(result.velocity):
        rows.append(("  because", result.velocity_reason))
    law = prediction(result.chain, result.drive, result.experiment.start)
    if law is not None and law.label:
        printed = " or ".join(f"{value:.6g}" for value in law.printed)
        rows.append((f"  paper, {law.label}", printed or "none: below its threshold"))
    if law is not None and result.solver != "sliding":
        rows.append(("  law that holds", str(law)))
    rows += [] if moved is None else moved.lines()
    if "accuracy" in result.report:
        from exactcreep.quasistatic.creep import accuracy_reached

        rows.append(("accuracy", accuracy_reached(result.report)))
    target = "half-cycles" if result.drive.cyclic else "targets"
    reached = f"{result.half_cycles} {target}, {result.rearrangements} rearrangements"
    rows.append(("counts", f"{reached}, {result.event_count} events, {result.slip_count} slips"))
    rows += [("outside the model", text) for text in _outside(result.warnings)]
    answer.say_rows([*rows, ("time", f"{result.seconds:.3g} s")])


def known_text(result: Creep) -> str:
    """Return up to where a trajectory is known, and what holds beyond, in words."""
    from exactcreep.model.outcome import Evidence, Outcome

    until, ties = result.known_until, result.report["undecided"]
    settled = f"; the model's rules settled {ties} ties" if ties else ""
    if result.evidence is Evidence.PROVED:
        return "proved"
    if result.evidence is Evidence.COMPUTED:
        return "known to 1e-9 to the end" + settled
    reach = f"up to {'half-cycle' if result.drive.cyclic else 'target'} {until}"
    known = f"known to 1e-9 {reach if until else 'at its start only'}"
    if result.velocity_error == 0:
        return f"{known}; the outcome is where float64 ended{settled}"
    if result.outcome in (Outcome.RUNAWAY, Outcome.LIMIT):
        return known + settled
    return f"{known}; the mean velocity holds for the whole run{settled}"


def _outside(warnings: Mapping[str, int]) -> list[str]:
    from exactcreep.quasistatic.creep import PHYSICS

    return [f"{PHYSICS[name]} ({count} times)" for name, count in warnings.items()]


# --- printing a grid ------------------------------------------------------------------------------


def beside(
    measured: float, error: float, law: Sequence[float], doubt: float = 0.0
) -> tuple[str, str]:
    """Return the values of a law, and by how many standard errors a measured value is off."""
    if not law:
        return "none", "-"
    low, high = min(law), max(law)
    off, spread = measured - min(max(measured, low), high), error
    if math.isfinite(doubt):
        spread = math.hypot(error, doubt)
    rounding = _ROUNDING * max(abs(low), abs(high), 1.0)
    if math.isnan(measured + error):
        said = "no error"
    elif abs(off) <= rounding:
        said = "between" if high > low else "+0"
    else:
        ratio = off / spread if spread > rounding else math.copysign(math.inf, off)
        digits = round(ratio, abs(ratio) < 100) + 0.0 if math.isfinite(ratio) else ratio
        said = f"{digits:+.4g}"
    return " or ".join(f"{value:.4g}" for value in law), said.replace("inf", "no scatter")


def _outcomes(cells: Any) -> Counter[str]:
    """Return how many cells of a grid had each outcome, in words."""
    from exactcreep.model.outcome import Outcome, with_direction

    each = zip(cells["outcome"].values.flat, cells["direction"].values.flat, strict=True)
    return Counter(with_direction(Outcome(out), way) if out else "not run" for out, way in each)


def _print_grid(grid: xr.Dataset) -> None:
    from exactcreep.figures.sweep import points_of
    from exactcreep.model.numbers import in_short, with_error

    points, rows = points_of(grid, _MOST_ROWS), []
    for point in points:
        own, law, velocity = _outcomes(point.cells), point.prediction(), point.measured
        text = with_error(velocity, point.error)
        if own.total() == 1 and "velocity_decimal" in grid:
            text = str(point.cells["velocity_decimal"].item()) or text
        rows.append((
            *map(in_short, point.varied.values()), text,
            *beside(velocity, point.error, law.printed if law else ()),
            *beside(velocity, point.error, law.values if law else (), law.deviation if law else 0),
            answer.counted(own) if own.total() > 1 else next(iter(own)),
        ))  # fmt: skip
    names = list(points[0].varied)
    answer.say_table((*names, "velocity", "paper", "off", "law", "off", "outcome"), rows,
              right=("paper", "law", "off"), folded=(*names, "outcome"))  # fmt: skip
    count = math.prod(grid.sizes[name] for name in names)
    if count > len(rows):
        answer.put(f"and {count - len(rows)} more")
    seeds = grid["velocity"].size // count
    of_seeds = f", {seeds} seeds each: means and their standard errors" if seeds > 1 else ""
    answer.put(f"{count} point{'s' * (count > 1)}{of_seeds}: {answer.counted(_outcomes(grid))}")
    answer.put(f"trajectories: {answer.counted(filter(None, grid['evidence'].values.flat))}")
    off = "in standard errors and the deviation of the law, if it is known"
    answer.put(f"off: velocity minus law, {off}")
    if seeds == 1 or any(math.isnan(point.error) for point in points):
        runs = zip(grid["velocity"].values.flat, grid["velocity_reason"].values.flat, strict=True)
        reasons = Counter(str(why) for velocity, why in runs if math.isfinite(velocity) and why)
        for reason, count in reasons.items():
            answer.put(f"no standard error in {count} runs: {reason}")
