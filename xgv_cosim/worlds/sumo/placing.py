"""Which coupling writes each of the placed vehicles, and how SUMO is to plan for it.

One compiled loop over them; what it keeps of each from step to step is a row of ``ROSTER``.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.columns import BoolColumn
from xgv_cosim.jit import compiled, inlinable
from xgv_cosim.worlds.sumo import in_lane, lane_table, placing_tables
from xgv_cosim.worlds.sumo.in_lane import InLane, follow, project
from xgv_cosim.worlds.sumo.lane_table import LaneTables, Row, Table
from xgv_cosim.worlds.sumo.placing_tables import DECISION, KINDS, Seen, Wanted, Way, Yields

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
_TURNED_BACK_LENGTHS = 5.0
"""Within so many lengths of its own SUMO's heading of a vehicle forgets a lane change (measured)."""
_UNTOLD_M = 1e-9
"""SUMO keeps where a vehicle is across its lane, and is told anew when that has changed by more."""
_STANDS_MPS = 0.1
"""Who is no faster stands, as SUMO has it."""
_LINE_MARGIN_M = 0.01
"""Who comes so near the end of the lane counts as one who may cross it."""


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


@inlinable
def _stops_at_red(way: int, fastest_mps: float, left_m: float) -> bool:
    """Return whether SUMO may plan for a vehicle as for one that stops at red lights.

    For one that may pass them it looks at everybody in the junction, though its plan has no say in the
    speed: with a fleet that waits at red lights that is more than all the rest of its step (measured). So
    those who stand are planned for like SUMO's own. Who drives is not: he may mean to pass, by yellow too,
    and others are to see him coming. And whoever is to cross the line SUMO would hold there.

    Args:
        way: Which coupling writes it.
        fastest_mps: Its speed before or after the step, the higher one.
        left_m: How far it is from the line at least, after the step.
    """
    by_sumo = way in (Way.CAR_FOLLOWING, Way.WORLD_DRIVER)
    return not by_sumo and fastest_mps <= _STANDS_MPS and left_m > _LINE_MARGIN_M


@inlinable
def _shifts(row: Row, way: int, lateral_m: float) -> bool:
    """Return whether SUMO is to be told how far a vehicle is across its lane, and keep what it is told."""
    if way not in (Way.LANE, Way.MIRROR, Way.CAR_FOLLOWING):
        row.told_lane = -1
        return False
    if row.told_lane == row.lane and way == row.way and abs(lateral_m - row.told_m) <= _UNTOLD_M:
        return False
    row.told_lane, row.told_m = row.lane, lateral_m
    return True


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
    replans: bool
    """SUMO is to plan otherwise for somebody at red lights."""


_TELLS, _MAY_CHANGE_LANE, _REACHES_OUT, _SWITCHES, _RESTS, _REPLANS = range(6)


@inlinable
def _note(any_of: BoolColumn, found: Row) -> None:
    """Take note of what there is to act on."""
    any_of[_TELLS] |= found.tells
    any_of[_MAY_CHANGE_LANE] |= found.may_change_lane
    any_of[_REACHES_OUT] |= found.reaches_out


@inlinable
def _reach_m(place: InLane, width_m: float) -> float:
    """Return how far a body of a width may reach from the centre line of its lane."""
    swing_m = abs(place.lateral_m - place.body_lateral_m)  # half the length by the sine of the yaw
    return abs(place.body_lateral_m) + swing_m + 0.5 * width_m


@inlinable
def _note_place(found: Row, place: InLane, before_m: float, lane_width_m: float) -> None:
    """Keep where in its lane a vehicle is."""
    found.position_m = place.position_m
    found.along_m = place.position_m - before_m
    found.lateral_m, found.body_lateral_m = place.lateral_m, place.body_lateral_m
    found.lane_width_m = lane_width_m


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
            follow(tables.lanes, row, -1, -1)
            found.way, found.stops_at_red = row.way, row.stops_at_red
            row.told_lane = -1
            continue
        lane, length_m = seen.lane[number], seen.length_m[number]
        follow(tables.lanes, row, lane, seen.next_lane[number])
        before_m, travelled_m = seen.position_m[number], wanted.travelled_m[number]
        speed_mps, width_m, half_m = wanted.speed_mps[number], 0.0, 0.0
        place = InLane(np.nan, np.nan, np.nan, np.nan, np.nan)
        leads_on = seen.ends_route[number] or seen.next_lane[number] >= 0
        if lane >= 0:
            width_m = tables.lanes[lane].width_m
            half_m = 0.5 * width_m
            place = project(
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
        row.yields, found.way = yields, way
        any_of[_SWITCHES] |= way != row.way
        if way == Way.FREE and row.way == Way.FREE and place.position_m > tables.lanes[lane].length_m:
            row.crossing_m *= tables.leftwards  # ``moveToXY`` counts to the left in every network
        row.changes_lane = False
        found.may_change_lane = _by_driver(row.way) and not _by_driver(way)
        is_ours = way not in (Way.CAR_FOLLOWING, Way.WORLD_DRIVER)
        fastest_mps = max(abs(speed_mps), seen.speed_mps[number])
        left_m = tables.lanes[lane].length_m - before_m if lane >= 0 else 0.0
        goes_m = max(travelled_m, along_m, fastest_mps * step_s)
        found.stops_at_red = _stops_at_red(way, fastest_mps, left_m - goes_m)
        found.shifts = _shifts(row, way, place.lateral_m)
        any_of[_REPLANS] |= found.stops_at_red != row.stops_at_red
        stands = is_ours and speed_mps == 0.0 and seen.speed_mps[number] == 0.0
        row.rest_steps = row.rest_steps + 1 if stands else 0
        any_of[_RESTS] |= row.rest_steps * step_s >= rest_s
        found.reaches_out = lane < 0 or _reach_m(place, seen.width_m[number]) > half_m
        _note_place(found, place, before_m, width_m)
        _note(any_of, found)


def placing_sources() -> list[Path]:
    """Return every file whose code the compiled loop contains."""
    actuation = Path(__file__).parents[2] / "actuation.py"
    return [
        *(Path(str(module.__file__)) for module in (in_lane, lane_table, placing_tables)),
        Path(__file__),
        actuation,
    ]


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
    decisions, any_of = np.zeros(len(roster), DECISION), np.zeros(len(Decided._fields) - 1, np.bool_)
    _decide_compiled(tables, roster, seen, wanted, step_s, rest_s, decisions, any_of)
    return Decided(decisions, *any_of.tolist())
