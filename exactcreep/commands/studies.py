"""Commands that ask a question; about a chain, they are made from public functions."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from cyclopts import Parameter

import exactcreep
from exactcreep.commands.answer import (
    INTERRUPTED,
    LIMIT,
    Answer,
    Drawing,
    Output,
    Printed,
    duration,
    grouped,
    of_members,
    say,
    say_heading,
    say_summary,
    say_table,
    settings_text,
    shown,
)
from exactcreep.commands.values import (
    ChainOptions,
    Patience,
    SceneName,
    Settings,
    Whole,
    described,
    scene_of,
    taken,
    whole,
)
from exactcreep.watch import interrupts

if TYPE_CHECKING:
    import xarray as xr

    from exactcreep import Plan

_FOR_EVER = "1e9"  # seconds: with a limit of time a study also checks for Ctrl-C
_UNSEEN = ("Hearer", "Executor")
"""Annotations of parameters that a command line cannot give."""
_KEYWORD = inspect.Parameter.KEYWORD_ONLY
_MOST_IN_FULL = 8  # most planned members that are printed in full; others have one line each
_FLAGS = {"low": "--from", "high": "--to"}
_START = "Tension of every spring at the start; default the relaxed chain."


class Question(NamedTuple):
    """A public function that is a command.

    `summary` is the first sentence of its docstring, which a list of commands does not import;
    `group` has the options of its output; `examples` are command lines.
    """

    summary: str
    group: type[Printed]
    examples: tuple[str, ...]


QUESTIONS = {
    "threshold": Question(
        "Find the amplitude above which a chain creeps.",
        Output,
        (
            "--n 3 --digits 40",
            "--n 5 --after 20 --windows --json",
            "--n 30 --sigma-mu 0.01 --fit 1.3 2",
        ),
    ),
    "fate": Question(
        "Find out whether a chain without disorder rests, is locked or creeps for ever.",
        Drawing,
        (
            "--n 5 --amplitude 0.000765",
            "--n 6 --amplitude 0.000969 --solver exact --plot fate.png",
        ),
    ),
    "survival": Question(
        "Follow many starts under temperature cycles and return how long each start creeps.",
        Output,
        (
            "--n 6 --amplitude 0.000969",
            "--n 6 --amplitude 0.000984 --cycles 50000 --plot lives.png",
        ),
    ),
}
_PRINTED, _WRITTEN = Printed(), Output()


def write_dataset(data: xr.Dataset, path: Path, *, force: bool) -> None:
    """Write a dataset to a NetCDF file, in one piece."""
    from exactcreep.quasistatic.netcdf import netcdf
    from exactcreep.quasistatic.writing import write_file

    write_file(path, netcdf({None: data}), "out", force=force)


def _drawn(result: Any) -> Any:
    """Return the picture of an answer; the drawing modules are imported only here."""
    return result.plot()


def question(command: str) -> Callable[..., None]:
    """Return a public function as a command; see `QUESTIONS`.

    Its exit status is 3 if the function returns early for a reason.
    """
    about = QUESTIONS[command]
    public = getattr(exactcreep, command.replace("-", "_"))

    def ask(**options: Any) -> None:
        chain = exactcreep.Chain(**vars(options.pop("chain")))
        output, tension = options.pop("output", about.group()), options.pop("start", None)
        arguments = {name: value for name, value in options.items() if value is not None}
        arguments.setdefault("max_seconds", _FOR_EVER)
        if tension is not None:
            arguments["start"] = exactcreep.State.prepared(chain, [tension] * (chain.n - 1))
        output.check()
        # Ctrl-C returns a partial result, as the limit of time does
        with shown(quiet=output.json) as display, interrupts.deferred():
            result = public(chain, **arguments, progress=display.show)
            interrupted = interrupts.waiting()
        limited = result.reason
        if hasattr(result, "outcome"):  # of a fate, which may not be proved as was asked
            unproved = result.solver != arguments.get("solver", "certified")
            limited = unproved or result.outcome is exactcreep.Outcome.LIMIT
        summary = result.summary()

        def tell() -> None:
            say(result.sentence[0].upper() + result.sentence[1:], markup=False)
            say_summary({name: summary[name] for name in summary if name not in result.worded})

        output.deliver(Answer(
            summary,
            tell,
            save=lambda path, force: write_dataset(result.dataset, path, force=force),
            draw=partial(_drawn, result),
            status=INTERRUPTED if interrupted else LIMIT if limited else 0,
            remark="interrupted: this is the part known so far" if interrupted else "",
        ))  # fmt: skip

    ask.__signature__ = _signature(public, about.group)  # type: ignore[attr-defined]
    ask.__doc__ = _docstring(public, [f"exactcreep {command} {line}" for line in about.examples])
    return ask


def _docstring(public: Callable[..., Any], examples: Sequence[str]) -> str:
    """Return a function's docstring up to its sections, with exit statuses and examples."""
    text = f"{inspect.getdoc(public)}".partition("\n\nParameters\n")[0]
    status = "Exit status: 0 answered, 2 bad input, 3 a limit (with the part known so far)."
    return "\n".join([text, "", status, "", "Examples", "--------", *examples])


def _signature(public: Callable[..., Any], group: type[Printed]) -> inspect.Signature:
    said, options = described(public), list[inspect.Parameter]()
    for own in inspect.signature(public).parameters.values():
        if own.name != "chain" and not any(word in str(own.annotation) for word in _UNSEEN):
            default, kind = _as_text(own.default), _kind(own, said.get(own.name, ""))
            options.append(inspect.Parameter(own.name, _KEYWORD, default=default, annotation=kind))
    chain = inspect.Parameter("chain", _KEYWORD, annotation=ChainOptions)
    output = inspect.Parameter("output", _KEYWORD, default=group(), annotation=group)
    return inspect.Signature([chain, *options, output])


def _kind(own: inspect.Parameter, about: str) -> Any:
    """Return the annotation of a parameter of a public function on the command line."""
    annotation, named = str(own.annotation), dict[str, Any](help=about)
    if own.name in _FLAGS:
        named["name"] = _FLAGS[own.name]
    if "State" in annotation:
        named = {"name": "--start-tension", "help": _START}
    if annotation == "bool":
        return Annotated[bool, Parameter(negative="", show_default=False, **named)]
    if "tuple[" in annotation:
        return Annotated[tuple[str, str] | None, taken("LO HI", **named)]
    metavar = "K" if "int" in annotation else "NAME" if annotation.startswith("str") else "X"
    return Annotated[str if own.default is own.empty else str | None, taken(metavar, **named)]


def _as_text(default: Any) -> Any:
    """Return a default in the form of the command line: numbers as text."""
    if isinstance(default, tuple):
        return tuple(map(_as_text, default))
    is_number = isinstance(default, (int, float)) and not isinstance(default, bool)
    return str(default) if is_number else default


def compare(
    scene: SceneName,
    /,
    *,
    settings: Settings = None,
    dts: Annotated[str, taken("LIST")] = "0.1,0.03,0.01",
    digits: Whole = "30",
    events: Whole | None = None,
    seeds: Annotated[str | None, taken("SEEDS")] = None,
    output: Output = _WRITTEN,
) -> None:
    """Compare each solver with the certified one, with the same disorder.

    Solvers are exact, Verlet with and without located events, and the sliding limit. The table has
    the number of events that agree, the position error before the first wrong event, its order in
    dt, the bias of the mean velocity with an interval of 95 % over the seeds, and the time per
    half-cycle. If a scene has several members, only the first is compared; choose another with
    --set.

    Parameters
    ----------
    dts : LIST
        Time steps of verlet, unit tau_dyn.
    digits : int
        Decimal digits of the certified solver.
    events : int
        Certified events to compare for each seed. Default: by the number of sliders.
    seeds : SEEDS
        Compare over K seeds, or over a list: 1,2,3. Default: by the number of sliders.

    Examples
    --------
    exactcreep compare six-sliders-cycles
    exactcreep compare thirty-sliders-cycles --events 300 --json
    exactcreep compare six-sliders-cycles --seeds 16 --dts 0.1,0.03,0.01 --plot compared.png
    """
    from exactcreep.studies import comparison
    from exactcreep.studies.compare import ladder

    compared = scene_of(scene, settings)
    first = compared.settings()[0]
    experiment = compared.experiment(first)
    best = exactcreep.Method("certified", digits=whole(digits, "digits"))
    methods = ladder(experiment.chain, [part.strip() for part in dts.split(",")], best)
    wanted: Any = whole(seeds, "seeds") if seeds is None or "," not in seeds else [
        whole(part.strip(), "seeds", 0) for part in seeds.split(",")
    ]  # fmt: skip
    count, truth = whole(events, "events"), None if experiment.chain.slides else best
    output.check()
    with shown(quiet=output.json) as display:
        data = exactcreep.compare(
            experiment, methods, truth=truth, events=count, seeds=wanted, progress=display.show
        )
    about, title = {"scene": compared.name, "set": first}, compared.title or compared.name

    def draw() -> Any:
        from exactcreep.figures.compare import draw_compared

        return draw_compared(data, title)

    def tell() -> None:
        say_heading(compared.name, compared.title)
        _print_compared(data)

    save = partial(write_dataset, data)
    output.deliver(Answer({**about, **comparison.summary(data)}, tell, save, draw))


def _print_compared(data: xr.Dataset) -> None:
    from exactcreep.model.numbers import with_error
    from exactcreep.studies.comparison import advice, order, table

    def formatted(value: float, form: str) -> str:
        return "-" if math.isnan(value) else format(value, form)

    seeds = data.sizes["seed"]
    solvers = dict(zip(data.method.values.tolist(), data.solver.values.tolist(), strict=True))
    how = "proved" if solvers.get(data.truth) == "certified" else "-"
    say(f"{int(data.events.sum())} events of {data.truth}, {seeds} seed{'s' * (seeds > 1)}")
    rows = []
    for name, row in table(data).iterrows():
        short = str(name).replace("dt = ", "").replace(",", "")
        bias, error = 100 * row.bias, 100 * row.bias_error
        off = how if name == data.truth else formatted(row.error, ".1e")
        rows.append((
            short.replace(" digits", "").replace("ated", "."), formatted(row.parted, ".0f"),
            formatted(row.agreed, ".0f"), off,
            "-" if math.isnan(bias) else with_error(bias, error, "+"),
            duration(row.seconds), formatted(row.ratio, ".3g"),
        ))  # fmt: skip
    names = ("parted", "after", "error", "bias %", "time", "/exact")
    say_table(("", *names), rows, right=names, collapse_padding=True, pad_edge=False)
    for label, locate in (("Verlet", False), ("with located events", True)):
        value, lower, upper = order(data, locate=locate)
        if not math.isnan(value):
            between = "" if math.isnan(lower) else f" ({lower:.2f} to {upper:.2f})"
            say(f"order of the position error, {label}: {value:.2f}{between}")
    say(
        "parted: seeds with a wrong event; after: so many events that agree, median (inf: none"
        " differs); error: the largest of positions before the wrong event (g tau_dyn^2), median;"
        " bias: of the mean velocity against exact with the same disorder, 95 %; time: per"
        " half-cycle, median",
        style="dim",
    )
    say(f"[bold]{advice(data)}[/bold]")


def plan(
    scene: SceneName,
    /,
    *,
    settings: Settings = None,
    digits: Whole = "15",
    max_seconds: Patience = None,
    output: Printed = _PRINTED,
) -> None:
    """Say what a scene needs, which solver answers it and why, what it costs, how far to trust it.

    A solver that the scene names is never overridden. More than 8 members are printed in one line
    each; --json always holds every member in full.

    Exit status: 0 planned, 2 bad input, 3 the time was over before every member was planned.

    Parameters
    ----------
    digits : int
        Significant digits required of the trajectory.

    Examples
    --------
    exactcreep plan six-sliders-cycles
    exactcreep plan two-sliders-cycles --digits 40 --json
    """
    from exactcreep.studies.plan import plan_scene

    planned = scene_of(scene, settings)
    with shown(quiet=output.json) as display:
        plans = plan_scene(planned, digits=digits, max_seconds=max_seconds, progress=display.show)
    members, left = planned.settings(), ""
    if len(plans) < len(members):
        left = f"max_seconds was reached: {len(plans)} of {len(members)} members are planned"

    def tell() -> None:
        say_heading(planned.name, planned.title)
        _print_plans(plans, in_full=len(members) <= _MOST_IN_FULL)

    summary = of_members(planned.name, members, [plan.summary() for _, plan in plans])
    output.deliver(Answer(summary, tell, status=LIMIT if left else 0, remark=left))


def _print_plans(plans: Sequence[tuple[Mapping[str, Any], Plan]], *, in_full: bool) -> None:
    if in_full:
        for setting, plan in plans:
            if setting:
                say(settings_text(setting))
            _print_plan(plan)
        return
    words = [plan.sentence for _, plan in plans]
    for texts, alike in grouped([setting for setting, _ in plans], words):
        many = f" ({len(alike)} members)" if len(alike) > 1 else ""
        which = settings_text(dict(zip(plans[0][0], texts, strict=True)))
        say(f"{which}{many}: {words[alike[0]]}")


def _print_plan(plan: Plan) -> None:
    needs = [(one.name, "needed" if one.needed else "not needed", one.reason) for one in plan.needs]
    say_table(("", "", ""), needs, folded=("",), padding=(0, 2), show_header=False)
    say(f"[bold]{plan.finding}[/bold]: {plan.reason}")
    if plan.law:
        values = " or ".join(f"{value:.10g}" for value in plan.law)
        off = f" ± {plan.law_deviation:.2g}" if plan.law_deviation > 0 else ""
        which = "" if plan.solver == "law" else f" ({plan.law_name})"
        say(f"velocity per {plan.experiment.drive.per}: {values}{off}{which}")
    if plan.theorems:
        say("amplitudes: " + ", ".join(f"{k} {v:.6g}" for k, v in plan.theorems.items()))
    if not math.isnan(plan.events):
        cost = "not known" if math.isnan(plan.seconds) else f"about {duration(plan.seconds)}"
        say(f"cost: {cost} for {plan.events:.3g} events (by the first ten half-cycles)")
    elif plan.solver != "law":
        say("cost: not known")
    if plan.known_until is not None:
        targets = "half-cycles" if plan.experiment.drive.cyclic else "targets"
        say(f"trajectory: known to 1e-9 for the first {plan.known_until} {targets}")
