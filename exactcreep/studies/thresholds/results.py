"""What is found of a threshold, and what stands beside every one: the laws and theorems."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from fractions import Fraction
from typing import Any

import xarray as xr

from exactcreep.laws import edges, onset_amplitude, threshold_amplitude
from exactcreep.model.chain import Chain
from exactcreep.model.enclosure import enclosure
from exactcreep.model.numbers import Shown, nearest_float, plain_data
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, digits_of
from exactcreep.studies.event_log import LoggedEvent
from exactcreep.studies.fates.result import Fate

_OF_A_SIDE = "outcome", "evidence", "settled_after", "period", "advance", "direction", "reason"


def laws_beside(chain: Chain, digits: int = 12) -> dict[str, str | None]:
    """Return what the laws predict for a chain or its mirror image, as decimals; None: no law."""
    context = digits_of(math.ceil((digits + 10) * BITS_PER_DIGIT)).context
    rationals = chain.parameters() | {"tan_alpha": abs(chain.tan_alpha)}
    numbers = {name: context.mpf(v.numerator) / v.denominator for name, v in rationals.items()}
    about = {name: numbers[name] for name in ("n", "l0", "mu_d", "tan_alpha")}
    held = numbers["mu_s"]
    values = {
        "law_seuil": threshold_amplitude(**about),
        "law_corrected": onset_amplitude(**about, mu_s=held),
        "law_two_sliders": threshold_amplitude(**about | {"mu_d": held}) if chain.n == 2 else None,
    }
    return {name: v if v is None else enclosure(v).text(digits) for name, v in values.items()}


def _beside(chain: Chain, compare: str, digits: int = 12) -> dict[str, Any]:
    """Return what stands beside a threshold: laws, theorems, which of them are about the same."""
    return {**laws_beside(chain, digits), "theorems": edges(chain), "compare": compare}


def single_values(chain: Chain, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return what of a summary is text or a number, and the chain: attributes of a dataset."""
    single = {k: v for k, v in summary.items() if isinstance(v, (str, int, float))}
    return plain_data(chain.parameters()) | single


@dataclass(frozen=True)
class Edge:
    """An amplitude at which creep, or an advance in some cycle, begins or ends.

    Attributes
    ----------
    lower, upper : str
        Decimals that enclose it: at one of them the chain creeps (or advances), not at the other.
    begins : bool
        Whether creep begins there (it creeps at `upper`), or ends.
    evidence : Evidence
        Of what happens at `lower` and at `upper`.
    """

    lower: str
    upper: str
    begins: bool
    evidence: Evidence

    @property
    def middle(self) -> Fraction:
        """The middle of the bracket."""
        return (Fraction(self.lower) + Fraction(self.upper)) / 2

    def summary(self, what: str = "creep") -> dict[str, Any]:
        """Return the edge by names, ready for JSON; `what` begins or ends there."""
        begins, evidence = "begins" if self.begins else "ends", self.evidence.value
        return {"lower": self.lower, "upper": self.upper, what: begins, "evidence": evidence}


@dataclass(frozen=True)
class Difference:
    """The first event that differs across an edge; None: no further event on that side."""

    at_lower: LoggedEvent | None
    at_upper: LoggedEvent | None

    def summary(self) -> dict[str, Any]:
        """Return both events by names, ready for JSON."""
        return {name: event and event.summary() for name, event in vars(self).items()}


@dataclass(frozen=True, repr=False)
class Threshold(Shown):
    """An edge of what a chain does, with the laws beside it.

    Attributes
    ----------
    chain : Chain
    criterion : str
        ``lasting``: for ever; ``horizon``: in a given cycle (`after` of `threshold`).
    cycles : int
        Of ``horizon``: in the last of them the chain has to advance. Of ``lasting``: in so many it
        has to settle.
    digits : int
        Significant digits asked for.
    solver : str
    compare : str
        Which law it may be compared with.
    lower, upper : str or None
        Decimals: the chain does not creep (``horizon``: not advance in the last cycle) at `lower`,
        and does at `upper`. Where creep does not settle they are points of the scan: the last
        that locked, and the first that outlived the cycles. None for one slider.
    evidence : Evidence
        Of what happens at `lower` and at `upper`.
    direction : str
        Which way the chain creeps (or advances) at `upper`: ``downhill`` or ``uphill``; ``none`` if
        that is not known.
    outcome_at_lower : Outcome or None
        `AT_REST` (no event in a whole cycle, hence for ever), `CYCLING` (slips that return
        the chain to the same state); if neither within `cycles`, what it has come to after up to
        64 times as many in float64; None if it still does neither.
    outcome_evidence : Evidence
        Of `outcome_at_lower`: `PROVED` if the run is and the cycle has lone slips alone, which
        return the chain exactly; otherwise it has been seen to return, to within rounding.
    stable_digits : int or None
        Of ``horizon``: how many of the digits survive when `cycles` is doubled.
    deciding_event : Difference or None
        None if no event differs: the advance itself passes 1e-6 there.
    fates : pair of Fate or None
        What the chain does for ever at `lower` and at `upper`, of the criterion ``lasting``.
    sensitive : tuple of float
        Amplitudes at which starts 1e-13 apart part in float64, and no certified run has told the
        fate either: there the answer is that of float64, and may be wrong.
    windows : tuple of Edge
        Every edge of the scan, if asked for.
    preparations : mapping of int to Edge
        The threshold from each seeded start, if asked for; None where none was found.
    report : mapping
        How many runs of the solver it took; at how many amplitudes of the scan a certified run
        told the fate where float64 does not; if `outcome_at_lower` is None, ``transient``: how many
        ``cycles`` were followed in float64, the largest ``change`` of a tension in the last of
        them, and the ``power`` of the number of cycles like which the changes fall, if they do.
    reason : str
        Which limit ended the search, or that creep does not settle; "" if it was completed. What
        it had not come to is None, or missing from a list; `lower` and `upper` are as narrow as
        they had become.

    Examples
    --------
    >>> from exactcreep import Chain, threshold
    >>> found = threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12"), digits=12)
    >>> float(found.upper) > float(found.lower), found.evidence.value, found.outcome_at_lower.value
    (True, 'proved', 'at_rest')
    """

    chain: Chain
    criterion: str
    cycles: int
    digits: int
    solver: str
    compare: str
    lower: str | None = None
    upper: str | None = None
    evidence: Evidence = Evidence.UNDECIDED
    direction: str = "none"
    outcome_at_lower: Outcome | None = None
    outcome_evidence: Evidence = Evidence.COMPUTED
    stable_digits: int | None = None
    deciding_event: Difference | None = None
    fates: tuple[Fate | None, Fate | None] | None = None
    sensitive: tuple[float, ...] = ()
    windows: tuple[Edge, ...] | None = None
    preparations: Mapping[int, Edge | None] | None = None
    report: Mapping[str, Any] = field(default_factory=dict)
    reason: str = ""

    @property
    def law_seuil(self) -> str | None:
        """Eq. (seuil), as a decimal."""
        return laws_beside(self.chain, self.digits)["law_seuil"]

    @property
    def law_corrected(self) -> str | None:
        """Eq. (seuil) with the term that it drops."""
        return laws_beside(self.chain, self.digits)["law_corrected"]

    @property
    def law_two_sliders(self) -> str | None:
        """``(mu_s c - s)/l0``, for two sliders only."""
        return laws_beside(self.chain, self.digits)["law_two_sliders"]

    @property
    def what(self) -> str:
        """What begins at the edge."""
        return f"advance in cycle {self.cycles}" if self.criterion == "horizon" else "creep"

    def _facts(self) -> dict[str, Any]:
        names = "lower upper outcome_at_lower evidence direction criterion digits law_seuil"
        names += " solver reason"
        return {"n": self.chain.n} | {name: getattr(self, name) for name in names.split()}

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        names = ("lower", "upper", "cycles", "digits", "stable_digits", "solver", "criterion")
        out: dict[str, Any] = {name: getattr(self, name) for name in names} | {
            "outcome_at_lower": self.outcome_at_lower and self.outcome_at_lower.value,
            "outcome_evidence": self.outcome_evidence.value,
            "evidence": self.evidence.value,
            "direction": self.direction,
            "deciding_event": self.deciding_event and self.deciding_event.summary(),
        }
        out |= _beside(self.chain, self.compare, self.digits)
        what = self.what.split()[0]
        if self.criterion == "lasting":
            out["sensitive"] = list(self.sensitive)
        for name, one in zip(("fate_at_lower", "fate_at_upper"), self.fates or (), strict=False):
            known = one and one.summary()
            out[name] = known and {part: known[part] for part in _OF_A_SIDE}
        if self.windows is not None:
            out["windows"] = [edge.summary(what) for edge in self.windows]
        if self.preparations is not None:
            out["preparations"] = [
                {"seed": seed, "lower": None, "upper": None, **(e.summary(what) if e else {})}
                for seed, e in self.preparations.items()
            ]
        if self.reason:
            out["reason"] = self.reason
        return out | {"report": dict(self.report)}

    def dataset(self) -> xr.Dataset:
        """Return the edges of the scan along ``edge``, and all single values as attributes."""
        columns = ("lower", "upper", "begins")
        return xr.Dataset(
            {name: ("edge", [getattr(e, name) for e in self.windows or ()]) for name in columns},
            attrs=single_values(self.chain, self.summary()),
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Measured:
    """What the thresholds have in common that are measured with float64, from many starts."""

    chain: Chain
    cycles: int
    seed: int
    size: Fraction
    reason: str

    criterion = ""
    compare = ""

    @property
    def evidence(self) -> Evidence:
        """`COMPUTED`; `UNDECIDED` if a limit ended the measurement, or it does not fit the law."""
        return Evidence.UNDECIDED if self.reason else Evidence.COMPUTED

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        measured = {one.name: getattr(self, one.name) for one in fields(self)[1:]}
        about = {"criterion": self.criterion, "size": nearest_float(self.size)}
        about |= {"evidence": self.evidence.value} | _beside(self.chain, self.compare)
        return plain_data(measured | about)
