"""What a command prints: one JSON object, or a short summary for the eye."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exactcreep.quasistatic.result import Creep
    from exactcreep.solid import Descent

_JSON_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?([eE][+-]?\d+)?")


def as_json(value: Any, indent: str = "") -> str:
    """Return `value` as JSON; a decimal of a scene keeps every digit that was written."""
    from exactcreep.scene import Literal

    inner = indent + "  "
    if isinstance(value, Mapping):
        items = [f"{json.dumps(str(key))}: {as_json(part, inner)}" for key, part in value.items()]
        return _bracketed(items, "{}", indent)
    if isinstance(value, (list, tuple)):
        return _bracketed([as_json(part, inner) for part in value], "[]", indent)
    if isinstance(value, Literal) and _JSON_NUMBER.fullmatch(value):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return "null"
    return json.dumps(value)


def _bracketed(items: list[str], brackets: str, indent: str) -> str:
    if not items:
        return brackets
    lines = f",\n{indent}  ".join(items)
    return f"{brackets[0]}\n{indent}  {lines}\n{indent}{brackets[1]}"


Rows = list[tuple[str, Any]]
"""What is said line by line: a name and its value."""


def answered(
    study: Callable[..., Any],
    rows: Callable[[Any], Rows],
    draw: Callable[[Any, Path], None],
    *,
    out: Path | None = None,
    plot: Path | None,
    json: bool,
    force: bool,
    about: Mapping[str, Any] | None = None,
) -> Any:
    """Carry out a study, save its dataset, draw it, and print one JSON object, or the rows.

    The files are checked before: nothing is computed that could not be kept. The object begins
    with what it is `about`; what prints tables by itself returns no rows.
    """
    import typer

    from exactcreep.display import Display
    from exactcreep.quasistatic.files import check_output, check_plot, write_file
    from exactcreep.quasistatic.netcdf import netcdf

    if plot is not None:
        check_plot(plot, force=force)
    if out is not None:
        check_output(out, "out", force=force)
    with Display(quiet=json) as display:
        found = study(progress=display.show)
    if out is not None:
        write_file(out, netcdf({None: found.dataset()}), "out")
    if plot is not None:
        draw(found, plot)
    if json:
        typer.echo(as_json({**(about or {})} | found.summary()))
        return found
    if said := rows(found):
        print_rows(said)
    for path in (out, plot):
        if path is not None:
            typer.echo(f"written: {path}")
    return found


def print_rows(rows: Rows, *, soft_wrap: bool = True) -> None:
    """Print names and what they stand for, in two columns; a terminal wraps lines by default."""
    from rich.console import Console
    from rich.table import Table

    table = Table.grid(padding=(0, 2))
    for name, said in rows:
        table.add_row(name, str(said))
    Console(highlight=False).print(table, soft_wrap=soft_wrap)


def json_of_run(
    results: Sequence[Creep], settings: Sequence[Mapping[str, Any]], scene: str
) -> dict[str, Any]:
    """Return the object that ``--json`` prints for a scene."""
    if len(settings) == 1 and not settings[0]:
        return {"scene": scene} | results[0].summary()
    members = [
        {"set": dict(setting)} | result.summary()
        for setting, result in zip(settings, results, strict=False)
    ]
    return {"scene": scene, "members": members}


def print_heading(console: Any, scene: str, title: str) -> None:
    """Print which scene it is."""
    from rich.markup import escape

    words = f": {escape(title)}" if title else ""
    console.print(f"[bold]{escape(scene)}[/bold]{words}", soft_wrap=True)


def print_table(
    console: Any,
    names: Sequence[str],
    rows: Iterable[Sequence[str]],
    right: Sequence[str] = (),
    wrapped: Sequence[str] = (),
    **style: Any,
) -> None:
    """Print rows under the names of their columns, which stand to the right, or may be wrapped."""
    from rich.table import Table

    table = Table(box=None, padding=(0, 1), header_style="bold", **style)
    for name in names:
        justify: Any = "right" if name in right else "left"
        table.add_column(name, justify=justify, no_wrap=name not in wrapped)
    for row in rows:
        table.add_row(*row)
    console.print(table)


def print_summary(
    results: Sequence[Creep],
    settings: Sequence[Mapping[str, Any]],
    scene: str,
    title: str,
    descent: Descent | None = None,
) -> None:
    """Print the results of a run, the paper's prediction beside the measured value."""
    from rich.console import Console

    console = Console(highlight=False)
    print_heading(console, scene, title)
    console.print(_described(results[0], bool(settings and settings[0])), soft_wrap=True)
    if len(settings) == 1 and not settings[0]:
        _print_one(results[0], descent)
    else:
        _print_members(console, results, settings)


def _described(result: Creep, varied: bool) -> str:
    chain, experiment = result.chain, result.experiment
    options = "".join(f", {name} = {value}" for name, value in experiment.options.items())
    first = "first member: " if varied else ""
    return (
        f"{first}N = {chain.n}, l0 = {_short(chain.l0)}, mu_d = {_short(chain.mu_d)},"
        f" mu_s = {_short(chain.mu_s)}, sigma_mu = {_short(chain.sigma_mu)},"
        f" tan_alpha = {_short(chain.tan_alpha)}; solver {result.solver}{options},"
        f" seed {result.seed}"
    )


def _short(value: Any) -> str:
    return f"{float(value):.6g}"


def measured(result: Creep, digits: int = 6) -> str:
    """Return the velocity with its standard error."""
    if result.velocity_text is not None and result.velocity_enclosure is not None:
        radius = result.velocity_enclosure.radius
        known = f", known to {result.velocity_enclosure.radius_text()}" if radius else ""
        return f"{result.velocity_text} (standard error {result.velocity_error:.2g}{known})"
    if math.isnan(result.velocity):
        return "not known"
    if math.isinf(result.velocity):
        return "unbounded"
    error = result.velocity_error
    if math.isnan(error):
        return f"{result.velocity:.{digits}g}"
    if error < 1e-9 * abs(result.velocity) or error == 0:
        return f"{result.velocity:.{digits}g} ± {error:.2g}"
    places = max(0, 1 - math.floor(math.log10(error)))  # two digits of the error
    return f"{result.velocity:.{places}f} ± {error:.{places}f}"


def _predicted(result: Creep, digits: int = 6) -> tuple[str, str, tuple[float, ...]] | None:
    from exactcreep.laws import prediction

    found = prediction(result.chain, result.drive)
    if found is None or not found.printed:
        return None
    printed = " or ".join(f"{value:.{digits}g}" for value in found.printed)
    return f"paper, Eq. ({found.label})", printed, found.printed


def _print_one(result: Creep, descent: Descent | None) -> None:
    rows: Rows = []
    target = "half-cycle" if result.drive.cyclic else "target"
    since = "" if result.since is None else f" since cycle {result.since}"
    remark = f": {result.reason}" if result.reason else ""
    rows.append(("outcome", result.outcome.value + since + remark))
    rows.append((f"velocity per {result.drive.per}", measured(result)))
    if result.velocity_reason and math.isfinite(result.velocity):
        rows.append(("  standard error", f"not known: {result.velocity_reason}"))
    elif math.isnan(result.velocity):
        rows.append(("  because", result.velocity_reason))
    law = _predicted(result)
    if law is not None:
        below = not any(found > 0 for found in law[2]) and result.chain.tan_alpha > 0
        rows.append((f"  {law[0]}", law[1] + (" (below its threshold: none)" if below else "")))
    rows += [] if descent is None else descent.lines()
    rows.append(("evidence", _evidence(result)))
    if "chosen" in result.report:
        from exactcreep.solvers.auto import accuracy_told

        rows.append(("solver chosen", f"{result.report['chosen']}: {result.report['reason']}"))
        rows.append(("accuracy", accuracy_told(result.report)))
    rows.append((
        "counts",
        f"{result.half_cycles} {target}s, {result.rearrangements} rearrangements,"
        f" {result.event_count} events, {result.slip_count} slips",
    ))  # fmt: skip
    if result.long_rearrangements:
        rows.append(("accuracy", _accuracy(result.long_rearrangements)))
    rows += [("outside the model", f"{name}: {count}") for name, count in result.warnings.items()]
    rows.append(("time", f"{result.seconds:.3g} s"))
    print_rows(rows, soft_wrap=False)


def _accuracy(count: int) -> str:
    from exactcreep.solvers.exact.layout import PROMISED_EVENTS

    return (
        f"{count} rearrangement{'s' * (count > 1)} of more than {PROMISED_EVENTS} events, for which"
        " 1e-12 is not promised"
    )


def _evidence(result: Creep) -> str:
    ties = f", {result.undecided} comparisons by the model's rules" if result.undecided else ""
    return result.evidence.value + ties + (f": {result.course}" if result.course else "")


def grouped(
    settings: Sequence[Mapping[str, Any]], told: Sequence[Any]
) -> list[tuple[list[str], list[int]]]:
    """Return groups of members with equal results whose settings are neighbours.

    Parameters
    ----------
    settings : sequence of mapping
        Keys and values of each member.
    told : sequence
        What is printed of each member; it is compared by ``==``.

    Returns
    -------
    list of (list of str, list of int)
        Of each group the values of every key, a range as ``first … last``, and its members.
    """
    rows: list[tuple[list[list[Any]], list[int]]] = []
    for number, (setting, _) in enumerate(zip(settings, told, strict=False)):
        rows.append(([[value] for value in setting.values()], [number]))
    for column in reversed(range(len(settings[0]) if settings else 0)):
        kept: list[tuple[list[list[Any]], list[int]]] = []
        for values, members in rows:
            if kept and told[kept[-1][1][0]] == told[members[0]]:
                before = kept[-1][0]
                same = [one == other for one, other in zip(before, values, strict=True)]
                if all(same[:column]) and all(same[column + 1 :]):
                    before[column] += values[column]
                    kept[-1][1].extend(members)
                    continue
            kept.append((values, members))
        rows = kept
    return [([_range(values) for values in row], members) for row, members in rows]


def _range(values: Sequence[Any]) -> str:
    first = _setting_text(values[0])
    return first if len(values) == 1 else f"{first} … {_setting_text(values[-1])}"


def _print_members(
    console: Any, results: Sequence[Creep], settings: Sequence[Mapping[str, Any]]
) -> None:
    from exactcreep.quasistatic.result import known_of

    told = []
    for result in results:
        law = _predicted(result, digits=4)
        paper = law[1] if law is not None else ""
        numbers = measured(result, digits=4), paper, result.outcome.value, str(result.slip_count)
        told.append(numbers)
    rows = [
        (*setting, *told[members[0]], f"({len(members)} members)" * (len(members) > 1))
        for setting, members in grouped(settings, told)
    ]
    keys = [key.rpartition(".")[2] for key in settings[0]]
    names = (*keys, "velocity", "paper", "outcome", "slips", "")
    print_table(console, names, rows, right=("paper", "slips"))
    outcomes = Counter(result.outcome.value for result in results)
    evidence = Counter(result.evidence.value for result in results)
    missing = len(settings) - len(results)
    console.print(
        f"{len(results)} members: {_told(outcomes)}"
        + (f"; {missing} not run" if missing else "")
        + f"; {sum(result.seconds for result in results):.3g} s",
        soft_wrap=True,
    )
    known = known_of(results)
    console.print(
        f"{known} (evidence: {_told(evidence)})" if known else f"evidence: {_told(evidence)}",
        soft_wrap=True,
    )
    outside: Counter[str] = Counter()
    for result in results:
        outside.update(result.warnings)
    long = sum(result.long_rearrangements for result in results)
    if long:
        console.print(f"accuracy: {_accuracy(long)}", soft_wrap=True)
    if outside:
        console.print(f"outside the model: {_told(outside)}", soft_wrap=True)


def _told(counts: Counter[str]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.most_common())


def _setting_text(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_setting_text(part)}" for key, part in value.items())
    if isinstance(value, list):
        return f"({len(value)} values)"
    try:
        return f"{float(value):.6g}"
    except (TypeError, ValueError):
        return str(value)
