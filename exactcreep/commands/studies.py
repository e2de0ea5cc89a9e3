"""Commands that ask a question; about a chain, they are made from public functions."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from cyclopts import Parameter

import exactcreep
from exactcreep.commands.answer import (
    INTERRUPTED,
    LIMIT,
    Drawing,
    Output,
    Printed,
    drawing,
    duration,
    put,
    say,
    say_heading,
    say_rows,
    say_summary,
    say_table,
    shown,
)
from exactcreep.commands.values import (
    ChainOptions,
    Number,
    SceneName,
    Settings,
    Whole,
    scene_of,
    taken,
    whole,
)
from exactcreep.watch import interrupts

if TYPE_CHECKING:
    import xarray as xr

_FOR_EVER = "1e9"  # seconds: with a limit of time a study also checks for Ctrl-C
_UNSEEN = ("Hearer", "Executor")
"""Annotations of parameters that a command line cannot give."""
_KEYWORD = inspect.Parameter.KEYWORD_ONLY
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
            "--n 5 --after 20 --edges --json",
            "--n 30 --sigma-mu 0.01 --fit 1.3 2",
        ),
    ),
    "fate": Question(
        "Find out whether a chain without disorder rests, is locked (cycling) or creeps for ever.",
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
            "--n 6 --amplitude 0.000984 --plot lives.png",
        ),
    ),
}
_WRITTEN = Output()


def write_dataset(data: xr.Dataset, path: Path, *, force: bool) -> None:
    """Write a dataset to a NetCDF file, in one piece."""
    from exactcreep.quasistatic.netcdf import netcdf
    from exactcreep.quasistatic.writing import write_file

    write_file(path, netcdf({None: data}), "out", force=force)


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
            say_summary(summary)

        output.deliver(
            summary,
            tell,
            save=lambda path, force: write_dataset(result.dataset, path, force=force),
            draw=lambda: result.plot(),  # noqa: PLW0108 - matplotlib is imported only here
            status=INTERRUPTED if interrupted else LIMIT if limited else 0,
            remark="interrupted: this is the part known so far" if interrupted else "",
        )

    ask.__signature__ = _signature(public, about.group)  # type: ignore[attr-defined]
    ask.__doc__ = _docstring(public, [f"exactcreep {command} {line}" for line in about.examples])
    return ask


def _docstring(public: Callable[..., Any], examples: Sequence[str]) -> str:
    """Return a function's docstring and its parameters, with exit statuses and examples."""
    text, _, sections = f"{inspect.getdoc(public)}".replace("`", "").partition("\nParameters\n")
    status = "Exit status: 0 answered, 2 bad input, 3 a limit (with the part known so far).\n"
    parameters = sections.partition("\nReturns\n")[0]
    parameters = re.sub(r"(?<=\n) .*(\n .*)+", _unfolded, parameters)
    return "\n".join([text, status, "Parameters", parameters, "Examples", "--------", *examples])


def _unfolded(lines: re.Match[str]) -> str:
    return "    " + " ".join(lines[0].split())


def _signature(public: Callable[..., Any], group: type[Printed]) -> inspect.Signature:
    options = list[inspect.Parameter]()
    for own in inspect.signature(public).parameters.values():
        if own.name != "chain" and not any(word in str(own.annotation) for word in _UNSEEN):
            options.append(own.replace(kind=_KEYWORD, annotation=_kind(own)))
    chain = inspect.Parameter("chain", _KEYWORD, annotation=ChainOptions)
    output = inspect.Parameter("output", _KEYWORD, default=group(), annotation=group)
    return inspect.Signature([chain, *options, output])


def _kind(own: inspect.Parameter) -> Any:
    """Return the annotation of a parameter of a public function on the command line."""
    annotation = str(own.annotation)
    named: dict[str, Any] = {"name": _FLAGS[own.name]} if own.name in _FLAGS else {}
    if "State" in annotation:
        named = {"name": "--start-tension", "help": _START}
    if annotation == "bool":
        return Annotated[bool, Parameter(negative="", show_default=False, **named)]
    if "tuple[" in annotation:
        return Annotated[tuple[str, str] | None, taken("LO HI", **named)]
    metavar = "K" if "int" in annotation else "NAME" if annotation.startswith("str") else "X"
    return Annotated[str if own.default is own.empty else str | None, taken(metavar, **named)]


def compare(
    scene: SceneName,
    /,
    *,
    settings: Settings = None,
    dts: Annotated[str, taken("LIST")] = "0.1,0.03,0.01,0.003",
    digits: Annotated[str, taken("LIST")] = "20,100",
    events: Whole | None = None,
    seeds: Annotated[str | None, taken("SEEDS")] = None,
    max_seconds: Number | None = None,
    output: Output = _WRITTEN,
) -> None:
    """Say what a scene needs, and measure what accuracy costs.

    The table has for exact, certified, Verlet and the sliding limit, with the same disorder: the
    number of events until the first wrong one, the position error before it, the processor time per
    half-cycle (median of alternating repetitions, with their range), and the bias of the mean
    velocity with an interval of 95 %. If a scene has several members, only the first is compared;
    choose another with --set.

    Parameters
    ----------
    dts : LIST
        Time steps of verlet, unit tau_dyn.
    digits : LIST
        Decimal digits of certified. The true events are those with the most digits.
    events : int
        True events to compare for each seed. Default: by the number of sliders.
    seeds : SEEDS
        Compare over K seeds, or over a list: 1,2,3. Default: by the number of sliders.
    max_seconds : number
        Give up after this time, without a table.

    Examples
    --------
    exactcreep compare six-sliders-cycles
    exactcreep compare thirty-sliders-cycles --events 300 --json
    exactcreep compare six-sliders-cycles --seeds 16 --plot compared.png
    """
    from exactcreep.studies import comparison
    from exactcreep.studies.compare import ladder
    from exactcreep.studies.needs import needs
    from exactcreep.watch.limits import Limits

    Limits.of(max_seconds=max_seconds)
    compared = scene_of(scene, settings)
    first = compared.settings()[0]
    experiment = compared.experiment(first)
    balls = [whole(part.strip(), "digits") for part in digits.split(",")]
    methods = ladder(experiment, [part.strip() for part in dts.split(",")], balls)
    wanted: Any = whole(seeds, "seeds") if seeds is None or "," not in seeds else [
        whole(part.strip(), "seeds", 0) for part in seeds.split(",")
    ]  # fmt: skip
    many = whole(events, "events")
    output.check()
    if not output.json:
        say_heading(compared.name, compared.title)
        say_rows(needs(experiment).items())
    with shown(quiet=output.json) as display:
        data = exactcreep.compare(
            experiment, methods, events=many, seeds=wanted, progress=display.show
        )
    about, title = {"scene": compared.name, "set": first}, compared.title or compared.name

    save, tell = partial(write_dataset, data), partial(_print_compared, data)
    draw = drawing("compare:draw_compared", data, title)
    output.deliver({**about, **comparison.summary(data)}, tell, save=save, draw=draw)


def _print_compared(data: xr.Dataset) -> None:
    from exactcreep.studies.comparison import bias_text, sentence, table, unresolved

    def formatted(value: float, form: str) -> str:
        return "-" if math.isnan(value) else format(value, form)

    measured, rows = data.bias.notnull().values, []
    for known, (name, row) in zip(measured, table(data).iterrows(), strict=True):
        short = str(name).replace("dt = ", "")
        rows.append((
            short.replace(" digits", "").replace(",", ""), formatted(row.parted, ".0f"),
            formatted(row.agreed, ".0f"), formatted(row.error, ".1e"), duration(row.seconds),
            f"{duration(row.fastest)} to {duration(row.slowest)}",
            (bias_text(row) or "not resolved") if known else "-",
        ))  # fmt: skip
    names = ("parted", "after", "error", "time", "range", "bias %")
    say_table(("", *names), rows, right=names, collapse_padding=True, pad_edge=False)
    seeds, times = data.sizes["seed"], data.sizes["repetition"]
    put(f"{int(data.events.sum())} events of {data.truth}, {seeds} seed{'s' * (seeds > 1)}")
    say_rows((
        ("parted", "number of seeds with a wrong event"),
        ("after", "right events before the first wrong event, median; inf: none is wrong"),
        ("error", "of positions until a method is wrong, g tau_dyn^2, median; certified: proved"),
        ("time", f"processor time per half-cycle, median and range of {times} repetitions"),
        ("bias", "of the mean velocity against exact with the same disorder, at 95 %"),
        ("", f"{unresolved(data)} where this interval is wider than 10 %"),
    ))  # fmt: skip
    say(f"[bold]{sentence(data)}[/bold]")
