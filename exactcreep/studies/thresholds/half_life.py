"""The amplitude at which half of many starts still creep when a horizon is reached."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, Number, exact_number, nearest_float, whole_number
from exactcreep.studies.fates.survival import SIZE, Share, Survival, survival
from exactcreep.studies.thresholds.amplitudes import Bracket, Span, bisected, require_sense
from exactcreep.studies.thresholds.beside_laws import Measured
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import Limits, OutOfTime, Stop
from exactcreep.watch.progress import Hearer, Progress, reporter

_STEP = Fraction(23, 20)  # from one amplitude of the scan to the next
_LOWER = 10  # halvings of the lower end of a scan, if half of the starts creep there
_REFINED = 4  # bisections for each end of an interval


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class HalfLife(Measured):
    """The amplitude at which half of the starts still creep, either way, at the horizon.

    Attributes
    ----------
    chain, starts, cycles, seed, size
        As asked for.
    amplitude : float or None
        Between the last amplitude of a bisection at which fewer than half creep, and the first of
        more; None: not found in time.
    low, high : float or None
        Amplitudes at which the share that creeps is below, and above one half, at 95 %.
    shares : dict of float to Share
        Which part still creeps at the horizon, at every amplitude tried.
    directions : dict of float to dict of str to int
        How many of these creep ``downhill`` and ``uphill`` (on the level ``+x`` and ``-x``) there.
    reason : str
        Which limit ended the search; "" if it was completed.

    Examples
    --------
    >>> from exactcreep import Chain, half_life
    >>> chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> half_life(chain, starts=20, cycles=50).evidence.value
    'computed'
    """

    starts: int
    amplitude: float | None
    low: float | None
    high: float | None
    shares: dict[float, Share]
    directions: dict[float, dict[str, int]]

    criterion = "survival"
    compare = "no law: this amplitude grows with the horizon"

    def _numbers(self) -> dict[str, Any]:
        shares = [
            {"amplitude": a} | share._asdict() | {"directions": self.directions[a]}
            for a, share in sorted(self.shares.items())
        ]
        numbers = super()._numbers() | {"shares": shares}
        del numbers["directions"]
        return numbers

    def _columns(self) -> tuple[dict[str, Any], dict[str, Any]]:
        tried = sorted(self.shares)
        return {
            name: ("amplitude", [getattr(self.shares[a], name) for a in tried])
            for name in Share._fields
        }, {"amplitude": tried}


class _Search:
    """The amplitudes that were tried, and what many starts do at each."""

    def __init__(
        self, follow: Callable[..., Survival], span: Span, width: Fraction, limits: Limits, say: Any
    ) -> None:
        self.follow, self.span, self.width, self.limits, self.say = follow, span, width, limits, say
        self.tried: dict[Fraction, Survival] = {}
        self.first, self.last = span.scans[0][0], span.scans[-1][1]
        self.below = max(self.first, self.last / 10**6)
        scan = math.ceil(math.log(self.last / self.below) / math.log(_STEP))
        # the most amplitudes that it may take, for its progress
        self.most = 2 + scan * (span.bracket is None)
        self.most += math.ceil(math.log2(1 / width)) + 2 * _REFINED

    def share(self, amplitude: Fraction) -> Share:
        if amplitude not in self.tried:
            self.limits.require()
            done = len(self.tried)

            def followed(progress: Progress) -> None:
                part = done + progress.done / max(progress.total, 1)
                self.say("amplitudes", part, max(self.most, done + 1), "amplitudes")

            left = self.limits.seconds_left
            try:
                found = self.follow(amplitude, max_seconds=left, progress=followed)
            except KeyboardInterrupt:  # before its first start
                self.limits.require()
                raise
            if found.reason:
                raise OutOfTime(self.limits.reason(Stop.DEADLINE))
            self.tried[amplitude] = found
        return self.tried[amplitude].creeping

    def fewer(self, amplitude: Fraction) -> bool:
        return self.share(amplitude).high < 0.5

    def more(self, amplitude: Fraction) -> bool:
        return self.share(amplitude).low > 0.5

    def bracket(self) -> Bracket:
        """Return amplitudes between which one half is passed: those given, or of a scan upwards."""
        if self.span.bracket is not None:
            low, high = self.span.bracket
            if not (self.fewer(low) and self.more(high)):
                allowed = "must straddle one half: clearly fewer creep at LO, clearly more at HI"
                shares = f", not {self.share(low).share:.3g} and {self.share(high).share:.3g}"
                shown = f"{nearest_float(low)} {nearest_float(high)}"
                raise InputError("bracket", shown, allowed + shares)
            return low, high
        below = self.below
        for _ in range(_LOWER * self.span.free):
            if not self.fewer(below):
                below /= 2
        if not self.fewer(below):
            allowed = "must be lower: half of the starts creep"
            raise InputError("from", nearest_float(self.first), allowed)
        amplitude = below
        while amplitude < self.last:
            amplitude = min(amplitude * _STEP, self.last)
            if self.more(amplitude):
                return below, amplitude
            if self.fewer(amplitude):
                below = amplitude
        allowed = "must be higher: at no point of the scan do clearly more than half creep"
        raise InputError("to", nearest_float(self.last), allowed)

    def end(self, inner: Fraction, sure: Callable[[Fraction], bool]) -> Fraction:
        """Return the amplitude next to `inner` at which the share is surely on one side of 1/2.

        Bisected a few times, between `inner` and the nearest such amplitude that was tried.
        """
        outer = min((a for a in self.tried if sure(a)), key=lambda a: abs(a - inner))
        for _ in range(_REFINED):
            if abs(outer - inner) > self.width * inner:
                middle = (outer + inner) / 2
                outer, inner = (middle, inner) if sure(middle) else (outer, middle)
        return outer


@shows_progress
def half_life(
    chain: Chain,
    *,
    cycles: Number = 4000,
    starts: Number = 40,
    size: Number = SIZE,
    seed: Number = 0,
    low: Number | None = None,
    high: Number | None = None,
    bracket: tuple[Number, Number] | None = None,
    digits: Number = 3,
    workers: Number | None = None,
    progress: Hearer = None,
    max_seconds: Number | None = None,
) -> HalfLife:
    """Return the amplitude at which half of many starts still creep after `cycles` cycles.

    From six sliders on creep is chaotic, and just above its first edge a transient: there is no
    edge from which on it lasts. The amplitude grows with `cycles`.

    Parameters
    ----------
    chain : Chain
        Without disorder.
    cycles : int
        The horizon; see `survival`.
    starts : int
        How many are followed at each amplitude, at least 1.
    size : number
        Tensions of a start are uniform in (-size, size), unit m g.
    seed : int
        Of the starts.
    low, high : number, optional
        Ends of the scan; default 1/2 and 2 times Eq. 22, as of `threshold`.
    bracket : pair of numbers, optional
        Instead of a scan: fewer than half creep at the first, more at the second.
    digits : int
        Bisection ends at a relative width of ``10**-digits``.
    workers : int, optional
        Threads, default one for each processor.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.
    max_seconds : number, optional
        Come back after so much wall time with what is known; `reason` then says so.

    Returns
    -------
    HalfLife
        Where the share crosses one half more than once, one of the crossings.

    Raises
    ------
    InputError
        If an argument is out of range, the question has no sense for the chain, or the share does
        not pass one half.

    Notes
    -----
    Guarantee: none for `amplitude`, a statistic of these starts in float64. Fewer than half of all
    starts creep at `low`, and more at `high`, as far as the intervals of 95 % of the two shares
    hold. How many threads there are changes no number.

    Examples
    --------
    >>> from exactcreep import Chain
    >>> half = half_life(Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25"), cycles=50, starts=20)
    >>> half.low < half.amplitude < half.high
    True
    """
    require_sense(chain, "half_life")
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    span = Span.of(chain, low, high, bracket)
    width = Fraction(1, 10 ** whole_number(digits, "digits", least=1, most=12))
    asked: dict[str, Any] = {
        "starts": whole_number(starts, "starts", least=1),
        "cycles": whole_number(cycles, "cycles", least=1),
        "seed": whole_number(seed, "seed", least=0),
    }

    def follow(amplitude: Fraction, **how: Any) -> Survival:
        return survival(chain, amplitude, size=size, workers=workers, **asked, **how)

    search = _Search(follow, span, width, limits, say)
    at, fewer, more, reason = None, None, None, ""
    try:
        bracket = search.bracket()
        *_, (below, above) = bisected(*bracket, width, lambda a: search.share(a).share >= 0.5)
        at = (below + above) / 2
        fewer, more = search.end(below, search.fewer), search.end(above, search.more)
    except OutOfTime as limit:
        reason = str(limit)
        more = min(filter(search.more, search.tried), default=None)
        less = filter(search.fewer, search.tried)
        fewer = max((a for a in less if more is None or a < more), default=None)
    except InputError as refused:
        if chain.tan_alpha == 0 and refused.field == "to":
            allowed = "must not be 0: on the level no more than half creep anywhere in the scan"
            raise InputError("tan_alpha", 0, allowed) from None
        raise
    ends: dict[str, Any] = {
        name: None if end is None else nearest_float(end)
        for name, end in (("amplitude", at), ("low", fewer), ("high", more))
    }
    tried = {nearest_float(amplitude): lives for amplitude, lives in search.tried.items()}
    return HalfLife(
        chain=chain,
        size=exact_number(size, "size"),
        shares={a: lives.creeping for a, lives in tried.items()},
        directions={
            a: {way: share.starts for way, share in lives.directions.items()}
            for a, lives in tried.items()
        },
        reason=reason,
        **asked,
        **ends,
    )
