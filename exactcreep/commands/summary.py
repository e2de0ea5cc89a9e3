"""What is printed of a run: its velocity beside the predicted one, or a table of members."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exactcreep.commands.answer import (
    Rows,
    counted,
    grouped,
    of_members,
    say,
    say_heading,
    say_rows,
    say_table,
)
from exactcreep.model.outcome import behaviour

if TYPE_CHECKING:
    from exactcreep import Creep, Descent


@dataclass(frozen=True)
class Summary:
    """The results of the members of a scene, as they are printed and drawn.

    Attributes
    ----------
    results : sequence of Creep
        Of the first members, or of all.
    settings : sequence of mapping
        What each member sets.
    scene, title : str
    descent : Descent or None
        What a single run comes to in millimetres.
    """

    results: Sequence[Creep]
    settings: Sequence[Mapping[str, Any]]
    scene: str
    title: str
    descent: Descent | None

    def as_dict(self) -> dict[str, Any]:
        """Return the object that ``--json`` prints."""
        told = of_members(self.scene, self.settings, [one.summary() for one in self.results])
        return told | ({} if self.descent is None else {"descent": self.descent.summary()})

    def draw(self, plot: Path) -> None:
        """Draw the runs, or the descent, to a file."""
        from exactcreep.figures.runs import draw_descent, draw_run

        if self.descent is not None:
            draw_descent(self.descent, plot, title=self.title)
        else:
            draw_run(self.results, plot, settings=self.settings, title=self.title)

    def print(self) -> None:
        """Print the results, the paper's prediction beside the measured value."""
        first = self.results[0]
        names = ("l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha")
        numbers = "".join(f", {name} = {float(getattr(first.chain, name)):.6g}" for name in names)
        options = "".join(f", {name} = {v}" for name, v in first.experiment.options.items())
        say_heading(self.scene, self.title)
        say(
            f"{'first member: ' * bool(self.settings[0])}N = {first.chain.n}{numbers};"
            f" solver {first.solver}{options}, seed {first.seed}"
        )
        if len(self.settings) > 1 or self.settings[0]:
            _print_members(self.results, self.settings)
        else:
            _print_one(first, self.descent)


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


def _predicted(result: Creep) -> tuple[str, tuple[float, ...]]:
    """Return the label of the paper's equation for a run, and its velocities where it holds."""
    from exactcreep.laws import prediction

    found = prediction(result.chain, result.drive)
    if found is None:
        return "", ()
    holds = result.chain.tan_alpha <= 0 or any(value > 0 for value in found.printed)
    return found.label, found.printed if holds else ()


def _either(velocities: Sequence[float], digits: int) -> str:
    return " or ".join(f"{value:.{digits}g}" for value in velocities)


def _print_one(result: Creep, descent: Descent | None) -> None:
    since = "" if result.since is None else f" since cycle {result.since}"
    remark = f": {result.reason}" if result.reason else ""
    rows: Rows = [
        ("outcome", behaviour(result.outcome, result.direction) + since + remark),
        (f"velocity per {result.drive.per}", measured(result)),
        ("  of", result.velocity_of),
    ]
    rows += [("  but", result.metastable)] if result.metastable else []
    if result.velocity_reason and math.isfinite(result.velocity):
        rows.append(("  standard error", f"not known: {result.velocity_reason}"))
    elif math.isnan(result.velocity):
        rows.append(("  because", result.velocity_reason))
    label, law = _predicted(result)
    if label:
        words = _either(law, 6) if law else "none: below its threshold"
        rows.append((f"  paper, Eq. ({label})", words))
    rows += [] if descent is None else descent.lines()
    ties = f", {result.undecided} comparisons by the model's rules" if result.undecided else ""
    course = f": {result.course}" if result.course else ""
    rows.append(("evidence", result.evidence.value + ties + course))
    if "accuracy" in result.report:
        from exactcreep.quasistatic.creep import accuracy_reached

        rows.append(("accuracy", accuracy_reached(result.report)))
    target = "half-cycles" if result.drive.cyclic else "targets"
    told = f"{result.half_cycles} {target}, {result.rearrangements} rearrangements"
    rows.append(("counts", f"{told}, {result.event_count} events, {result.slip_count} slips"))
    if result.long_rearrangements:
        rows.append(("accuracy", _accuracy(result.long_rearrangements)))
    rows += [("outside the model", f"{name}: {count}") for name, count in result.warnings.items()]
    rows.append(("time", f"{result.seconds:.3g} s"))
    say_rows(rows)


def _accuracy(count: int) -> str:
    from exactcreep.solvers.exact.layout import PROMISED_EVENTS

    return (
        f"{count} rearrangement{'s' * (count > 1)} of more than {PROMISED_EVENTS} events, for which"
        " 1e-12 is not promised"
    )


def _print_members(results: Sequence[Creep], settings: Sequence[Mapping[str, Any]]) -> None:
    from exactcreep.quasistatic.course import known_of

    told = [
        (
            measured(one, 4),
            _either(_predicted(one)[1], 4),
            behaviour(one.outcome, one.direction),
            str(one.slip_count),
        )
        for one in results
    ]
    rows = [
        (*setting, *told[members[0]], f"({len(members)} members)" * (len(members) > 1))
        for setting, members in grouped(settings, told)
    ]
    keys = [key.rpartition(".")[2] for key in settings[0]]
    names = (*keys, "velocity", "paper", "outcome", "slips", "")
    say_table(names, rows, right=("paper", "slips"), folded=keys)
    missing = len(settings) - len(results)
    say(
        f"{len(results)} members: {counted(row[2] for row in told)}"
        + (f"; {missing} not run" if missing else "")
        + f"; {sum(one.seconds for one in results):.3g} s"
    )
    known, evidence = known_of(results), counted(one.evidence.value for one in results)
    say(f"{known} (evidence: {evidence})" if known else f"evidence: {evidence}")
    if sentences := [one.metastable for one in results if one.metastable]:
        say(f"{len(sentences)} members creep, but {sentences[0]}")
    if long := sum(one.long_rearrangements for one in results):
        say(f"accuracy: {_accuracy(long)}")
    if outside := sum((Counter(one.warnings) for one in results), Counter()):
        say(f"outside the model: {counted(outside)}")
