"""Where the compiled exact solver keeps what: the rows of its arrays and the cells of its scalars.

The loop works on arrays that Python owns: `cell` and `count` (one column for each slider),
`deviate` (one row for each slider: the batch that holds its next draw), `clock` (one column for
each slider of a chain that is long enough for `local_clocks`, else None), `series` (`SERIES` rows
of eight lanes for each strip of eight sliders of the window that moves; None until two sliders move
together: most of the code to be compiled is for them), `real`, `whole` and `log`, which holds what
is recorded.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import njit

compiled = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)
"""Compile without reference counting: the arrays belong to the caller, nothing is allocated."""
inlined = njit(
    nogil=True,
    error_model="numpy",
    _nrt=False,
    forceinline=True,
    no_cpython_wrapper=True,
    no_cfunc_wrapper=True,
)
"""The same, merged into the caller: one call costs as much as a slip.

Only compiled code can call it; it is kept on disk within its callers alone.
"""

ORDERS = 24
"""Taylor coefficients 0 .. ORDERS - 1 of a velocity are kept; even."""
HORIZON = 1.0
"""Longest step of a cluster, in units of tau_dyn."""
EPOCH = 0.5625
"""Long clusters are expanded as a whole that often, in units of tau_dyn."""
KNOWN = 20
"""Taylor coefficients kept for an epoch; a multiple of four."""
LONGEST_SHORT = 80
"""Chains up to so many sliders are always expanded as a whole."""
LEAST_LONG = 48
"""In longer ones a cluster is long from so many sliders between its first and last on. Measured."""
PAD = 18
"""Slider n stands in column n - 1 + PAD; the columns outside the chain never move."""
TAIL = 24
"""Columns after the last slider: a window may reach so far beyond it."""
NEVER = 1e300
"""The excess of a column outside the chain: a threshold that no force reaches."""
ULP = 2.0**-52
LONGEST_AVALANCHE = 10**6
"""Events of one rearrangement, or steps without one, after which it is given up (+ 1000 n).

Only on slopes from mu_d on: below, every avalanche ends. On the slope mu_d itself friction takes
exactly what gravity gives, and an avalanche may go round for ever without all sliders ever moving.
"""
PROMISED_EVENTS = 200
"""Up to so many events the tensions after a rearrangement are promised to 1e-12.

Longer ones are counted. Measured against the certified solver at N = 2 .. 12 and mu_d from 0.001 to
0.6: of 1740 rearrangements up to here the largest error was 1.2e-13; the shortest beyond 1e-12 had
496 events. A start near grazing can spoil a shorter one: `Exact.rearrange` estimates that.
"""

# rows of `cell`, float64
(
    FORCE,  # at rest, at sliders 1 and N without theta
    FORCE_LOW,  # what FORCE lacks: together they hold it to 2**-106
    REST,  # FORCE with theta
    EXCESS,  # effective (mu_s,n - mu_d) cos(alpha), never negative
    STIFFNESS,  # springs that hold the slider: 2, at an end 1, alone 0
    TRAVEL,  # displacement since the start of the simulation
    TRAVEL_LOW,
    X,  # displacement since the start of the rearrangement
    SPEED,  # velocity in the direction of motion
    SIDE,  # direction of motion, 0 at rest
    FRESH,  # 1 while a slider that has started has not moved yet
    DRIVE,  # force minus friction along the motion with which it started
    COEFFICIENT,
    DOUBTED,  # number of the rearrangement in which it was last counted as undecided
) = range(14)
CELLS = 14

# rows of `count`, int64
DRAWS, SLIPS, EVENT = range(3)
COUNTS = 3

# rows of each strip of `series`, float64: first the derivatives 0 .. ORDERS of the margins, then
(
    AT_END,  # margins at the end of the step
    SLOPE_AT_END,
    MOVED,  # the movers' displacements during the step
    BENT,  # bounds of their fourth derivatives during the step
    CROSSING,  # when the margin was found to leave its range
    MOVES,  # 1 for a mover, else 0
    RESTS,  # 1 for a slider at rest, else 0
    HOLDS,  # minus the stiffness for a mover, else 0
) = range(ORDERS + 1, ORDERS + 9)
SERIES = ORDERS + 9
LADDER = (ORDERS + 9) // 8
"""Rows after those of all strips: the factors between a series' terms at the end of a step."""

# rows of each strip of `clock`, float64: first the derivatives 0 .. KNOWN + 1 of the margins, then
(
    BASE,  # time of the epoch at which the series begins
    KEY,  # until then the margin is certified to stay in its range
    ROOT,  # when it was found to leave its range
    GUESS,  # when it might; once found what it misses the end of its range by
    HOLD,  # minus the stiffness for a mover, else 0
    NOW_X,  # X and SPEED around the last event, at its time
    NOW_SPEED,
) = range(KNOWN + 2, KNOWN + 9)
CLOCKS = KNOWN + 9
"""An odd number; after all strips follow rows with the first key of each strip."""

# cells of `real`, float64
(
    THETA,  # l0 theta
    THETA_LOW,
    TIME,  # since the start of the rearrangement
    TOTAL,  # sum of all displacements
    TOTAL_LOW,
    FRICTION,  # mu_d cos(alpha)
    MU_D,
    MU_D_LOW,
    COSINE,
    SINE,
    MEAN,  # of the static coefficients
    WIDTH,  # their standard deviation
    MEAN_EXCESS,  # (mu_s - mu_d) cos(alpha)
    CLOCK,  # time since the beginning of the epoch
    WILD,  # bound of velocities and accelerations in the epoch
    SPENT,  # what the epoch has left out, in units of it
) = range(16)
REALS = 16

# cells of `whole`, int64
(
    N,
    SEED,
    CONSTANT,  # whether all static coefficients are mu_s
    DOWNHILL,  # the direction in which the chain can run away, 0 if it cannot
    STAGE,
    TARGET,  # number of the target ahead
    FIRST,  # columns of the first and the last mover
    LAST,
    MOVING,  # number of movers
    TOUCHED_FIRST,  # columns that have moved in this rearrangement
    TOUCHED_LAST,
    NUMBER,  # of the event within the rearrangement
    REARRANGEMENTS,
    EVENTS,
    SLIP_TOTAL,
    BELOW,  # draws below mu_d
    UNDECIDED,
    LOGGING,  # what of `log` is kept: a sum of LOGS_...
    LOGGED,  # rows of the log in use
    STEPS,  # of clusters
    CALM,  # of them since the last event
    TESTS,  # windows of eight sliders certified
    ROOTS,  # evaluations of one slider's margin
    LONG,  # rearrangements of more than `PROMISED_EVENTS`
    WORK,  # of clusters, in units of about 5 ns
    LOCAL,  # whether sliders keep the series of their own last change
    CENTRE,  # column around which series are to be renewed
    LEFT,  # blocks of eight columns that the epoch has reached
    RIGHT,
    RETRY,  # steps until a long cluster is tried as such again
) = range(30)
WHOLES = 30

class Tables(NamedTuple):
    """Where the loop writes the tables of rearrangements and slips."""

    rearrangements: NDArray[np.float64]  # a column for each
    slips: NDArray[np.float64]  # a column for each
    used: NDArray[np.int64]  # columns of these two in use
    track: NDArray[np.float64]  # a column for each slider: the slip under way
    sums: NDArray[np.float64]  # the rearrangement under way


class Log(NamedTuple):
    """What the loop records; without tables it is compiled without what writes them."""

    events: NDArray[np.float64]  # a row for each slider of an event
    tables: Tables | None


LOGS_EVENTS, LOGS_REARRANGEMENTS, LOGS_SLIPS = 1, 2, 4

# columns of `Log.events`
(
    LOG_TIME,
    LOG_RESIDUAL,
    LOG_THETA,
    LOG_THETA_LOW,
    LOG_TARGET,
    LOG_REARRANGEMENT,
    LOG_NUMBER,
    LOG_KIND,
    LOG_SLIDER,
    LOG_SIGN,
) = range(10)
LOG_COLUMNS = 10

# rows of `Tables.rearrangements`; see `records.RearrangementRow`
(
    R_HALF_CYCLE,
    R_LOAD,  # l0 theta
    R_DIRECTION,
    R_BEGAN,
    R_BEGAN_FIRST,
    R_BEGAN_LAST,
    R_DURATION,
    R_EVENTS,
    R_SLIPS,
    R_SLIDERS,
    R_FIRST,
    R_LAST,
    R_DISPLACEMENT,
    R_LARGEST,
    R_BEFORE,
    R_AFTER,
    R_GRAVITY,
    R_DISSIPATION,
    R_UNDECIDED,
) = range(19)
R_ROWS = 19

# rows of `Tables.slips`; see `records.SlipRow`
S_SLIDER, S_REARRANGEMENT, S_START, S_STOP, S_DISPLACEMENT, S_COEFFICIENT = range(6)
S_ROWS = 6

# rows of `Tables.track`
T_TIME, T_X, T_REARRANGEMENT = range(3)  # of its last start
TRACKS = 3

# cells of `Tables.sums`
(
    LEFT_FOR,  # rearrangements until the elastic energy is summed anew
    ELASTIC,  # energy at the last start or rest
    TENSIONS,  # their sum, at the same time
    AT_LOAD,  # l0 theta then
    AT_LOAD_LOW,
    WAY,  # of the ramp
    STARTED,  # sliders of the first event
    STARTED_FIRST,
    STARTED_LAST,
    MOVERS,  # different sliders that have moved
    PATH,  # travelled by all sliders together
    LARGEST,
    SLIPS_BEFORE,  # counts at the end of the rearrangement before
    UNDECIDED_BEFORE,
) = range(14)
SUMS = 14

# stages
AT_REST, LONE, CLUSTER, UNSTABLE = range(4)
# why the loop returned
DONE, BUDGET, RUNAWAY, LOG_FULL, ONE_DONE, ENDLESS = range(6)
# kinds of events
START, STOP = range(2)


def columns(n: int) -> int:
    """Return how many columns a chain of `n` sliders needs: an odd multiple of eight.

    Rows whose length is a multiple of 1024 bytes would fight for the same cache lines.
    """
    eights = -(-(n + PAD + TAIL) // 8)
    return 8 * (eights + 1 - eights % 2)


def keys(n: int) -> int:
    """Return how many rows of a clock hold the first keys of the strips of a chain."""
    return -(-columns(n) // 64)


def forget(clock: NDArray[np.float64], n: int) -> None:
    """Take all keys out of the clock of a chain of `n` sliders."""
    clock[KEY::CLOCKS] = NEVER
    clock[-keys(n) :] = NEVER
