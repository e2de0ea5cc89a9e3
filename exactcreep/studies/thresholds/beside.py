"""What stands beside every threshold: the laws and theorems, and how a result is kept."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import Any

from exactcreep.laws import LAWS, edges
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import nearest_float, plain_data
from exactcreep.model.outcome import Evidence
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, digits_of
from exactcreep.quasistatic.decimals import enclosure


def beside(chain: Chain, compare: str, digits: int = 12) -> dict[str, Any]:
    """Return what stands beside a threshold: laws, theorems, which of them are about the same."""
    return {**laws_beside(chain, digits), "theorems": edges(chain), "compare": compare}


def laws_beside(chain: Chain, digits: int = 12) -> dict[str, str | None]:
    """Return what the laws predict for a chain or its mirror image, as decimals; None: no law."""
    context = digits_of(math.ceil((digits + 10) * BITS_PER_DIGIT)).context
    rationals = chain.parameters() | {"tan_alpha": abs(chain.tan_alpha)}
    numbers = {name: context.mpf(v.numerator) / v.denominator for name, v in rationals.items()}
    laws = {"law_seuil": ("seuil", "printed"), "law_corrected": ("seuil", "corrected")}
    if chain.n == 2:
        laws["law_two_sliders"] = ("threshold_th_2_cycle_corrected", "exact")
    found: dict[str, str | None] = dict.fromkeys((*laws, "law_two_sliders"))
    for name, (label, form) in laws.items():
        if label in LAWS:
            function = getattr(LAWS[label], form)
            given = {one: numbers[one] for one in function.required}
            found[name] = enclosure(function(**given)).text(digits)
    return found


def single_values(chain: Chain, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return what of a summary is text or a number, and the chain: attributes of a dataset."""
    single = {k: v for k, v in summary.items() if isinstance(v, (str, int, float))}
    return plain_data(chain.parameters()) | single


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
        about |= {"evidence": self.evidence.value} | beside(self.chain, self.compare)
        return plain_data(measured | about)
