"""``exactcreep threshold``: the amplitude above which a chain creeps, by four criteria."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

import exactcreep
from exactcreep.commands.answer import LIMIT, Output, Rows, complain, drawing
from exactcreep.commands.options import (
    MaxSeconds,
    OfChain,
    StartTension,
    Workers,
    command,
    flag,
    option,
    those_given,
)

if TYPE_CHECKING:
    from exactcreep import HalfLife, Intercept, Threshold

_EDGES, _STARTS = "Of horizon and lasting: ", "Of survival and intercept: "


def _text(metavar: str, text: str, *flags: str) -> Any:
    return Annotated[str | None, option(metavar, text, *flags)]


def _pair(text: str) -> Any:
    return Annotated[tuple[str, str] | None, option("LO HI", text)]


_OPTIONS = {
    "criterion": _text(
        "NAME",
        "horizon: it advances in cycle --cycles; lasting: it creeps for ever; survival:"
        " half of many starts still creep after --cycles; intercept: the straight part of v(A)"
        " meets zero. Default: horizon with --cycles; intercept with disorder; lasting up to"
        " five sliders, else survival.",
    ),
    "cycles": _text(
        "K",
        "Of horizon, default 20; of survival, default 4000; of intercept (for each"
        " amplitude), default 400.",
    ),
    "digits": _text("K", f"{_EDGES}significant digits, default 15; of survival: 3."),
    "low": _text(
        "A", "Of all but intercept: start of the scan; default half of Eq. (seuil).", "--from"
    ),
    "high": _text("A", "Of all but intercept: end of the scan; default twice Eq. (seuil).", "--to"),
    "points": _text(
        "M", f"{_EDGES}equal steps of the scan, default 1000; of intercept: amplitudes, default 12."
    ),
    "bracket": _pair("Of all but intercept: amplitudes that straddle the edge, instead of a scan."),
    "windows": Annotated[bool, flag("--windows", f"{_EDGES}list all edges of the scan.")],
    "refine": _text("K", f"{_EDGES}give the first K windows to all digits."),
    "start_tension": StartTension,
    "seeds": _text(
        "K",
        "Of horizon: also from K seeded starts, tensions up to --start-tension in size (or 1e-6).",
    ),
    "solver": _text(
        "NAME",
        f"{_EDGES}which decides: certified (default), exact (float64); of horizon also mpmath.",
    ),
    "starts": _text("K", "Of survival: number of starts, default 40."),
    "size": _text("R", f"{_STARTS}tensions of a start are within (-R, R), default 1e-3."),
    "seed": _text("SEED", f"{_STARTS}of starts and disorder."),
    "fit": _pair("Of intercept: range of the line in units of Eq. (seuil), default 1.2 and 2."),
    "workers": Workers,
}


@command(draws=True)
def threshold(
    chain: OfChain,
    asked: Annotated[dict[str, Any], those_given(_OPTIONS)],
    *,
    max_seconds: MaxSeconds = None,
    output: Output,
) -> None:
    """Find the amplitude of temperature cycles above which a chain creeps.

    What that means, --criterion says; an option that a criterion does not use is refused.

    Examples:

        exactcreep threshold --n 3 --digits 40

        exactcreep threshold --n 5 --cycles 20 --windows --refine 3 --json

        exactcreep threshold --n 6 --plot survival.png

        exactcreep threshold --n 30 --sigma-mu 0.01 --fit 1.3 2

    Exit status: 0 found, 2 bad input or no edge, 3 a limit was reached, creep does not settle, or
    v(A) is no straight line (what is known is shown).
    """
    find = partial(exactcreep.threshold, chain, max_seconds=max_seconds, **asked)
    try:
        found = output.answer(find, _rows, drawing("thresholds:draw_threshold"))
    except exactcreep.GivenUp as limit:
        complain(str(limit))
        raise typer.Exit(LIMIT) from None
    if found.reason:
        raise typer.Exit(LIMIT)


def _rows(found: Threshold | HalfLife | Intercept) -> Rows:
    known = found.summary()
    rows: Rows = [
        ("paper, Eq. (seuil)", known["law_seuil"]),
        ("corrected, (N m + D)/(2 l0)", known["law_corrected"]),
    ]
    if known["law_two_sliders"] is not None:
        rows.append(("two sliders, (mu_s c - s)/l0", known["law_two_sliders"]))
    if isinstance(found, exactcreep.HalfLife):
        rows += _of_half_life(found)
    elif isinstance(found, exactcreep.Intercept):
        rows += _of_intercept(found)
    else:
        rows += _of_edge(found)
    rows += [("evidence", found.evidence.value), ("to be compared with", found.compare)]
    if found.reason:
        name = "because" if found.criterion == "intercept" else "incomplete"
        rows.append((name, found.reason))
    return rows


def _of_edge(found: Threshold) -> Rows:
    from exactcreep.studies.fates.result import movers

    if found.lower is None:
        none = "none: one slider has no spring, and stays at rest"
        return [("threshold", "not found yet" if found.reason else none)]
    outcome = found.outcome_at_lower
    rest = _passing(found) if outcome is None else outcome.value
    rows: Rows = [
        (f"no {found.what} at", found.lower),
        (f"{found.what} at", found.upper),
        ("below", f"{rest} ({found.outcome_evidence.value})"),
    ]
    if found.stable_digits is not None:
        name = f"with {2 * found.cycles} cycles"
        rows.append((name, f"{found.stable_digits} digits are the same"))
    for side, fate in zip(("below", "above"), found.fates or (), strict=False):
        if fate is not None and fate.period is not None:
            says = f"{fate.outcome.value} since cycle {fate.settled_after}"
            says += f", period {fate.period} ({fate.evidence.value})"
            rows.append((f"for ever {side}", says))
    if (sides := found.deciding_event) is not None:
        for side, place in (("below", sides.at_lower), ("above", sides.at_upper)):
            says = "none"
            if place is not None:
                who = movers(place.event.sliders, place.event.signs)
                says = f"{place.event.kind.value} of {who} in half-cycle {place.half_cycle}"
            rows.append((f"first event that differs {side}", says))
    if found.sensitive:
        rows.append(("float64 alone knows", f"{len(found.sensitive)} amplitudes, where it may err"))
    for edge in found.windows or ():
        name = f"{found.what} {'begins' if edge.begins else 'ends'}"
        rows.append((name, f"between {edge.lower} and {edge.upper}"))
    for seed, start in (found.preparations or {}).items():
        says = "none found" if start is None else f"between {start.lower} and {start.upper}"
        rows.append((f"start {seed}", says))
    return rows


def _passing(found: Threshold) -> str:
    """Return what is known of a transient."""
    known = found.report.get("transient")
    if known is None:
        return "a transient"
    words = f"a transient: tensions change by {known['change']:.1e} in cycle {known['cycles']}"
    if "power" in known:
        words += f", less and less as cycles^{known['power']:.2f}"
    return words


def _of_half_life(found: HalfLife) -> Rows:
    rows: Rows = []
    if found.amplitude is not None:
        rows.append((f"half still creep after {found.cycles} cycles at", f"{found.amplitude:.9g}"))
    for name, end in (("fewer", found.low), ("more", found.high)):
        shown = "not known" if end is None else f"{end:.9g}"
        rows.append((f"clearly {name} than half (95 %) at", shown))
    return [*rows, ("starts", f"{found.starts} at each of {len(found.shares)} amplitudes")]


def _of_intercept(found: Intercept) -> Rows:
    measured = ("amplitudes measured", found.amplitudes.size)
    if math.isnan(found.intercept):
        return [measured]
    law = f"  ({found.intercept / found.law_seuil:.4f} of Eq. (seuil))"
    return [
        ("v(A) meets zero at", f"{_with_error(found.intercept, found.error)}{law}"),
        ("  shift over other ranges", f"{found.systematic:.2g}"),
        ("slope", _with_error(found.slope, found.slope_error)),
        (
            "  paper, (N + 3 - 2i) l0",
            "no one i" if math.isnan(found.law_slope) else found.law_slope,
        ),
        ("chi2", f"{found.chi2:.3g} (probability {found.chi2_probability:.3g})"),
        measured,
    ]


def _with_error(value: float, error: float) -> str:
    return f"{value:.6g}" + ("" if math.isnan(error) else f" ± {error:.2g}")
