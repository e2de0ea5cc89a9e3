"""The compiled event loop of the exact solver: from target to target, float64, event by event.

**Decompose** the movers into a lone mover or a cluster; find the **first event** (a lone
mover's by energy, a cluster's from its series, see `taylor`); **move** to it; **resolve** it by
the rules of the model; repeat until rest. Around it: ramp to theta_c, rearrange, repeat to the
target.

Forces at rest and displacements are sums of two floats, so that no digits are lost however far the
chain travels. They do not contain the effect of theta: ``l0 theta`` (also two floats) is added when
a rearrangement begins. So theta_c does not depend on where the ramp began, and an additional
breakpoint changes no bit. If all springs expand alike only sliders 1 and N feel theta, and a ramp
costs the same for any length of the chain.

A lone mover obeys ``v**2 = v0**2 + 2 a0 x - k x**2``, which tells without time or trigonometry
where it stops, and which neighbour it starts before.

Source: Eqs. 5-10, section "Numerical method"; derivations/slip.py.
"""

from __future__ import annotations

import math

import numpy as np

from exactcreep.compiling import apart, compiled, inlined, merged
from exactcreep.model.rules import FLOATS, in_turn
from exactcreep.solvers.exact import layout, rows
from exactcreep.solvers.exact.double_double import add, plus, two_sum
from exactcreep.solvers.exact.draws import BATCH, draw, fill
from exactcreep.solvers.exact.end_slips import end_slips
from exactcreep.solvers.exact.layout import PAD, ULP
from exactcreep.solvers.exact.local_clocks import at_once, cluster_step
from exactcreep.solvers.exact.ramps import next_start
from exactcreep.solvers.exact.simd import align_stack
from exactcreep.solvers.exact.taylor import step

_start_direction, _reversal, _is_before, _order, _leaves, _driven = FLOATS

STEP_WORK = 40
"""Work of a step of a cluster, in units of about 5 ns."""
STRIP_WORK = 12
"""Additional work for each of its strips of eight sliders."""


@apart
def _write(cell, now, log, kind, i, sign):
    row = log[now.logged]
    row.half_cycle = now.counts.target
    row.rearrangement = now.counts.rearrangements - 1
    row.number = now.number
    row.theta = now.theta
    row.time = now.time
    row.kind = kind
    row.slider = i + 1 - PAD
    row.sign = sign
    row.theta_low = now.theta_low
    row.moved = cell[layout.X, i]
    row.coefficient = cell[layout.MEAN if now.chain.constant == 1 else layout.COEFFICIENT, i]
    row.way = now.way
    row.elastic = now.elastic
    row.undecided = now.counts.undecided
    now.logged += 1


@apart
def _find_elastic(cell, now):
    """Find the elastic energy at rest, from the forces."""
    energy = 0.0
    even = now.chain.even == 1
    high, low = (-now.theta, -now.theta_low) if even else (0.0, 0.0)
    for i in range(PAD, PAD + now.chain.n - 1):
        if not even:
            by, by_low = rows.of_theta(cell, now, i)
            high, low = plus(high, low + by_low, by)
        high, low = plus(high, low + cell[layout.FORCE_LOW, i], cell[layout.FORCE, i])
        high, low = plus(high, low, -cell[layout.WEIGHT, i])
        energy += 0.5 * high * high
    now.elastic = energy


@inlined
def _place_at_theta(cell, whole, now):
    """Add the effect of the present theta to the forces on the sliders that feel it."""
    for k in range(now.chain.driven):
        i = whole[layout.DRIVEN, k]
        rate = cell[layout.RATE, i]
        by, low = rate * now.theta, rate * now.theta_low
        if now.chain.even == 0:  # else the rate is 1 or -1, and this is exact
            by, low = rows.of_theta(cell, now, i)
        low += cell[layout.FORCE_LOW, i]
        cell[layout.REST, i], _ = plus(cell[layout.FORCE, i], low, by)


@inlined
def _present_force(cell, i):
    around = cell[layout.X, i - 1] + cell[layout.X, i + 1]
    return cell[layout.REST, i] + (around - cell[layout.STIFFNESS, i] * cell[layout.X, i])


@inlined
def _start(cell, now, log, i, sign, drive):
    cell[layout.SIDE, i] = sign
    cell[layout.SPEED, i] = 0.0
    cell[layout.FRESH, i] = 1.0
    cell[layout.DRIVE, i] = drive
    bearing = 2.0 * cell[layout.FRICTION, i] + cell[layout.MEAN_EXCESS, i]
    if bearing > now.size:  # a slider that bears more than all that have moved before
        now.inherited += layout.AT_REST_OFF * (bearing - now.size)
        now.size = bearing
    now.moving += 1
    now.first = min(now.first, i)
    now.last = max(now.last, i)
    now.touched_first = min(now.touched_first, i)
    now.touched_last = max(now.touched_last, i)
    if now.chain.logging != 0:
        _write(cell, now, log, layout.START, i, sign)


@inlined
def _freeze(cell, whole, now, i):
    cell[layout.SIDE, i] = 0.0
    cell[layout.SPEED, i] = 0.0
    cell[layout.FRESH, i] = 0.0
    now.moving -= 1
    now.size = max(now.size, abs(cell[layout.X, i]))
    now.counts.slips += 1
    whole[layout.SLIPS, i] += 1


@inlined
def _renew(cell, whole, deviate, now, log, i, sign):
    draw(cell, whole, deviate, now, i)
    if now.chain.logging != 0:
        _write(cell, now, log, layout.STOP, i, sign)


@inlined
def _begin(cell, now, way):
    now.way = way
    now.counts.rearrangements += 1
    now.number = 0
    now.first = now.touched_first = cell.shape[1]
    now.last = now.touched_last = 0
    now.time = 0.0
    now.size = now.inherited = 0.0
    now.epoch.retry = 0
    if now.chain.logging != 0:
        _find_elastic(cell, now)


@inlined
def _settle(cell, now, log):
    """Turn the displacements of the rearrangement into forces at rest."""
    first = now.touched_first
    last = now.touched_last
    for i in range(max(first - 1, PAD), min(last + 2, PAD + now.chain.n)):
        # the neighbours' sum first, so that the mirror image adds the same two numbers
        total, error = two_sum(cell[layout.X, i - 1], cell[layout.X, i + 1])
        cell[layout.FORCE_LOW, i] += error
        add(cell, layout.FORCE, layout.FORCE_LOW, i, total)
        add(cell, layout.FORCE, layout.FORCE_LOW, i, -cell[layout.STIFFNESS, i] * cell[layout.X, i])
        cell[layout.REST, i] = cell[layout.FORCE, i]  # at sliders 1 and N once theta is known again
    for i in range(first, last + 1):
        moved = cell[layout.X, i]
        if moved != 0.0:
            add(cell, layout.TRAVEL, layout.TRAVEL_LOW, i, moved)
            now.total, now.total_low = plus(now.total, now.total_low, moved)
            cell[layout.X, i] = 0.0
    now.stage = layout.AT_REST
    if now.chain.logging != 0:
        _find_elastic(cell, now)
        _write(cell, now, log, layout.REST_ROW, PAD, 0.0)


@inlined
def _decompose(cell, now, log):
    """End an event: choose how to continue with the sliders that move now, if any do."""
    now.counts.events += 1
    now.inherited += layout.EVENT_OFF * now.size
    if now.moving == 0:
        _settle(cell, now, log)
        return
    first = now.first
    last = now.last
    while cell[layout.SIDE, first] == 0.0:
        first += 1
    while cell[layout.SIDE, last] == 0.0:
        last -= 1
    now.first = first
    now.last = last
    now.stage = layout.LONE if first == last else layout.CLUSTER


@inlined
def _threshold(cell, now, i, pull, slack):
    """Return the force at which a slider yields, and the distance from it that is in doubt.

    The force on the slider is known to `slack`, and to some roundings.
    """
    threshold = cell[layout.FRICTION, i] + cell[layout.EXCESS, i]
    return threshold, 8.0 * ULP * (abs(pull) + threshold) + slack


@inlined
def _ramp(cell, whole, now, log, target, target_low):
    """Move theta towards the target; return whether a slider has started before it."""
    up = 1.0 if (target - now.theta) + (target_low - now.theta_low) > 0.0 else -1.0
    starts, theta, theta_low, close = next_start(cell, whole, now, target, target_low)
    now.theta = theta
    now.theta_low = theta_low
    now.counts.undecided += close
    if starts == 0:
        return False
    _begin(cell, now, up)
    _place_at_theta(cell, whole, now)
    for k in range(starts):
        i = whole[layout.EVENT, k]
        sign, _ = _driven(cell[layout.RATE, i], up)
        _start(cell, now, log, i, sign, cell[layout.EXCESS, i])
    now.number += 1
    _decompose(cell, now, log)
    return True


@inlined
def _unstable(cell, whole, now, log):
    """Start every slider that exceeds its threshold at the present theta."""
    n = now.chain.n
    began = False
    _place_at_theta(cell, whole, now)
    for i in range(PAD, PAD + n):
        pull = cell[layout.REST, i]
        of_theta = abs(cell[layout.RATE, i] * now.theta)
        threshold, slack = _threshold(cell, now, i, pull, 2.0 * ULP * of_theta)
        sign, close = _start_direction(pull, threshold, slack)
        if sign != 0:
            if not began:
                _begin(cell, now, 0.0)
                began = True
            _start(cell, now, log, i, float(sign), abs(pull) - cell[layout.FRICTION, i])
        elif close:
            now.counts.undecided += 1
            cell[layout.DOUBTED, i] = now.counts.rearrangements + (
                not began
            )  # not again in what follows
    now.stage = layout.AT_REST
    if began:
        now.number += 1
        _decompose(cell, now, log)
    return began


@inlined
def _room_of(cell, i, side, length):
    """Return how far a neighbour can move until a slider starts, and the force compared there.

    A threshold that a slip of this `length` does not reach does not count.
    """
    threshold = cell[layout.FRICTION, i] + cell[layout.EXCESS, i]
    pull = side * _present_force(cell, i)
    return max(threshold - pull, 0.0), min(threshold, abs(pull) + length)


@inlined
def _lone(cell, whole, deviate, now, log):
    """Take a lone mover to its stop or to the start of a neighbour, by energy."""
    i = now.first
    side = cell[layout.SIDE, i]
    stiff = cell[layout.STIFFNESS, i]
    speed = cell[layout.SPEED, i]
    friction = cell[layout.FRICTION, i]
    drive = cell[layout.DRIVE, i]  # exactly the force with which it started
    if cell[layout.FRESH, i] == 0.0:
        drive = side * _present_force(cell, i) - friction
    swing = 0.0
    if stiff == 0.0:
        if drive >= 0.0:
            return True
        length = speed * speed / (-2.0 * drive)
    elif speed == 0.0:
        at_once, _ = _leaves(drive, True, 0.0)
        length = 0.0 if at_once else 2.0 * drive / stiff
    else:
        swing = math.sqrt(drive * drive + stiff * speed * speed)
        length = (drive + swing) / stiff if drive >= 0.0 else speed * speed / (swing - drive)
    room_left = np.inf
    room_right = np.inf
    scale = 2.0 * friction + cell[layout.EXCESS, i] + length + abs(drive)
    if stiff > 0.0:
        if i > PAD:
            room_left, bearing = _room_of(cell, i - 1, side, length)
            scale += bearing
        if i < PAD + now.chain.n - 1:
            room_right, bearing = _room_of(cell, i + 1, side, length)
            scale += bearing
    room = min(room_left, room_right)
    bound = 8.0 * ULP * scale
    cell[layout.FRESH, i] = 0.0
    starts, close = _is_before(room, length, bound)
    now.counts.undecided += close
    if not starts:
        if now.chain.logging != 0:
            if stiff == 0.0:
                now.time += speed / -drive
            elif speed == 0.0:
                now.time += math.pi / math.sqrt(stiff) if length > 0.0 else 0.0
            elif length > 0.0:
                now.time += math.atan2(math.sqrt(stiff) * speed, -drive) / math.sqrt(stiff)
        cell[layout.X, i] += side * length
        # its acceleration has reversed, opposite to a start from rest
        pull = side * (friction - (drive if speed == 0.0 else swing))
        if stiff == 0.0:
            pull = cell[layout.REST, i]
        _freeze(cell, whole, now, i)
        _renew(cell, whole, deviate, now, log, i, side)
        now.number += 1
        threshold, slack = _threshold(cell, now, i, pull, 0.0)
        turn, close = _reversal(pull, threshold, side, slack)
        now.counts.undecided += close
        if turn != 0.0:
            _start(cell, now, log, i, turn, abs(pull) - friction)
            now.counts.events += 1
            now.number += 1
        _decompose(cell, now, log)
        return False
    # a neighbour starts immediately, and nothing else changes
    faster = math.sqrt(max(speed * speed + room * (2.0 * drive - stiff * room), 0.0))
    if now.chain.logging != 0:
        later = drive - stiff * room
        omega = math.sqrt(stiff)
        turned = math.atan2(
            omega * (faster * drive - speed * later),
            drive * later + stiff * speed * faster,
        )
        if turned > 0.0:
            now.time += turned / omega
    cell[layout.X, i] += side * room
    cell[layout.SPEED, i] = faster
    order, close = _order(room_left, room_right, bound)
    now.counts.undecided += close
    if order <= 0:
        _start(cell, now, log, i - 1, side, cell[layout.EXCESS, i - 1])
    if order >= 0:
        _start(cell, now, log, i + 1, side, cell[layout.EXCESS, i + 1])
    if faster == 0.0:
        cell[layout.FRESH, i] = 1.0  # it has not moved yet: its velocity still starts from zero
        cell[layout.DRIVE, i] = drive
    now.number += 1
    _decompose(cell, now, log)
    return False


@inlined
def _never_stops(cell, now):
    """Return whether provably no slider of the moving whole chain ever stops."""
    n = now.chain.n
    down = now.chain.downhill
    if down == 0:
        return False
    total = 0.0
    for i in range(PAD, PAD + n):
        if cell[layout.SIDE, i] != down:
            return False
        total += cell[layout.SPEED, i]
    mean = total / n
    energy = 0.0
    tension = 0.0
    scale = 0.0
    for i in range(PAD, PAD + n):
        energy += (cell[layout.SPEED, i] - mean) ** 2
        tension += _present_force(cell, i) - now.chain.mean_weight
        tension -= down * (cell[layout.FRICTION, i] - now.chain.mean_friction)
        if i < PAD + n - 1:
            energy += tension * tension
        scale += abs(tension) + cell[layout.SPEED, i]
    # rounded outward: the sums above are good to n ulp of their largest term
    energy = energy * (1.0 + 8.0 * n * ULP) + (8.0 * n * ULP * scale) ** 2
    return mean * (1.0 - 4.0 * n * ULP) > math.sqrt((1.0 - 1.0 / n) * energy)


@inlined
def _to_first_event(cell, whole, clock, series, now):
    """Take several movers to their first event; return its number of sliders and time error."""
    now.counts.calm += 1
    now.counts.work += STEP_WORK
    events = np.int64(-1)
    if clock is not None:  # known when this is compiled
        # whether the movers are far enough apart to have their own clocks
        long = now.last - now.first >= layout.LEAST_LONG and now.chain.downhill == 0
        if now.epoch.on == 1 or (long and now.epoch.retry == 0):
            t, events, blur = cluster_step(cell, whole, clock, series, now)
            if events < 0:
                now.time += t
                now.epoch.retry = 1
    if events < 0:
        now.counts.work += STRIP_WORK * ((now.last - now.first + 10) // 8)
        now.epoch.retry -= now.epoch.retry > 0
        t, events, blur = step(cell, whole, series, now, now.first - 1, now.last + 1)
    now.time += t
    return events, blur


@inlined
def _in_order(whole, events):
    """Sort the columns in ``whole[EVENT]``, so that the order of finding them does not matter."""
    for k in range(1, events):
        i = whole[layout.EVENT, k]
        while k > 0 and whole[layout.EVENT, k - 1] > i:
            whole[layout.EVENT, k] = whole[layout.EVENT, k - 1]
            k -= 1
        whole[layout.EVENT, k] = i


@inlined
def _freeze_kth(k, cell, whole, deviate, now, log, blur, number):
    i = whole[layout.EVENT, k]
    whole[layout.STOPPED, k] = cell[layout.SIDE, i]
    if whole[layout.STOPPED, k] != 0:
        _freeze(cell, whole, now, i)


@inlined
def _renew_kth(k, cell, whole, deviate, now, log, blur, number):
    if whole[layout.STOPPED, k] != 0:
        now.number = number
        sign = float(whole[layout.STOPPED, k])
        _renew(cell, whole, deviate, now, log, whole[layout.EVENT, k], sign)
        now.number = number + 1


@inlined
def _test_kth(k, cell, whole, deviate, now, log, blur, number):
    i = whole[layout.EVENT, k]
    pull = _present_force(cell, i)
    turn = 1.0 if pull > 0.0 else -1.0
    drive = cell[layout.EXCESS, i]
    way = whole[layout.STOPPED, k]
    if way != 0:
        beside = cell[layout.SPEED, i - 1] + cell[layout.SPEED, i + 1]
        threshold, slack = _threshold(cell, now, i, pull, blur * beside)
        turn, close = _reversal(pull, threshold, float(way), slack)
        now.counts.undecided += close
        drive = abs(pull) - cell[layout.FRICTION, i]
    if turn != 0.0:
        _start(cell, now, log, i, turn, drive)


_in_turn = in_turn(_freeze_kth, _renew_kth, _test_kth, merged)


@inlined
def _resolve(cell, whole, deviate, now, log, events, blur):
    """Let the sliders of an event stop and start by the rules of the model.

    The time of the event is known to `blur`. In that time moving neighbours change the force on a
    slider.
    """
    now.counts.calm = 0
    _in_order(whole, events)
    slips, moving = now.counts.slips, now.moving
    _in_turn(range(events), cell, whole, deviate, now, log, blur, now.number)
    stops = now.counts.slips - slips
    if now.moving > moving - stops:  # some sliders have started
        now.number += 1
        if stops > 0:
            now.counts.events += 1
    _decompose(cell, now, log)


@inlined
def _cluster(cell, whole, deviate, clock, series, now, log):
    """Take several movers to their first event and resolve it; return True for a runaway."""
    if now.moving == now.chain.n and _never_stops(cell, now):
        return True
    events, blur = _to_first_event(cell, whole, clock, series, now)
    if events > 0:
        _resolve(cell, whole, deviate, now, log, events, blur)
        if clock is not None:
            short = now.last - now.first < layout.LEAST_LONG // 2
            if now.epoch.on == 1 and (short or now.stage != layout.CLUSTER):
                at_once(cell, clock, now)
    return False


@compiled
def prepare(cell, whole, deviate, scalars):
    """Fill the batches of deviates that hold the next draws."""
    now = scalars[0]
    if now.chain.constant == 0:
        for i in range(PAD, PAD + now.chain.n):
            batch = whole[layout.DRAWS, i] // BATCH
            fill(deviate, i, np.uint64(now.chain.seed), i + 1 - PAD, batch)
            if whole[layout.DRAWS, i] % BATCH != 0:
                fill(deviate, i, np.uint64(now.chain.seed), i + 1 - PAD, batch + 1)


@compiled
def follow(
    cell, whole, deviate, clock, series, scalars, log, theta, theta_low, targets, first,
    max_events, max_work,
):  # fmt: skip
    """Take the chain along the targets; return why it returned, and how many it reached.

    The targets are ``l0 theta`` as two floats. `targets` is filled at each target, from row `first`
    on, see `rows.AtTargets`. Returns soon after `max_events` further events, or after `max_work`
    (events and the work of clusters), and if `single` is set after the first rearrangement. Also
    returns `layout.BUDGET` when several sliders move and there are no `series`.
    """
    align_stack()
    now = scalars[0]
    stop_at = now.counts.events + min(max_events, max_work)
    work_limit = now.counts.work + max_work
    reached = np.int64(0)
    room = log.size - 2 * now.chain.n - 4
    while reached < theta.size:
        stage = now.stage
        if max(now.number, now.counts.calm) > now.chain.longest and stage != layout.AT_REST:
            return layout.ENDLESS, reached  # no further step, in later calls either
        if now.counts.events >= stop_at or now.counts.work >= work_limit:
            return layout.BUDGET, reached
        if now.chain.logging != 0 and now.logged > room:
            return layout.LOG_FULL, reached
        if stage == layout.AT_REST:
            if (
                now.chain.logging == 0
                and now.chain.n == 2
                and now.chain.even == 1
                and now.single == 0
            ):
                end_slips(cell, whole, deviate, now, theta[reached], theta_low[reached], stop_at)
                if now.counts.events >= stop_at:
                    continue
            if not _ramp(cell, whole, now, log, theta[reached], theta_low[reached]):
                rows.at_target(cell, whole, now, targets, first + reached)
                reached += 1
                now.counts.target += 1
        elif stage == layout.LONE:
            if _lone(cell, whole, deviate, now, log):
                return layout.RUNAWAY, reached
        elif stage == layout.CLUSTER:
            if series is None:  # known when this is compiled
                return layout.BUDGET, reached
            if _cluster(cell, whole, deviate, clock, series, now, log):
                return layout.RUNAWAY, reached
        else:
            _unstable(cell, whole, now, log)
        if now.single == 1 and now.stage == layout.AT_REST and now.counts.rearrangements > 0:
            return layout.ONE_DONE, reached
    return layout.DONE, reached
