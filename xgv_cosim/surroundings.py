"""What surrounds the vehicles that have a stack: their way ahead, neighbours, signals, right of way.

Dense facts are columns over the vehicles asked for; what few of them have is a tuple of small objects.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.road import Road
    from xgv_cosim.snapshot import Snapshot

PREVIEW_M = np.array(
    [
        *(
            0.0,
            1.5,
            3.0,
            4.5,
            6.0,
            8.0,
            10.0,
            12.5,
            15.0,
            18.0,
            21.0,
            25.0,
            30.0,
            35.0,
            41.0,
            48.0,
            56.0,
            65.0,
        ),
        *(75.0, 86.0, 98.0, 111.0, 125.0, 140.0, 156.0, 173.0, 190.0),
    ]
)
"""Distances beyond the front bumper at which a stack sees its way; full braking from 50 m/s needs 160 m."""


@dataclass(frozen=True, slots=True)
class Foe:
    """Somebody whose way crosses or joins the own one at the junction ahead."""

    vehicle_id: str
    own_entry_m: float
    """From the own front bumper to where the ways meet; below 0 inside."""
    own_exit_m: float
    """From the own front bumper to where the ways part again."""
    foe_entry_m: float
    """From the foe's front bumper to where the ways meet; below 0 inside."""
    foe_exit_m: float
    """From the foe's front bumper to where the ways part again; he is clear when his length has passed it."""
    speed_mps: float
    length_m: float
    first: bool
    """The foe goes first: by the rules of the road, or because he is inside already."""
    yields: bool
    """The foe has to let the own vehicle pass."""


@dataclass(frozen=True, slots=True)
class Junction:
    """The next line on the way at which others may have the right of way."""

    line_m: float
    """From the front bumper to where a vehicle waits for others: before the junction, or inside it."""
    exit_m: float
    """From the front bumper to where the way leaves the junction."""
    right_of_way: str
    """``major``; ``minor``: yield; ``stop``: stop and yield; ``equal``: the right comes first;
    ``allway_stop``; ``zipper``: in turn."""
    foes: tuple[Foe, ...] = ()
    """Who is in its conflict areas, or comes to them."""

    @property
    def must_yield(self) -> bool:
        """Return whether others may have the right of way here."""
        return self.right_of_way != "major"


@dataclass(frozen=True, slots=True)
class Signal:
    """The next traffic light on the way."""

    line_m: float
    """From the front bumper to its stop line."""
    letter: str
    """Its state in the letters of SUMO: r red, u red and yellow, y yellow, g green without, G with priority,
    s green arrow, o blinking, O off."""

    @property
    def colour(self) -> str:
        """Return ``red``, ``yellow``, ``green`` or ``off``."""
        return _COLOURS.get(self.letter, "off")


_COLOURS = {"r": "red", "u": "red", "y": "yellow", "Y": "yellow", "g": "green", "G": "green", "s": "red"}


class Beside(NamedTuple):
    """The lane to one side of each vehicle; every column has shape ``(n,)``."""

    offset_m: FloatColumn
    """From the own centre line to that lane's, positive left; ``nan`` where no lane may be changed to."""
    leader_gap_m: FloatColumn
    """From the own front bumper to the rear one of who drives ahead there, below 0 beside; ``inf``: none."""
    leader_speed_mps: FloatColumn
    follower_gap_m: FloatColumn
    """From the own rear bumper to the front one of who comes behind there, below 0 beside; ``inf``: none."""
    follower_speed_mps: FloatColumn


class Surroundings(NamedTuple):
    """What surrounds ``n`` vehicles; columns of shape ``(n,)``, frame east-north-up."""

    way_x_m: FloatMatrix
    """Centre line of the lanes along the route at ``PREVIEW_M``, shape ``(n, len(PREVIEW_M))``."""
    way_y_m: FloatMatrix
    has_way: BoolColumn
    """Whether the way is known: on the road, or off it the way that was left."""
    lane: IntColumn
    """Number of the lane in ``Road``, -1 off-road."""
    lateral_m: FloatColumn
    """Front bumper from the lane's centre line, positive left."""
    lane_width_m: FloatColumn
    limit_mps: FloatColumn
    """Speed limit of the lane, ``inf`` without a way."""
    limits_ahead: tuple[tuple[tuple[float, float], ...], ...]
    """Of each vehicle: (distance from the front bumper, limit from there on) of each change ahead."""
    lane_end_m: FloatColumn
    """From the front bumper to where the own lane no longer leads on along the route; ``inf``: it does."""
    lane_changes: IntColumn
    """Lanes to be changed until then, positive to the left, 0: none."""
    route_end_m: FloatColumn
    """From the front bumper to the end of the route; ``inf``: not in sight."""
    leader_gap_m: FloatColumn
    """From the own front bumper to the rear one of who drives ahead; ``inf``: nobody in sight."""
    leader_speed_mps: FloatColumn
    left: Beside
    right: Beside
    signals: tuple[Signal | None, ...]
    junctions: tuple[Junction | None, ...]


def nobody_beside(count: int) -> Beside:
    """Return columns that say: no lane beside."""
    endless, still = np.full(count, np.inf), np.zeros(count)
    return Beside(np.full(count, np.nan), endless, still, endless, still)


def rows_of(snapshot: Snapshot, vehicle_ids: Sequence[str]) -> IntColumn:
    """Return the row of each vehicle in the snapshot, -1 where it is not there."""
    return np.array([snapshot.index_of.get(vehicle_id, -1) for vehicle_id in vehicle_ids], np.int64)


def leaders_of(snapshot: Snapshot, rows: IntColumn) -> tuple[FloatColumn, FloatColumn]:
    """Return (gap, speed) of the leader of each row as the snapshot has it; ``inf`` and 0 without one."""
    leader = snapshot.leader[rows]
    seen = leader >= 0
    speed = np.where(seen, snapshot.speed_mps[leader], 0.0)
    return np.where(seen, snapshot.leader_gap_m[rows], np.inf), speed


def plain_surroundings(snapshot: Snapshot, road: Road, vehicle_ids: Sequence[str]) -> Surroundings:
    """Return what a world knows that has lanes and vehicles only: no routes, neighbours or signals."""
    rows, count = rows_of(snapshot, vehicle_ids), len(vehicle_ids)
    lane = snapshot.lane[rows]
    on_road = lane >= 0
    position_m = snapshot.lane_position_m[rows]
    flat = (position_m[:, None] + PREVIEW_M).ravel()
    way = road.points_ahead(
        np.repeat(lane, PREVIEW_M.size), flat, np.repeat(snapshot.next_lane[rows], PREVIEW_M.size)
    )
    way_x_m, way_y_m = way.x_m.reshape(count, -1), way.y_m.reshape(count, -1)
    heading_rad = way.heading_rad.reshape(count, -1)[:, 0]
    gap_m, speed_mps = leaders_of(snapshot, rows)
    endless = np.full(count, np.inf)
    return Surroundings(
        way_x_m=way_x_m,
        way_y_m=way_y_m,
        has_way=on_road,
        lane=lane,
        lateral_m=lateral_m(snapshot, rows, way_x_m[:, 0], way_y_m[:, 0], heading_rad),
        lane_width_m=road.lane_width_m(lane),
        limit_mps=np.where(on_road, road.lane_limit_mps(lane), np.inf),
        limits_ahead=((),) * count,
        lane_end_m=endless,
        lane_changes=np.zeros(count, np.int64),
        route_end_m=endless,
        leader_gap_m=gap_m,
        leader_speed_mps=speed_mps,
        left=nobody_beside(count),
        right=nobody_beside(count),
        signals=(None,) * count,
        junctions=(None,) * count,
    )


def lateral_m(
    snapshot: Snapshot, rows: IntColumn, x_m: FloatColumn, y_m: FloatColumn, heading_rad: FloatColumn
) -> FloatColumn:
    """Return how far the front bumpers lie to the left of points on lanes; 0 off-road."""
    east_m, north_m = snapshot.front_x_m[rows] - x_m, snapshot.front_y_m[rows] - y_m
    return np.nan_to_num(north_m * np.cos(heading_rad) - east_m * np.sin(heading_rad))
