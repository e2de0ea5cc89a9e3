"""The amplitude at which half of many starts still creep when a horizon is reached.

From six sliders on creep is chaotic, and just above its first edge a transient: there is no edge
from which on it lasts, but one can say how long it lives. The amplitude grows with the horizon.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import xarray as xr

from exactcreep.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import (
    InputError,
    exact_number,
    nearest_float,
    plain_data,
    whole_number,
)
from exactcreep.model.outcome import Evidence
from exactcreep.studies.fates.fate import refuse_sliding
from exactcreep.studies.fates.survival import SIZE, Share, survival
from exactcreep.studies.thresholds.edges import beside, single_values

_STEP = Fraction(23, 20)  # from one amplitude of the scan to the next
_LOWER = 10  # halvings of the lower end of a scan, if half of the starts creep there
_REFINED = 4  # bisections for each end of an interval


@dataclass(frozen=True, eq=False)
class HalfLife:
    """The amplitude at which half of the starts still creep at the horizon.

    Attributes
    ----------
    chain : Chain
    starts, cycles, seed : int
    size : Fraction
        Largest tension of a start, unit m g.
    amplitude : float or None
        Between the last amplitude of a bisection at which fewer than half creep, and the first of
        more; None: not found in time.
    low, high : float or None
        Amplitudes at which the share that creeps is below, and above one half, at 95 %.
    shares : dict of float to Share
        Which part still creeps at the horizon, at every amplitude tried.
    reason : str
        Which limit ended the search; "" if it was completed.

    Examples
    --------
    >>> from exactcreep import Chain, threshold
    >>> chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> half = threshold(chain, criterion="survival", starts=20, cycles=50)
    >>> half.low < half.amplitude < half.high
    True
    """

    chain: Chain
    starts: int
    cycles: int
    seed: int
    size: Fraction
    amplitude: float | None
    low: float | None
    high: float | None
    shares: dict[float, Share]
    reason: str = ""

    criterion = "survival"
    compare = "no law: this amplitude grows with the horizon"

    @property
    def evidence(self) -> Evidence:
        """Measured with float64: `COMPUTED`; `UNDECIDED` if a limit ended the search."""
        return Evidence.UNDECIDED if self.reason else Evidence.COMPUTED

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        names = ("criterion", "amplitude", "low", "high", "starts", "cycles", "seed")
        shares = [{"amplitude": a} | share._asdict() for a, share in sorted(self.shares.items())]
        return plain_data(
            {name: getattr(self, name) for name in names}
            | {"size": nearest_float(self.size), "evidence": self.evidence.value}
            | beside(self.chain, self.compare)
            | {"shares": shares, "reason": self.reason}
        )

    def dataset(self) -> xr.Dataset:
        """Return the shares along ``amplitude``, and all single values as attributes."""
        tried = sorted(self.shares)
        columns = {
            name: ("amplitude", [getattr(self.shares[a], name) for a in tried])
            for name in Share._fields
        }
        about = single_values(self.chain, self.summary())
        found = about.pop("amplitude", math.nan)
        return xr.Dataset(columns, {"amplitude": tried}, about | {"half_life": found})


@dataclass
class _Tried:
    """The amplitudes that were tried, and which part of the starts still creeps at each."""

    chain: Chain
    given: dict[str, Any]
    limits: Limits
    say: Callable[..., None]
    shares: dict[Fraction, Share] = field(default_factory=dict)

    def share(self, amplitude: Fraction) -> Share:
        """Return which part still creeps at an amplitude."""
        if amplitude not in self.shares:
            self.limits.require()
            found = survival(
                self.chain, amplitude, max_seconds=self.limits.seconds_left, **self.given
            )
            if found.reason:
                raise OutOfTime(self.limits.reason(Stop.DEADLINE))
            self.shares[amplitude] = found.creeping
            self.say("amplitudes", len(self.shares), 0, "amplitudes")
        return self.shares[amplitude]

    def fewer(self, amplitude: Fraction) -> bool:
        """Return whether clearly fewer than half creep."""
        return self.share(amplitude).high < 0.5

    def more(self, amplitude: Fraction) -> bool:
        """Return whether clearly more than half creep."""
        return self.share(amplitude).low > 0.5

    def given_bracket(self, low: Fraction, high: Fraction) -> tuple[Fraction, Fraction]:
        """Return a bracket, if one half lies between its ends."""
        if not (self.fewer(low) and self.more(high)):
            allowed = "must straddle one half: clearly fewer creep at LO, clearly more at HI"
            shares = f", not {self.share(low).share:.3g} and {self.share(high).share:.3g}"
            shown = f"{nearest_float(low)} {nearest_float(high)}"
            raise InputError("bracket", shown, allowed + shares)
        return low, high

    def scanned(self, low: Fraction, high: Fraction, free: bool) -> tuple[Fraction, Fraction]:
        """Return the first amplitudes of a scan upwards between which one half is passed.

        `free`: it may begin lower if need be.
        """
        below = max(low, high / 10**6)
        for _ in range(_LOWER * free):
            if self.fewer(below):
                break
            below /= 2
        if not self.fewer(below):
            raise InputError("from", nearest_float(low), "must be lower: half of the starts creep")
        amplitude = below
        while amplitude < high:
            amplitude = min(amplitude * _STEP, high)
            if self.more(amplitude):
                return below, amplitude
            if self.fewer(amplitude):
                below = amplitude
        allowed = "must be higher: at no point of the scan do clearly more than half creep"
        raise InputError("to", nearest_float(high), allowed)

    def end(self, inner: Fraction, width: Fraction, sure: Callable[[Fraction], bool]) -> Fraction:
        """Return the amplitude next to `inner` at which the share is surely on one side of 1/2.

        Bisected a few times, between `inner` and the nearest such amplitude that was tried.
        """
        outer = min((a for a in self.shares if sure(a)), key=lambda a: abs(a - inner))
        for _ in range(_REFINED):
            if abs(outer - inner) <= width * inner:
                break
            middle = (outer + inner) / 2
            if sure(middle):
                outer = middle
            else:
                inner = middle
        return outer


def half_life(
    chain: Chain,
    *,
    bracket: tuple[Fraction, Fraction] | None = None,
    ends: tuple[Fraction, Fraction],
    free: bool,
    starts: int = 40,
    size: Any = SIZE,
    cycles: int = 4000,
    seed: int = 0,
    digits: int = 3,
    workers: int | None = None,
    limits: Limits = NO_LIMITS,
    say: Callable[..., None],
) -> HalfLife:
    """Return the amplitude at which half of the starts still creep after `cycles` cycles.

    Parameters
    ----------
    chain : Chain
        Without disorder.
    bracket : pair of Fraction, optional
        Amplitudes: clearly fewer than half creep at the first, clearly more at the second.
    ends : pair of Fraction
        Of the scan for such a bracket.
    free : bool
        Whether the scan may begin lower if need be.
    starts, size, cycles, seed, workers
        As of `survival`.
    digits : int
        Bisection ends at a relative width of ``10**-digits``.
    limits : Limits
    say : callable

    Returns
    -------
    HalfLife
        The amplitude and its interval; where the share crosses one half more than once, one of the
        crossings. Out of time, what is known.

    Raises
    ------
    InputError
        If an argument is out of range, or the share does not pass one half.
    """
    refuse_sliding(chain)
    if chain.n < 2:
        raise InputError("n", chain.n, "must be at least 2: one slider has no spring")
    width = Fraction(1, 10 ** whole_number(digits, "digits", least=1, most=12))
    given = {"starts": starts, "size": size, "cycles": cycles, "seed": seed, "workers": workers}
    tried = _Tried(chain, given, limits, say)
    at, fewer, more, reason = None, None, None, ""
    try:
        below, above = tried.given_bracket(*bracket) if bracket else tried.scanned(*ends, free)
        while above - below > width * above:
            middle = (below + above) / 2
            if tried.share(middle).share < 0.5:
                below = middle
            else:
                above = middle
        at = nearest_float((below + above) / 2)
        fewer = tried.end(below, width, tried.fewer)
        more = tried.end(above, width, tried.more)
    except OutOfTime as limit:
        reason = str(limit)
        surely = [a for a in sorted(tried.shares) if tried.more(a)]
        more = surely[0] if surely else None
        less = [a for a in tried.shares if tried.fewer(a) and (more is None or a < more)]
        fewer = max(less, default=None)
    low, high = (None if end is None else nearest_float(end) for end in (fewer, more))
    shares = {nearest_float(amplitude): share for amplitude, share in tried.shares.items()}
    return HalfLife(
        chain, starts, cycles, seed, exact_number(size, "size"), at, low, high, shares, reason
    )
