"""Memory layout of the compiled exact solver: the rows of its arrays, and its scalars.

The loop works on arrays that Python owns: `cell` and `whole` (one column for each slider),
`deviate` (one row for each slider: the batch that holds its next draw), `clock` (`CLOCKS` rows of
eight lanes for each strip of eight sliders, see `local_clocks`; None in short chains), `series`
(`SERIES` rows for each strip of the moving window; None until two sliders move together, which
saves compiling most of the code), `now` (one `NOW`) and `log` (rows of `LOGGED_EVENT`).

The rows of a slider's column:

| row | meaning |
|---|---|
| `cell` | float64; forces in m g, lengths in g tau_dyn**2 |
| FORCE, FORCE_LOW | the force at rest, of sliders 1 and N without theta: two floats, to 2**-106 |
| REST | the force at rest with theta |
| EXCESS | effective (mu_s,n - mu_d) cos(alpha), never negative |
| STIFFNESS | springs that hold the slider: 2, at an end 1, alone 0 |
| TRAVEL, TRAVEL_LOW | the displacement from the start of the simulation to the last rest |
| X | the displacement since the start of the rearrangement |
| SPEED | the velocity in the direction of motion, never negative |
| SIDE | the direction of motion, +1 downhill, -1 uphill; 0 at rest |
| FRESH | 1 while a slider that has started has not moved yet |
| DRIVE | force minus friction, along the motion, with which it started |
| COEFFICIENT | the static coefficient, as drawn |
| DOUBTED | number of the rearrangement in which it was last counted as undecided |
| FRICTION | mu_d,n cos(alpha) |
| WEIGHT | sin(alpha), at an end with the force that pulls there |
| MU_D, MU_D_LOW | mu_d,n: two floats |
| MEAN, MEAN_EXCESS | the mean of its static coefficients, and the excess of a contact that has it |
| RATE, RATE_LOW | change of the force on it per ``l0 theta``: two floats |
| `whole` | int64 |
| DRAWS | static coefficients drawn so far |
| SLIPS | slips since the last target, where they are recorded |
| EVENT | column of the k-th slider of the present event (in column k) |
| STOPPED | whether that slider has stopped in this event, else 0 |
| DRIVEN | column of the k-th slider that feels theta (in column k) |
"""

from __future__ import annotations

import numpy as np

from exactcreep.solvers.tables import EVENT_TABLE

ORDERS = 24
"""Number of Taylor coefficients of a velocity; even."""
HORIZON = 1.0
"""Longest step of a cluster, in units of tau_dyn."""
EPOCH = 0.5625
"""Time between two expansions of a whole long cluster, in units of tau_dyn."""
KNOWN = 20
"""Taylor coefficients stored for an epoch; a multiple of four."""
LONGEST_SHORT = 249
"""Chains up to this length are always expanded as a whole, which is faster there (measured)."""
LEAST_LONG = 48
"""In longer chains a cluster is long if so many sliders are between its ends (measured)."""
PAD = 18
"""Slider n is in column n - 1 + PAD; columns outside the chain never move."""
TAIL = 24
"""Columns after the last slider, into which a window may reach."""
NEVER = 1e300
"""Excess of a column outside the chain: a threshold that no force reaches."""
ULP = 2.0**-52
MOST_WORK = 2**21
"""Most work of one call of the compiled loop, in units of about 5 ns: a hundredth of a second."""
AT_REST_OFF, EVENT_OFF = 4.0 * ULP, 0.5 * ULP
"""Error of forces at rest at the start of a rearrangement, and its growth with each event.

They are in units of the largest force or displacement. The loop rounds by 0.1 ulp, averaged over
movers, and by at most 0.4 in nine of ten steps (compared with 50 digits from event to event). The
estimate assumes that all errors have the same sign. For amplification by events see
`motion.amplified`.
"""
PROMISED_EVENTS = 200
"""A run whose last rearrangement has not ended after so many events is undecided.

No copies are compared before the next target. Measured against the certified solver at N = 2 .. 12
and mu_d from 0.001 to 0.6: the largest error of 1740 rearrangements up to this length was 1.2e-13;
the shortest with an error above 1e-12 had 496 events.
"""

(
    FORCE, FORCE_LOW, REST, EXCESS, STIFFNESS, TRAVEL, TRAVEL_LOW, X, SPEED, SIDE, FRESH, DRIVE,
    COEFFICIENT, DOUBTED, FRICTION, WEIGHT, MU_D, MU_D_LOW, MEAN, MEAN_EXCESS, RATE, RATE_LOW,
) = range(22)  # rows of `cell`, see above  # fmt: skip
CELLS = 22
OF_CHAIN = slice(FRICTION, CELLS)
"""Rows of `cell` that depend only on the chain; a leg has its own rates (`pack.turn`)."""
DRAWS, SLIPS, EVENT, STOPPED, DRIVEN = range(5)  # rows of `whole`
WHOLES = 5
AT_REST_ROWS = [
    FORCE, FORCE_LOW, TRAVEL, TRAVEL_LOW, COEFFICIENT, EXCESS, DOUBTED, RATE, RATE_LOW,
]  # fmt: skip
"""Rows of `cell` from which a chain at rest goes on, with the rows of `whole` before EVENT."""

# rows of each strip of `series`, float64: first the derivatives 0 .. ORDERS of the margins, then
(
    AT_END,  # margins at the end of the step
    SLOPE_AT_END,
    MOVED,  # the movers' displacements during the step
    BENT,  # bounds of their fourth derivatives during the step
    CROSSING,  # when the margin leaves its range
    MOVES,  # 1 for a mover, else 0
    RESTS,  # the opposite
    HOLDS,  # minus the stiffness for a mover, else 0
) = range(ORDERS + 1, ORDERS + 9)
SERIES = ORDERS + 9
LADDER = (ORDERS + 9) // 8
"""Rows after all strips: the factors between a series' terms at the end of a step."""

# rows of each strip of `clock`, float64: first the derivatives 0 .. KNOWN + 1 of the margins, then
(
    BASE,  # time of the epoch at which the series begins
    KEY,  # the margin is certified to stay in its range until then
    ROOT,  # when it leaves its range
    GUESS,  # when it may leave its range
    NOW_X,  # X and SPEED around the last event, at its time
    NOW_SPEED,
    BLUR,  # uncertainty of ROOT
    MOVED_THEN,  # three rows like MOVES, RESTS and HOLDS, at the beginning of the epoch
) = range(KNOWN + 2, KNOWN + 10)
CLOCKS = KNOWN + 13
"""An odd number, so that strips do not share cache lines.

After all strips follow rows with the first key of each strip.
"""

CHAIN = np.dtype(
    [
        ("friction", np.float64),  # the largest mu_d cos(alpha), but for sliders held like nails
        ("least_friction", np.float64),
        ("mean_friction", np.float64),
        ("mean_weight", np.float64),  # sin(alpha), plus the end forces over n
        ("cosine", np.float64),
        ("width", np.float64),  # standard deviation of the static coefficients
        ("n", np.int64),
        ("seed", np.int64),
        ("constant", np.int64),  # whether every static coefficient is the mean of its slider
        ("even", np.int64),  # whether all springs expand alike
        ("driven", np.int64),  # sliders whose force depends on theta; see DRIVEN
        ("downhill", np.int64),  # the direction in which the chain can run away, 0 if it cannot
        ("longest", np.int64),  # events of an avalanche, or steps without one, before giving up
        ("logging", np.int64),  # whether `log` stores events
    ]
)
"""Constants: the chain, its disorder, and what is recorded."""
TALLY = ("rearrangements", "events", "slips", "below", "undecided")
"""`below` counts draws below mu_d."""
COUNTERS = np.dtype(
    [
        *((name, np.int64) for name in TALLY),
        ("work", np.int64),  # of clusters, in units of about 5 ns
        ("calm", np.int64),  # steps of clusters since the last event
        ("target", np.int64),  # number of the target ahead
    ]
)
"""Counts since the start; a snapshot holds them as they are."""
LOCAL = np.dtype(
    [
        ("time", np.float64),  # since the beginning of the epoch
        ("wild", np.float64),  # bound of velocities and accelerations in the epoch
        ("spent", np.float64),  # part of the epoch's error budget that is used
        ("on", np.int64),  # whether sliders keep the series of their own last change
        ("centre", np.int64),  # column around which series will be renewed
        ("left", np.int64),  # strips that the epoch has reached
        ("right", np.int64),
        ("retry", np.int64),  # steps until a long cluster is tried as such again
    ]
)
"""The epoch of a long cluster, see `local_clocks`; at rest there is none."""
NOW = np.dtype(
    [
        ("chain", CHAIN),
        ("counts", COUNTERS),
        ("epoch", LOCAL),
        ("theta", np.float64),  # l0 theta
        ("theta_low", np.float64),
        ("total", np.float64),  # sum of all displacements
        ("total_low", np.float64),
        ("time", np.float64),  # since the start of the rearrangement
        ("way", np.float64),  # of the last ramp, 0: none
        ("elastic", np.float64),  # energy at theta_c, if it is logged
        ("size", np.float64),  # of the largest force or displacement rounded since
        ("inherited", np.float64),  # bound of these rounding errors
        ("stage", np.int64),
        ("single", np.int64),  # whether the loop returns after the first rearrangement
        ("number", np.int64),  # of the event within the rearrangement
        ("moving", np.int64),  # number of movers
        ("first", np.int64),  # columns of the first and the last mover
        ("last", np.int64),
        ("touched_first", np.int64),  # columns that have moved in this rearrangement
        ("touched_last", np.int64),
        ("logged", np.int64),  # rows of the log in use
    ]
)
"""The loop's scalars: three structures of their own, and where the chain stands."""
LOGGED_EVENT = np.dtype(
    [
        *EVENT_TABLE.dtype,
        ("theta_low", np.float64),
        ("moved", np.float64),
        ("coefficient", np.float64),
        ("way", np.float64),
        ("elastic", np.float64),  # energy at theta_c, or at rest
        ("undecided", np.int64),  # comparisons so far
    ]
)
"""A row for each slider of an event, and for each rest, with l0 theta for theta."""

# stages
AT_REST, LONE, CLUSTER, UNSTABLE = range(4)
# why the loop returned
DONE, BUDGET, RUNAWAY, LOG_FULL, ONE_DONE, ENDLESS = range(6)
# kinds of events
START, STOP, REST_ROW = range(3)


def columns(n: int) -> int:
    """Return the number of columns for `n` sliders: an odd multiple of eight.

    Rows whose length is a multiple of 1024 bytes would share cache lines.
    """
    eights = -(-(n + PAD + TAIL) // 8)
    return 8 * (eights + 1 - eights % 2)


def keys(n: int) -> int:
    """Return the number of rows of a clock with the first keys of the strips of a chain."""
    return -(-columns(n) // 64)
