"""The compiled event loop of the exact solver: from target to target, float64, event by event.

**Decompose** the movers into a lone mover or a cluster; find the **first event** (a lone
mover's by energy, a cluster's from its series, see `taylor`); **advance** to it; **resolve** it by
the contact law; repeat until rest. Around it: ramp to theta_c, rearrange, repeat until the target.

Forces at rest and displacements are sums of two floats, so that nothing is lost however far the
chain travels. Sliders 1 and N alone feel theta: their stored force leaves it out, and
``l0 theta`` (also two floats) is added when a rearrangement begins. A ramp therefore costs the same
for any length of the chain, and theta_c does not depend on where the ramp began: a dummy
breakpoint changes no bit.

A lone mover obeys ``v**2 = v0**2 + 2 a0 x - k x**2``: where it stops, and which neighbour it starts
before, needs no clock and no trigonometry.

Source: Eqs. (dynamic_eq1)-(static_eqN), section "Numerical method"; derivations/slip.py.
"""

from __future__ import annotations

import math

import numpy as np

from exactcreep.solvers.exact import rows
from exactcreep.solvers.exact.draws import BATCH, KEPT, fill
from exactcreep.solvers.exact.layout import (
    AT_REST,
    BELOW,
    BUDGET,
    CALM,
    CLUSTER,
    COEFFICIENT,
    CONSTANT,
    COSINE,
    DONE,
    DOUBTED,
    DOWNHILL,
    DRAWS,
    DRIVE,
    ENDLESS,
    EVENT,
    EVENTS,
    EXCESS,
    FIRST,
    FORCE,
    FORCE_LOW,
    FRESH,
    FRICTION,
    LAST,
    LEAST_LONG,
    LOCAL,
    LOG_FULL,
    LOG_KIND,
    LOG_NUMBER,
    LOG_REARRANGEMENT,
    LOG_RESIDUAL,
    LOG_SIGN,
    LOG_SLIDER,
    LOG_TARGET,
    LOG_THETA,
    LOG_THETA_LOW,
    LOG_TIME,
    LOGGED,
    LOGGING,
    LOGS_EVENTS,
    LONE,
    LONG,
    LONGEST_AVALANCHE,
    MEAN,
    MEAN_EXCESS,
    MOVING,
    MU_D,
    MU_D_LOW,
    NUMBER,
    ONE_DONE,
    PAD,
    PROMISED_EVENTS,
    REARRANGEMENTS,
    REST,
    RETRY,
    RUNAWAY,
    SEED,
    SIDE,
    SINE,
    SLIP_TOTAL,
    SLIPS,
    SPEED,
    STAGE,
    START,
    STIFFNESS,
    STOP,
    TARGET,
    THETA,
    THETA_LOW,
    TIME,
    TOTAL,
    TOTAL_LOW,
    TOUCHED_FIRST,
    TOUCHED_LAST,
    TRAVEL,
    TRAVEL_LOW,
    ULP,
    UNDECIDED,
    WIDTH,
    WORK,
    N,
    X,
    compiled,
    inlined,
)
from exactcreep.solvers.exact.local_clocks import advance, at_once
from exactcreep.solvers.exact.simd import (
    align_stack,
    below,
    choose,
    lane_of,
    magnitude,
    spread,
    together,
)
from exactcreep.solvers.exact.taylor import step
from exactcreep.solvers.exact.two_floats import plus, two_sum

_CALM = 64
"""Steps without an event after which the whole chain's modes are looked at."""
STEP_WORK = 40
"""Of a step of a cluster, in units of about 5 ns."""
STRIP_WORK = 12
"""Of each of its strips of eight sliders."""
MODES_WORK = 6
"""Of a look at the modes, for every mode and slider."""


@inlined
def _log(real, whole, log, kind, i, sign, residual):
    if whole[LOGGING] & LOGS_EVENTS == 0:
        return
    events, row = log.events, whole[LOGGED]
    events[row, LOG_TIME] = real[TIME]
    events[row, LOG_RESIDUAL] = residual
    events[row, LOG_THETA] = real[THETA]
    events[row, LOG_THETA_LOW] = real[THETA_LOW]
    events[row, LOG_TARGET] = whole[TARGET]
    events[row, LOG_REARRANGEMENT] = whole[REARRANGEMENTS] - 1
    events[row, LOG_NUMBER] = whole[NUMBER]
    events[row, LOG_KIND] = kind
    events[row, LOG_SLIDER] = i + 1 - PAD
    events[row, LOG_SIGN] = sign
    whole[LOGGED] = row + 1


@inlined
def _coefficient(real, deviate):
    """Return the static coefficient of a deviate, and how far it lies above mu_d."""
    mu = real[MEAN] + real[WIDTH] * deviate
    return mu, (mu - real[MU_D]) - real[MU_D_LOW]


@inlined
def _renew(cell, real, whole, i, deviate):
    """Give slider i the static coefficient of a deviate."""
    mu, above = _coefficient(real, deviate)
    cell[COEFFICIENT, i] = mu
    if above < 0.0:
        whole[BELOW] += 1
        above = 0.0
    cell[EXCESS, i] = above * real[COSINE]


@inlined
def _draw_ahead(deviate, whole, i, k):
    """Make the batch after that of draw k.

    Nobody waits for it: the processor makes it while it goes on with the batch at hand.
    """
    fill(deviate, i, np.uint64(whole[SEED]), i + 1 - PAD, k // BATCH + 1)


@inlined
def _draw(cell, count, deviate, real, whole, i):
    """Give slider i its next static coefficient."""
    k = count[DRAWS, i]
    count[DRAWS, i] = k + 1
    if whole[CONSTANT] == 1:
        cell[EXCESS, i] = real[MEAN_EXCESS]
        return
    if k % BATCH == 0:
        _draw_ahead(deviate, whole, i, k)
    _renew(cell, real, whole, i, deviate[i, k % KEPT])


@inlined
def _place_ends(cell, real, whole):
    """Give the forces at sliders 1 and N the present theta."""
    n = whole[N]
    if n > 1:
        for i, way in ((PAD, -1.0), (PAD + n - 1, 1.0)):
            low = cell[FORCE_LOW, i] + way * real[THETA_LOW]
            cell[REST, i], _ = plus(cell[FORCE, i], low, way * real[THETA])


@inlined
def _present_force(cell, i):
    around = cell[X, i - 1] + cell[X, i + 1]
    return cell[REST, i] + (around - cell[STIFFNESS, i] * cell[X, i])


@inlined
def _inside(whole, i):
    return PAD <= i < PAD + whole[N]


@inlined
def _touch(whole, i):
    whole[TOUCHED_FIRST] = min(whole[TOUCHED_FIRST], i)
    whole[TOUCHED_LAST] = max(whole[TOUCHED_LAST], i)


@inlined
def _start(cell, real, whole, log, i, sign, drive, residual):
    cell[SIDE, i] = sign
    cell[SPEED, i] = 0.0
    cell[FRESH, i] = 1.0
    cell[DRIVE, i] = drive
    whole[MOVING] += 1
    _touch(whole, i)
    if whole[MOVING] == 1:
        whole[FIRST] = i
        whole[LAST] = i
    else:
        whole[FIRST] = min(whole[FIRST], i)
        whole[LAST] = max(whole[LAST], i)
    rows.start(cell, real, whole, log.tables, i)
    _log(real, whole, log, START, i, sign, residual)


@inlined
def _stop(cell, count, deviate, real, whole, log, i, residual):
    _log(real, whole, log, STOP, i, cell[SIDE, i], residual)
    cell[SIDE, i] = 0.0
    cell[SPEED, i] = 0.0
    cell[FRESH, i] = 0.0
    whole[MOVING] -= 1
    whole[SLIP_TOTAL] += 1
    count[SLIPS, i] += 1
    _draw(cell, count, deviate, real, whole, i)
    rows.stop(cell, real, whole, log.tables, i)


@inlined
def _begin(cell, real, whole, log, way):
    whole[REARRANGEMENTS] += 1
    whole[NUMBER] = 0
    whole[TOUCHED_FIRST] = cell.shape[1]
    whole[TOUCHED_LAST] = 0
    real[TIME] = 0.0
    rows.begin(cell, real, whole, log.tables, way)


@inlined
def _settle(cell, real, whole, log):
    """Turn the displacements of the rearrangement into forces at rest."""
    rows.end(cell, real, whole, log.tables)
    first = whole[TOUCHED_FIRST]
    last = whole[TOUCHED_LAST]
    for i in range(max(first - 1, PAD), min(last + 2, PAD + whole[N])):
        # the neighbours' sum first: the mirror image adds the same two numbers
        total, error = two_sum(cell[X, i - 1], cell[X, i + 1])
        high, low = plus(cell[FORCE, i], cell[FORCE_LOW, i] + error, total)
        high, low = plus(high, low, -cell[STIFFNESS, i] * cell[X, i])
        cell[FORCE, i] = high
        cell[FORCE_LOW, i] = low
        cell[REST, i] = high  # at sliders 1 and N once theta is known again
    for i in range(first, last + 1):
        moved = cell[X, i]
        if moved != 0.0:
            high, low = plus(cell[TRAVEL, i], cell[TRAVEL_LOW, i], moved)
            cell[TRAVEL, i] = high
            cell[TRAVEL_LOW, i] = low
            real[TOTAL], real[TOTAL_LOW] = plus(real[TOTAL], real[TOTAL_LOW], moved)
            cell[X, i] = 0.0
    if whole[NUMBER] > PROMISED_EVENTS:
        whole[LONG] += 1
    whole[STAGE] = AT_REST


@inlined
def _after_event(cell, real, whole, log):
    """Choose the stage that goes on from the present set of movers."""
    whole[EVENTS] += 1
    if whole[MOVING] == 0:
        _settle(cell, real, whole, log)
        return
    first = whole[FIRST]
    last = whole[LAST]
    while cell[SIDE, first] == 0.0:
        first += 1
    while cell[SIDE, last] == 0.0:
        last -= 1
    whole[FIRST] = first
    whole[LAST] = last
    whole[STAGE] = LONE if first == last else CLUSTER


@inlined
def _stopped_exceeds(cell, real, whole, i, pull):
    """Test a slider that has just stopped; return the sign of its start, 0 if it stays."""
    threshold = real[FRICTION] + cell[EXCESS, i]
    beyond = abs(pull) - threshold
    bound = 8.0 * ULP * (abs(pull) + threshold)
    if beyond > bound:
        return 1.0 if pull > 0.0 else -1.0
    if beyond > -bound:
        whole[UNDECIDED] += 1
    return 0.0


@inlined
def _next_start(cell, real, whole, target, target_low):
    """Return which end starts before the target, and at which ``l0 theta``.

    Returns
    -------
    top, end : bool
        Whether slider 1, slider N starts.
    theta, theta_low : float
        The critical ``l0 theta``; the target if neither starts.
    undecided : bool
        Whether a comparison lay within its rounding bound.
    """
    top = PAD
    end = PAD + whole[N] - 1
    now = real[THETA]
    now_low = real[THETA_LOW]
    far = (target - now) + (target_low - now_low)
    up = 1.0 if far > 0.0 else -1.0
    room_top = real[FRICTION] + cell[EXCESS, top]
    room_end = real[FRICTION] + cell[EXCESS, end]
    # slider 1 starts with sign -up at f_1 + up room, slider N with sign up at up room - f_N
    top_high, top_low = plus(cell[FORCE, top], cell[FORCE_LOW, top], up * room_top)
    end_high, end_low = plus(-cell[FORCE, end], -cell[FORCE_LOW, end], up * room_end)
    far_top = max(up * ((top_high - now) + (top_low - now_low)), 0.0)
    far_end = max(up * ((end_high - now) + (end_low - now_low)), 0.0)
    far *= up
    # the rooms, and what the slips since the last change of direction may have rounded away
    bound = 2.0 * ULP * (room_top + room_end + abs(top_high) + abs(end_high))
    nearest = min(far_top, far_end)
    if whole[N] == 1 or far == 0.0 or nearest >= far - bound:
        near = whole[N] > 1 and far > 0.0 and nearest <= far + bound
        return False, False, target, target_low, near
    apart = far_top - far_end
    together = abs(apart) <= bound
    if nearest == 0.0:
        return together or apart < 0.0, together or apart > 0.0, now, now_low, together
    if apart <= 0.0:
        return True, together, top_high, top_low, together
    return together, True, end_high, end_low, together


@inlined
def _ramp(cell, real, whole, log, target, target_low):
    """Move theta towards the target; return whether a slider has started before it."""
    up = 1.0 if (target - real[THETA]) + (target_low - real[THETA_LOW]) > 0.0 else -1.0
    top, end, theta, theta_low, undecided = _next_start(cell, real, whole, target, target_low)
    real[THETA] = theta
    real[THETA_LOW] = theta_low
    if undecided:
        whole[UNDECIDED] += 1
    if not (top or end):
        return False
    _begin(cell, real, whole, log, up)
    _place_ends(cell, real, whole)
    if top:
        _start(cell, real, whole, log, PAD, -up, cell[EXCESS, PAD], 0.0)
    if end:
        i = PAD + whole[N] - 1
        _start(cell, real, whole, log, i, up, cell[EXCESS, i], 0.0)
    whole[NUMBER] += 1
    _after_event(cell, real, whole, log)
    return True


@inlined
def _plus_in_lanes(high, low, term):
    """Return in every lane the two floats of `plus`."""
    total = high + term
    # the rounding error is exact either way; from the larger term it is known sooner
    grew = below(magnitude(high), magnitude(term))
    error = choose(grew, high - (total - term), term - (total - high)) + low
    result = total + error
    return result, error - (result - total)


@inlined
def _same_end_slips(cell, count, deviate, real, whole, target, target_low, stop_at):
    """Let the end that starts first slip, again and again, as long as that is plain.

    Each slip adds the same length to four sums of two floats: they stay in registers, in four
    lanes of a vector. That the same end starts next, before the target and with nobody else, is
    read off rounded forces; what comes closer than `slack`, which exceeds their rounding and the
    bounds of all comparisons in `_next_start` and `_end_slips`, is left to these. Both ways give
    the same bits.
    """
    n = whole[N]
    constant = whole[CONSTANT] == 1
    mean_excess = real[MEAN_EXCESS]
    friction = real[FRICTION]
    up = 1.0 if (target - real[THETA]) + (target_low - real[THETA_LOW]) > 0.0 else -1.0
    i = PAD
    other = PAD + n - 1
    neighbour = PAD + 1
    way = 1.0
    # up times the critical l0 theta of both ends
    first = friction + cell[EXCESS, i] + up * cell[FORCE, i]
    second = friction + cell[EXCESS, other] - up * cell[FORCE, other]
    if second < first:
        first, second = second, first
        i, other = other, i
        neighbour = i - 1
        way = -1.0
    side = -up * way
    excess = cell[EXCESS, i]
    spare = cell[EXCESS, neighbour]
    between = side * (cell[FORCE, i] + cell[FORCE, neighbour])  # a slip does not change it
    scale = abs(target) + abs(real[THETA]) + 8.0 * friction + cell[EXCESS, other] + spare
    scale += abs(cell[FORCE, i]) + abs(cell[FORCE, other]) + abs(cell[FORCE, neighbour])
    slack = 64.0 * ULP * scale
    if first <= up * real[THETA] + slack:
        return
    reach = up * target - slack
    most = 1.9 * friction
    # the neighbour starts where theta_c and the excess come to this
    wall = 2.0 * friction + spare - between
    if n == 2:
        # it is the other end and feels theta itself: what counts is the excess alone
        most = min(most, spare + between, wall)
        wall = np.inf
    else:
        reach = min(reach, second - slack)
        wall -= slack
    most -= slack
    high = together(
        cell[FORCE, i], cell[FORCE, neighbour], cell[TRAVEL, i], real[TOTAL], 0.0, 0.0, 0.0, 0.0
    )
    low = together(
        cell[FORCE_LOW, i],
        cell[FORCE_LOW, neighbour],
        cell[TRAVEL_LOW, i],
        real[TOTAL_LOW],
        0.0,
        0.0,
        0.0,
        0.0,
    )
    ways = together(-side, side, side, side, 0.0, 0.0, 0.0, 0.0)
    high_before = high
    low_before = low
    excess_before = excess
    k = count[DRAWS, i]
    slips = 0
    allowed = (stop_at - whole[EVENTS] + 1) // 2
    while slips < allowed:
        theta = (friction + excess) - side * lane_of(high, 0)
        if not (slack < excess < most and theta < reach and theta + excess < wall):
            break
        high_before = high
        low_before = low
        excess_before = excess
        high, low = _plus_in_lanes(high, low, ways * spread(2.0 * excess))
        slips += 1
        if not constant:
            if k % BATCH == 0:
                _draw_ahead(deviate, whole, i, k)
            _, above = _coefficient(real, deviate[i, k % KEPT])
            excess = max(above, 0.0) * real[COSINE]
        else:
            excess = mean_excess
        k += 1
    if slips == 0:
        return
    cell[FORCE, i] = lane_of(high, 0)
    cell[FORCE_LOW, i] = lane_of(low, 0)
    cell[FORCE, neighbour] = lane_of(high, 1)
    cell[FORCE_LOW, neighbour] = lane_of(low, 1)
    cell[REST, neighbour] = lane_of(high, 1)
    cell[TRAVEL, i] = lane_of(high, 2)
    cell[TRAVEL_LOW, i] = lane_of(low, 2)
    real[TOTAL] = lane_of(high, 3)
    real[TOTAL_LOW] = lane_of(low, 3)
    real[THETA], real[THETA_LOW] = plus(
        way * lane_of(high_before, 0), way * lane_of(low_before, 0), up * (friction + excess_before)
    )
    count[DRAWS, i] = k
    if constant:
        cell[EXCESS, i] = mean_excess
    else:
        _renew(cell, real, whole, i, deviate[i, (k - 1) % KEPT])
    count[SLIPS, i] += slips
    whole[SLIP_TOTAL] += slips
    whole[REARRANGEMENTS] += slips
    whole[EVENTS] += 2 * slips


@compiled
def _end_slips(cell, count, deviate, real, whole, log, target, target_low, stop_at):
    """Ramp towards the target through rearrangements that are one slip of slider 1 or N.

    Does what `_ramp`, `_lone` and `_settle` do, without the steps that such a slip can skip;
    leaves everything else, comparisons within their bounds included, to them.
    """
    last = PAD + whole[N] - 1
    friction = real[FRICTION]
    pair = whole[N] == 2
    tables = log.tables
    while whole[EVENTS] < stop_at:
        if tables is None:
            _same_end_slips(cell, count, deviate, real, whole, target, target_low, stop_at)
            if whole[EVENTS] >= stop_at:
                return
        top, end, theta, theta_low, undecided = _next_start(cell, real, whole, target, target_low)
        if undecided or top == end:
            return
        i = PAD if top else last
        neighbour = PAD + 1 if top else last - 1
        side = 1.0 if end == ((target - theta) + (target_low - theta_low) > 0.0) else -1.0
        drive = cell[EXCESS, i]
        length = 2.0 * drive
        pull = cell[REST, neighbour]
        if pair:
            way = 1.0 if top else -1.0
            low = cell[FORCE_LOW, neighbour] + way * theta_low
            pull, _ = plus(cell[FORCE, neighbour], low, way * theta)
        room = friction + cell[EXCESS, neighbour] - side * pull
        bound = 8.0 * ULP * (2.0 * friction + drive + length + drive)
        if room <= length + bound or drive >= 1.9 * friction:
            return
        real[THETA] = theta
        real[THETA_LOW] = theta_low
        rows.at_theta(cell, real, whole, tables)
        moved = side * length
        high, low = plus(cell[FORCE, i], cell[FORCE_LOW, i], -moved)
        cell[FORCE, i] = high
        cell[FORCE_LOW, i] = low
        high, low = plus(cell[FORCE, neighbour], cell[FORCE_LOW, neighbour], moved)
        cell[FORCE, neighbour] = high
        cell[FORCE_LOW, neighbour] = low
        cell[REST, neighbour] = high
        high, low = plus(cell[TRAVEL, i], cell[TRAVEL_LOW, i], moved)
        cell[TRAVEL, i] = high
        cell[TRAVEL_LOW, i] = low
        real[TOTAL], real[TOTAL_LOW] = plus(real[TOTAL], real[TOTAL_LOW], moved)
        _draw(cell, count, deviate, real, whole, i)
        rows.end_slip(cell, real, whole, tables, i, side if end else -side, moved)
        count[SLIPS, i] += 1
        whole[SLIP_TOTAL] += 1
        whole[REARRANGEMENTS] += 1
        whole[EVENTS] += 2


@inlined
def _unstable(cell, real, whole, log):
    """Start every slider that exceeds its threshold as the chain stands."""
    n = whole[N]
    began = False
    _place_ends(cell, real, whole)
    for i in range(PAD, PAD + n):
        pull = cell[REST, i]
        threshold = real[FRICTION] + cell[EXCESS, i]
        beyond = abs(pull) - threshold
        bound = 8.0 * ULP * (abs(pull) + threshold)
        if n > 1 and (i == PAD or i == PAD + n - 1):
            bound += 2.0 * ULP * abs(real[THETA])
        if beyond > bound:
            if not began:
                _begin(cell, real, whole, log, 0.0)
                began = True
            sign = 1.0 if pull > 0.0 else -1.0
            _start(cell, real, whole, log, i, sign, abs(pull) - real[FRICTION], 0.0)
        elif beyond > -bound:
            whole[UNDECIDED] += 1
            cell[DOUBTED, i] = whole[REARRANGEMENTS] + (not began)  # not again in what follows
    whole[STAGE] = AT_REST
    if began:
        whole[NUMBER] += 1
        _after_event(cell, real, whole, log)
    return began


@inlined
def _lone(cell, count, deviate, real, whole, log):
    """Advance a lone mover to its stop or to the start of a neighbour, by energy."""
    i = whole[FIRST]
    side = cell[SIDE, i]
    stiff = cell[STIFFNESS, i]
    speed = cell[SPEED, i]
    friction = real[FRICTION]
    drive = cell[DRIVE, i]  # exactly what made it start
    if cell[FRESH, i] == 0.0:
        drive = side * _present_force(cell, i) - friction
    swing = 0.0
    if stiff == 0.0:
        if drive >= 0.0:
            return True
        length = speed * speed / (-2.0 * drive)
    elif speed == 0.0:
        length = 2.0 * drive / stiff
    else:
        swing = math.sqrt(drive * drive + stiff * speed * speed)
        length = (drive + swing) / stiff if drive >= 0.0 else speed * speed / (swing - drive)
    room_left = np.inf
    room_right = np.inf
    if stiff > 0.0:
        if _inside(whole, i - 1):
            threshold = friction + cell[EXCESS, i - 1]
            room_left = max(threshold - side * _present_force(cell, i - 1), 0.0)
        if _inside(whole, i + 1):
            threshold = friction + cell[EXCESS, i + 1]
            room_right = max(threshold - side * _present_force(cell, i + 1), 0.0)
    room = min(room_left, room_right)
    bound = 8.0 * ULP * (2.0 * friction + cell[EXCESS, i] + length + abs(drive))
    cell[FRESH, i] = 0.0
    if room >= length - bound:
        if room <= length + bound:
            whole[UNDECIDED] += 1
        if whole[LOGGING] != 0:
            if stiff == 0.0:
                real[TIME] += speed / -drive
            elif length > 0.0:
                real[TIME] += math.atan2(math.sqrt(stiff) * speed, -drive) / math.sqrt(stiff)
        cell[X, i] += side * length
        # its acceleration has turned to the opposite of what a start from rest would need
        pull = side * (friction - (drive if speed == 0.0 else swing))
        if stiff == 0.0:
            pull = cell[REST, i]
        _stop(cell, count, deviate, real, whole, log, i, 0.0)
        whole[NUMBER] += 1
        turn = 0.0
        # pulled on as before it stays, however close to mu_d c: the excess is never negative
        if stiff == 0.0 or side * pull < 0.0:
            turn = _stopped_exceeds(cell, real, whole, i, pull)
        if turn != 0.0:
            _start(cell, real, whole, log, i, turn, abs(pull) - friction, 0.0)
            whole[EVENTS] += 1
            whole[NUMBER] += 1
        _after_event(cell, real, whole, log)
        return False
    # a neighbour starts at once with everything else unchanged
    faster = math.sqrt(max(speed * speed + room * (2.0 * drive - stiff * room), 0.0))
    if whole[LOGGING] != 0:
        later = drive - stiff * room
        omega = math.sqrt(stiff)
        turned = math.atan2(
            omega * (faster * drive - speed * later),
            drive * later + stiff * speed * faster,
        )
        if turned > 0.0:
            real[TIME] += turned / omega
    cell[X, i] += side * room
    cell[SPEED, i] = faster
    both = abs(room_left - room_right) <= bound
    if both:
        whole[UNDECIDED] += 1
    if both or room_left < room_right:
        _start(cell, real, whole, log, i - 1, side, cell[EXCESS, i - 1], 0.0)
    if both or room_right < room_left:
        _start(cell, real, whole, log, i + 1, side, cell[EXCESS, i + 1], 0.0)
    if faster == 0.0:
        cell[FRESH, i] = 1.0  # it has not moved yet: its velocity still starts from zero
        cell[DRIVE, i] = drive
    whole[NUMBER] += 1
    _after_event(cell, real, whole, log)
    return False


@inlined
def _never_stops(cell, real, whole):
    """Return whether it is proved that no slider of the moving whole chain ever stops."""
    n = whole[N]
    down = whole[DOWNHILL]
    if down == 0:
        return False
    total = 0.0
    for i in range(PAD, PAD + n):
        if cell[SIDE, i] != down:
            return False
        total += cell[SPEED, i]
    mean = total / n
    energy = 0.0
    tension = 0.0
    scale = 0.0
    for i in range(PAD, PAD + n):
        energy += (cell[SPEED, i] - mean) ** 2
        tension += _present_force(cell, i) - real[SINE]
        if i < PAD + n - 1:
            energy += tension * tension
        scale += abs(tension) + cell[SPEED, i]
    # outward: the sums above are good to n ulp of their largest term
    energy = energy * (1.0 + 8.0 * n * ULP) + (8.0 * n * ULP * scale) ** 2
    return mean * (1.0 - 4.0 * n * ULP) > math.sqrt((1.0 - 1.0 / n) * energy)


@compiled
def _no_mode_stops(cell, series, real, whole):
    """Return whether the mean velocity exceeds the sum of the modes' amplitudes at every slider.

    Sharper than `_never_stops`, and dearer: for a chain on the slope mu_d itself, where the mean
    velocity never grows.
    """
    n = whole[N]
    mean = 0.0
    for i in range(PAD, PAD + n):
        mean += cell[SPEED, i] / n
    # the next step fills `series` anew
    for m in range(n):
        series[m // 8, m % 8] = 0.0
    for q in range(1, n):
        angle = math.pi * q / n
        speed = 0.0
        push = 0.0
        for i in range(n):
            shape = math.cos((i + 0.5) * angle)
            speed += shape * cell[SPEED, PAD + i]
            push += shape * _present_force(cell, PAD + i)
        omega = 2.0 * math.sin(0.5 * angle)
        amplitude = math.sqrt(speed * speed + (push / omega) ** 2)
        for m in range(n):
            series[m // 8, m % 8] += 2.0 / n * abs(math.cos((m + 0.5) * angle)) * amplitude
    largest = 0.0
    for m in range(n):
        largest = max(largest, series[m // 8, m % 8])
    # each sum of n terms is good to n ulp of the sum of their sizes
    slack = 64.0 * n * n * ULP * ULP
    return mean * (1.0 - 4.0 * n * ULP) > largest * (1.0 + 16.0 * n * ULP) + slack


@inlined
def _long(whole):
    """Return whether the movers stand far enough apart for clocks of their own."""
    apart = whole[LAST] - whole[FIRST]
    return apart >= LEAST_LONG and whole[DOWNHILL] == 0 and whole[RETRY] == 0


@inlined
def _cluster(cell, count, deviate, clock, series, real, whole, log):
    """Advance several movers to their first event and resolve it; return True for a runaway."""
    if whole[MOVING] == whole[N] and whole[DOWNHILL] != 0:
        if _never_stops(cell, real, whole):
            return True
        if whole[CALM] > _CALM and whole[CALM] % _CALM == 0:
            whole[WORK] += MODES_WORK * whole[N] ** 2
            if _no_mode_stops(cell, series, real, whole):
                return True
    whole[CALM] += 1
    whole[WORK] += STEP_WORK
    events = np.int64(-1)
    if clock is not None:  # noqa: SIM102 - known when this is compiled, the rest is not
        if whole[LOCAL] == 1 or _long(whole):
            t, events, residual = advance(cell, count, clock, real, whole)
            if events < 0:
                real[TIME] += t
                whole[RETRY] = 1
    if events < 0:
        whole[WORK] += STRIP_WORK * ((whole[LAST] - whole[FIRST] + 10) // 8)
        whole[RETRY] -= whole[RETRY] > 0
        t, events, residual = step(
            cell, count, series, real, whole, whole[FIRST] - 1, whole[LAST] + 1
        )
    real[TIME] += t
    if events == 0:
        return False
    whole[CALM] = 0
    for k in range(1, events):  # ascending
        i = count[EVENT, k]
        while k > 0 and count[EVENT, k - 1] > i:
            count[EVENT, k] = count[EVENT, k - 1]
            k -= 1
        count[EVENT, k] = i
    # all that stop are frozen and draw, then all are tested with the same forces
    friction = real[FRICTION]
    stops = 0
    for k in range(events):
        i = count[EVENT, k]
        if cell[SIDE, i] != 0.0:
            _stop(cell, count, deviate, real, whole, log, i, residual)
            count[EVENT, k] = -i
            stops += 1
    if stops > 0:
        whole[NUMBER] += 1
    starts = 0
    for k in range(events):
        i = count[EVENT, k]
        if i < 0:
            i = -i
            pull = _present_force(cell, i)
            turn = _stopped_exceeds(cell, real, whole, i, pull)
            if turn != 0.0:
                _start(cell, real, whole, log, i, turn, abs(pull) - friction, 0.0)
                starts += 1
        else:
            sign = 1.0 if _present_force(cell, i) > 0.0 else -1.0
            _start(cell, real, whole, log, i, sign, cell[EXCESS, i], residual)
            starts += 1
    if starts > 0:
        whole[NUMBER] += 1
        if stops > 0:
            whole[EVENTS] += 1
    _after_event(cell, real, whole, log)
    if clock is not None:
        short = whole[LAST] - whole[FIRST] < LEAST_LONG // 2
        if whole[LOCAL] == 1 and (short or whole[STAGE] != CLUSTER):
            at_once(cell, clock, real, whole)
    return False


@compiled
def prepare(cell, count, deviate, whole):
    """Fill the batches of deviates that hold the next draws."""
    if whole[CONSTANT] == 0:
        for i in range(PAD, PAD + whole[N]):
            batch = count[DRAWS, i] // BATCH
            fill(deviate, i, np.uint64(whole[SEED]), i + 1 - PAD, batch)
            if count[DRAWS, i] % BATCH != 0:
                fill(deviate, i, np.uint64(whole[SEED]), i + 1 - PAD, batch + 1)


@compiled
def follow(
    cell, count, deviate, clock, series, real, whole, log, theta, theta_low, travel, max_events,
    max_work, single,
):  # fmt: skip
    """Take the chain along the targets; return why it came back, and how many it reached.

    Parameters
    ----------
    cell, count, deviate, series, real, whole : ndarray
    log : Log
        See `layout`.
    theta, theta_low : ndarray, shape (m,)
        The targets, ``l0 theta`` as two floats.
    travel : ndarray, shape (m,)
        Filled with the sum of all displacements at each target reached.
    max_events : int
        Return soon after so many further events.
    max_work : int
        Return soon after so much work: events, and the `layout.WORK` of clusters.
    single : bool
        Return after the first rearrangement of all.

    `layout.BUDGET` also comes back once several sliders move and there are no `series`.
    """
    align_stack()
    stop_at = whole[EVENTS] + min(max_events, max_work)
    work_limit = whole[WORK] + max_work
    reached = 0
    longest = LONGEST_AVALANCHE + 1000 * whole[N]
    if whole[DOWNHILL] == 0:
        longest = 2**62
    room = log.events.shape[0] - 2 * whole[N] - 4
    while reached < theta.size:
        stage = whole[STAGE]
        if whole[EVENTS] >= stop_at or whole[WORK] >= work_limit:
            return BUDGET, reached
        if whole[LOGGING] & LOGS_EVENTS != 0 and whole[LOGGED] > room:
            return LOG_FULL, reached
        slips_at_most = rows.room(log.tables) - whole[N]
        if slips_at_most <= 0:
            return LOG_FULL, reached
        if stage == AT_REST:
            if whole[LOGGING] & LOGS_EVENTS == 0 and whole[N] > 1 and not single:
                _end_slips(
                    cell, count, deviate, real, whole, log, theta[reached], theta_low[reached],
                    min(stop_at, whole[EVENTS] + 2 * slips_at_most),
                )  # fmt: skip
            if not _ramp(cell, real, whole, log, theta[reached], theta_low[reached]):
                travel[reached] = real[TOTAL] + real[TOTAL_LOW]
                reached += 1
                whole[TARGET] += 1
        elif stage == LONE:
            if _lone(cell, count, deviate, real, whole, log):
                return RUNAWAY, reached
        elif stage == CLUSTER:
            if series is None:  # known when this is compiled
                return BUDGET, reached
            if _cluster(cell, count, deviate, clock, series, real, whole, log):
                return RUNAWAY, reached
        else:
            _unstable(cell, real, whole, log)
        if max(whole[NUMBER], whole[CALM]) > longest and whole[STAGE] != AT_REST:
            return ENDLESS, reached
        if single and whole[STAGE] == AT_REST and whole[REARRANGEMENTS] > 0:
            return ONE_DONE, reached
    return DONE, reached
