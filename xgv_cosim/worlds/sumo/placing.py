"""Where the plant's poses lie in the lanes, what SUMO would make of them there, and which coupling follows.

One compiled loop over the placed vehicles; what it keeps of each from step to step is a row of ``ROSTER``.

SUMO knows a vehicle by its lane, a position along it and an offset across; pose and heading follow from
them: the front bumper lies beside the lane's centre line, and the heading is that of the chord from the
rear bumper to it, both at the same offset; while the rear bumper is still on the lane before, it keeps the
offset that the front had there.
"""

from __future__ import annotations

import math
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.jit import compiled, inlinable
from xgv_cosim.worlds.sumo import lane_table
from xgv_cosim.worlds.sumo.lane_table import LaneTables, Row, Table, point_ahead

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn


class Way(IntEnum):
    """Which coupling writes a vehicle, see ``couplings``."""

    NONE = 0
    """None yet: the vehicle was bound since the last step."""
    FREE = 1
    LANE = 2
    MIRROR = 3
    LANE_KEEPING = 4
    CAR_FOLLOWING = 5
    WORLD_DRIVER = 6


class Yields(IntEnum):
    """Why the free coupling stands in for the one that ownership asks for."""

    NOTHING = 0
    OFF_ROAD = 1
    OUTSIDE = 2
    REVERSES = 3
    DEAD_END = 4


KINDS = tuple(CouplingKind)
"""Numbers of the kinds in ``ROSTER``."""
_FREE_KIND, _LANE_KIND = KINDS.index(CouplingKind.FREE), KINDS.index(CouplingKind.LANE)

TOLERANCE_M = 0.05
"""Largest distance of SUMO's front bumper from the plant's while a vehicle is mirrored."""
TOLERANCE_RAD = math.radians(1.0)
"""Largest difference of SUMO's heading from the plant's meanwhile."""
SETTLING_STEPS = 5
"""A vehicle is mirrored only after so many steps in a row in which that would have been exact."""
REFUSED_STEPS = -10 * SETTLING_STEPS
"""Where that count begins after SUMO did otherwise than was foreseen."""
_BACKWARDS_M = 1e-3
"""So far back the projection may fall in one step without it being reverse."""
_REAR_OFFSET_M = 0.04
"""So well is it known (measured) where SUMO has the rear bumper across a lane that the front has left."""
_SEARCHES = 3
"""Projections onto the lane: the plant's distance and the lane's differ in curves."""
_LANES_BEHIND = 4
"""So many lanes behind its own a vehicle's body may reach into: edge, junction, edge, junction."""
_TURNED_BACK_LENGTHS = 5.0
"""Within so many lengths of its own SUMO's heading of a vehicle forgets a lane change (measured)."""
_UNSEEN = -2
"""Lane of a vehicle that was not looked at before."""

ROSTER = np.dtype(
    [
        ("kind", np.uint8),
        ("way", np.uint8),
        ("yields", np.uint8),
        ("changes_lane", np.bool_),
        ("exact_steps", np.int64),
        ("rest_steps", np.int64),
        ("lane", np.int64),
        ("next_lane", np.int64),
        ("road_lane", np.int64),
        ("cleared_lane", np.int64),
        ("behind_0", np.int64),
        ("behind_1", np.int64),
        ("behind_2", np.int64),
        ("behind_3", np.int64),
        ("lateral_m", np.float64),
        ("crossing_m", np.float64),
        ("since_change_m", np.float64),
    ]
)
"""What is kept of a bound vehicle.

``kind`` place of its ``CouplingKind`` in ``KINDS``; ``way`` what wrote it last; ``yields`` why that was the
free coupling; ``changes_lane`` SUMO is to end a lane change of its driver in this step, for the computer has
taken the wheel; ``exact_steps`` steps in a row in which mirroring was exact, below 0 after a refusal;
``rest_steps`` steps for which it has been held at rest; ``lane``, ``next_lane`` where it was seen last;
``road_lane`` the last one that was a lane, ``cleared_lane`` the one beside which SUMO has nothing of it left;
``behind_0`` to ``behind_3`` the lanes that it has come over, nearest first, -1: no more; ``lateral_m`` where
its front bumper was across its lane in the step before, and ``crossing_m`` before it came onto its present
lane; ``since_change_m`` how far it has driven since SUMO's driver changed lanes, as far as that matters.
"""


def new_row(kind: CouplingKind) -> Table:
    """Return the row of a vehicle that has just been bound, shape ``(1,)``."""
    row = np.zeros(1, ROSTER)
    row["kind"] = KINDS.index(kind)
    row["lane"] = row["next_lane"] = _UNSEEN
    row["road_lane"] = row["cleared_lane"] = -1
    for number in range(_LANES_BEHIND):
        row[f"behind_{number}"] = -1
    row["lateral_m"] = row["crossing_m"] = np.nan
    row["since_change_m"] = np.inf
    return row


class Seen(NamedTuple):
    """The placed vehicles as SUMO has them before the step; every column has shape ``(n,)``."""

    is_here: BoolColumn
    """False: SUMO has the vehicle nowhere for the moment."""
    lane: IntColumn
    """-1 off the road."""
    next_lane: IntColumn
    position_m: FloatColumn
    speed_mps: FloatColumn
    length_m: FloatColumn
    width_m: FloatColumn
    ends_route: BoolColumn
    """Its route ends within this step."""


class Wanted(NamedTuple):
    """The placed vehicles as the plant wants them after the step, likewise."""

    front_x_m: FloatColumn
    front_y_m: FloatColumn
    heading_rad: FloatColumn
    speed_mps: FloatColumn
    travelled_m: FloatColumn
    computer_speed: BoolColumn
    computer_steering: BoolColumn


DECISION = np.dtype(
    [
        ("way", np.uint8),
        ("may_change_lane", np.bool_),
        ("tells", np.bool_),
        ("reaches_out", np.bool_),
        ("position_m", np.float64),
        ("along_m", np.float64),
        ("lateral_m", np.float64),
        ("body_lateral_m", np.float64),
        ("lane_width_m", np.float64),
    ]
)
"""What the loop found for one vehicle, all 0 where SUMO has it nowhere.

``way`` which coupling is to write it; ``may_change_lane`` SUMO is to be asked whether it is in a lane change;
``tells`` ``yields`` has changed; ``reaches_out`` its body may reach beyond its lane, or there is none;
``position_m`` where the plant has the front bumper along the lane before the step, maybe past its end;
``along_m`` distance along the lane from where SUMO has the front bumper to where the plant puts it;
``lateral_m`` the front bumper from the centre line of the lane before the step, positive left;
``body_lateral_m`` the centre of the body, likewise; ``lane_width_m`` that lane's width. ``nan`` off the road.
"""


class InLane(NamedTuple):
    """A pose in the frame of its lane."""

    position_m: float
    """Front bumper from the beginning of the lane; may lie past its end."""
    lateral_m: float
    body_lateral_m: float
    error_m: float
    """Distance of SUMO's front bumper from the plant's, if SUMO has it at this position and offset."""
    error_rad: float
    """Largest difference of SUMO's heading from the plant's then, ``nan`` where SUMO's cannot be told."""


@inlinable
def _follow(lanes: Table, row: Row, lane: int, next_lane: int) -> None:
    """Note on which lane the vehicle is now, and the lanes behind it; none after a lane change."""
    left, lane_between = row.lane, row.next_lane
    if left not in (_UNSEEN, lane):
        path = np.full(4 * _LANES_BEHIND, -1)
        path[0] = left
        count = 1
        while lane_between >= 0 and lane_between != lane and count <= 2 * _LANES_BEHIND:
            for place in range(count, 0, -1):
                path[place] = path[place - 1]
            path[0] = lane_between
            count += 1
            lane_between = lanes[lane_between].only_successor
        if lane_between == lane and left >= 0:
            path[count], path[count + 1] = row.behind_0, row.behind_1
            path[count + 2], path[count + 3] = row.behind_2, row.behind_3
        else:
            path[:] = -1
        row.behind_0, row.behind_1, row.behind_2, row.behind_3 = path[0], path[1], path[2], path[3]
    row.lane, row.next_lane = lane, next_lane
    if lane >= 0:
        row.road_lane = lane


@inlinable
def _rear(
    tables: LaneTables, row: Row, lane: int, position_m: float, next_lane: int
) -> tuple[int, float, int]:
    """Return lane, position and next lane of the rear bumper; lane -1 where it is not known."""
    if position_m >= 0.0 or lane < 0:
        return lane, position_m, next_lane
    for number in range(_LANES_BEHIND):
        previous = row.behind_0
        if number == 1:
            previous = row.behind_1
        elif number == 2:
            previous = row.behind_2
        elif number == 3:
            previous = row.behind_3
        if previous < 0:
            break
        next_lane, lane = lane, previous
        position_m += tables.lanes[previous].length_m
        if position_m >= 0.0:
            return lane, position_m, next_lane
    return -1, position_m, next_lane


@inlinable
def _rear_lateral_m(
    row: Row, lane_length_m: float, position_m: float, length_m: float, lateral_m: float
) -> float:
    """Return where the rear bumper is across its lane: where the front is, or was as it crossed."""
    crossing = position_m > lane_length_m
    if crossing:
        row.crossing_m = row.lateral_m
    row.lateral_m = lateral_m
    return row.crossing_m if crossing or position_m < length_m else lateral_m


@inlinable
def _wrapped(angle_rad: float) -> float:
    return (angle_rad + np.pi) % (2.0 * np.pi) - np.pi


@inlinable
def _in_lane(
    tables: LaneTables,
    row: Row,
    position_m: float,
    length_m: float,
    x_m: float,
    y_m: float,
    heading_rad: float,
) -> InLane:
    """Project a front bumper onto the lane of ``row``, near ``position_m``; that lane exists."""
    lane, next_lane = row.lane, row.next_lane
    lateral_m = 0.0
    centre = point_ahead(tables, lane, position_m, next_lane)
    for search in range(_SEARCHES):
        if search > 0:
            centre = point_ahead(tables, lane, position_m, next_lane)
        east_m, north_m = x_m - centre.x_m, y_m - centre.y_m
        lateral_m = north_m * centre.cosine - east_m * centre.sine
        position_m += east_m * centre.cosine + north_m * centre.sine
    body_m = lateral_m - 0.5 * length_m * math.sin(heading_rad - centre.heading_rad)
    front = point_ahead(tables, lane, position_m, next_lane)
    sumo_x_m, sumo_y_m = front.x_m - lateral_m * front.sine, front.y_m + lateral_m * front.cosine
    lane_length_m = tables.lanes[lane].length_m
    rear_lateral_m = _rear_lateral_m(row, lane_length_m, position_m, length_m, lateral_m)
    rear_lane, rear_position_m, after_rear = _rear(tables, row, lane, position_m - length_m, next_lane)
    rear = point_ahead(tables, rear_lane, rear_position_m, after_rear)
    chord_x_m = sumo_x_m - (rear.x_m - rear_lateral_m * rear.sine)
    chord_y_m = sumo_y_m - (rear.y_m + rear_lateral_m * rear.cosine)
    turned_rad = abs(_wrapped(math.atan2(chord_y_m, chord_x_m) - heading_rad))
    unsure_rad = _REAR_OFFSET_M / length_m if position_m < length_m else 0.0
    return InLane(
        position_m,
        lateral_m,
        body_m,
        math.hypot(x_m - sumo_x_m, y_m - sumo_y_m),
        turned_rad + unsure_rad,
    )


@inlinable
def _asked(kind: int, computer_speed: bool, computer_steering: bool) -> Way:
    """Return the coupling that ownership asks for."""
    if computer_speed and computer_steering:
        if kind == _FREE_KIND:
            return Way.FREE
        return Way.LANE if kind == _LANE_KIND else Way.MIRROR
    if computer_speed:
        return Way.LANE_KEEPING
    return Way.CAR_FOLLOWING if computer_steering else Way.WORLD_DRIVER


@inlinable
def _yields(asked: int, is_off_road: bool, is_outside: bool, reverses: bool, leads_on: bool) -> Yields:
    """Return why SUMO cannot do what is asked of it, ``Yields.NOTHING`` if it can."""
    if is_off_road:
        return Yields.OFF_ROAD
    if is_outside and asked in (Way.LANE, Way.CAR_FOLLOWING):
        return Yields.OUTSIDE
    if reverses and asked in (Way.LANE, Way.LANE_KEEPING):
        return Yields.REVERSES
    if asked == Way.LANE and not leads_on:
        return Yields.DEAD_END
    return Yields.NOTHING


@inlinable
def _has_turned_back(row: Row, travelled_m: float, length_m: float) -> bool:
    """Return whether SUMO's heading has nothing left of a lane change; call once a step."""
    since_change_m: float = row.since_change_m + max(travelled_m, 0.0)
    row.since_change_m = since_change_m
    return since_change_m > _TURNED_BACK_LENGTHS * length_m


@inlinable
def _by_driver(way: int) -> bool:
    """Return whether SUMO's driver steers, or nobody has written the vehicle yet."""
    return way in (Way.NONE, Way.LANE_KEEPING, Way.WORLD_DRIVER)


class Decided(NamedTuple):
    """What was decided, and whether there is anything in it to act on."""

    found: Table
    """Rows of ``DECISION``."""
    tells: bool
    may_change_lane: bool
    reaches_out: bool
    switches: bool
    """Somebody is to be written in another way than last."""
    rests: bool
    """Somebody has been held at rest for as long as was asked about."""


_TELLS, _MAY_CHANGE_LANE, _REACHES_OUT, _SWITCHES, _RESTS = range(5)


@inlinable
def _note(any_of: BoolColumn, found: Row) -> None:
    """Take note of what there is to act on."""
    any_of[_TELLS] |= found.tells
    any_of[_MAY_CHANGE_LANE] |= found.may_change_lane
    any_of[_REACHES_OUT] |= found.reaches_out


def decide_in_place(
    tables: LaneTables,
    roster: Table,
    seen: Seen,
    wanted: Wanted,
    step_s: float,
    rest_s: float,
    decisions: Table,
    any_of: BoolColumn,
) -> None:
    """Decide for every placed vehicle, in ``roster`` and ``decisions``; see there and ``Decided``."""
    for number in range(len(roster)):
        row, found = roster[number], decisions[number]
        if not seen.is_here[number]:
            _follow(tables.lanes, row, -1, -1)
            found.way = row.way
            continue
        lane, length_m = seen.lane[number], seen.length_m[number]
        _follow(tables.lanes, row, lane, seen.next_lane[number])
        before_m, travelled_m = seen.position_m[number], wanted.travelled_m[number]
        speed_mps, width_m, half_m = wanted.speed_mps[number], 0.0, 0.0
        place = InLane(np.nan, np.nan, np.nan, np.nan, np.nan)
        leads_on = seen.ends_route[number] or seen.next_lane[number] >= 0
        if lane >= 0:
            width_m = tables.lanes[lane].width_m
            half_m = 0.5 * width_m
            place = _in_lane(
                tables,
                row,
                before_m + travelled_m,
                length_m,
                wanted.front_x_m[number],
                wanted.front_y_m[number],
                wanted.heading_rad[number],
            )
            ahead_m = max(travelled_m, speed_mps * step_s)
            leads_on = leads_on or tables.lanes[lane].length_m - before_m > ahead_m
        along_m = place.position_m - before_m
        asked = _asked(row.kind, wanted.computer_speed[number], wanted.computer_steering[number])
        is_exact = (
            _has_turned_back(row, travelled_m, length_m)
            and leads_on
            and place.error_m <= TOLERANCE_M
            and place.error_rad <= TOLERANCE_RAD
            and abs(place.lateral_m) <= half_m
            and abs(place.body_lateral_m) <= half_m
            and (along_m >= 0.0 or (along_m >= -_BACKWARDS_M and speed_mps == 0.0))
        )
        way, yields = asked, Yields.NOTHING
        if asked == Way.MIRROR:
            row.exact_steps = (
                min(row.exact_steps + 1, SETTLING_STEPS) if is_exact else min(row.exact_steps, 0)
            )
            way = Way.MIRROR if is_exact and row.exact_steps >= SETTLING_STEPS else Way.FREE
        elif asked != Way.FREE:
            is_outside = abs(place.body_lateral_m) > half_m and not seen.ends_route[number]
            yields = _yields(asked, lane < 0, is_outside, travelled_m < 0.0, leads_on)
            found.tells = yields != row.yields
            way = Way.FREE if yields != Yields.NOTHING else asked
        row.yields = yields
        found.way = way
        any_of[_SWITCHES] |= way != row.way
        if way == Way.FREE and row.way == Way.FREE and place.position_m > tables.lanes[lane].length_m:
            row.crossing_m *= tables.leftwards  # ``moveToXY`` counts to the left in every network
        row.changes_lane = False
        found.may_change_lane = _by_driver(row.way) and not _by_driver(way)
        is_ours = way not in (Way.CAR_FOLLOWING, Way.WORLD_DRIVER)
        stands = is_ours and speed_mps == 0.0 and seen.speed_mps[number] == 0.0
        row.rest_steps = row.rest_steps + 1 if stands else 0
        any_of[_RESTS] |= row.rest_steps * step_s >= rest_s
        found.position_m = place.position_m
        found.along_m, found.lateral_m, found.body_lateral_m = along_m, place.lateral_m, place.body_lateral_m
        found.lane_width_m = width_m
        swing_m = abs(place.lateral_m - place.body_lateral_m)  # half the length by the sine of the yaw
        reach_m = abs(place.body_lateral_m) + swing_m + 0.5 * seen.width_m[number]
        found.reaches_out = lane < 0 or reach_m > half_m
        _note(any_of, found)


def placing_sources() -> list[Path]:
    """Return every file whose code the compiled loop contains."""
    actuation = Path(__file__).parents[2] / "actuation.py"
    return [Path(__file__), Path(lane_table.__file__), actuation]


_decide_compiled = compiled(decide_in_place, placing_sources())


def decide(
    tables: LaneTables, roster: Table, seen: Seen, wanted: Wanted, step_s: float, rest_s: float
) -> Decided:
    """Return a ``DECISION`` for every placed vehicle; what is kept of them in ``roster`` goes on.

    Args:
        tables: The lanes.
        roster: Rows of ``ROSTER``, in the order of the placement.
        seen: Before the step.
        wanted: After the step.
        step_s: World step.
        rest_s: Who has been held at rest for so long is to be told of (``Decided.rests``).
    """
    decisions, any_of = np.zeros(len(roster), DECISION), np.zeros(5, np.bool_)
    _decide_compiled(tables, roster, seen, wanted, step_s, rest_s, decisions, any_of)
    return Decided(decisions, *any_of.tolist())
