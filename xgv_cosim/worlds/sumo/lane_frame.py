"""Where the plant's poses lie in the lanes, and which pose SUMO would give a vehicle that drives there.

SUMO knows a vehicle by its lane, a position along it and an offset across; pose and heading follow from
them: the front bumper lies beside the lane's centre line, and the heading is that of the chord from the
rear bumper to it, both at the same offset; while the rear bumper is still on the lane before, it keeps the
offset that the front had there. Everything here is columns over the placed vehicles.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.road import SumoRoad

_LANES_BEHIND = 4
"""So many lanes behind its own a vehicle's body may reach into: edge, junction, edge, junction."""
_REAR_OFFSET_M = 0.04
"""So well is it known (measured) where SUMO has the rear bumper across a lane that the front has left."""
_SEARCHES = 3
"""Projections onto the lane: the plant's distance and the lane's differ in curves."""


class InLane(NamedTuple):
    """Placed vehicles in the frames of their lanes; every column has shape ``(n,)``, ``nan`` off-road."""

    position_m: FloatColumn
    """Front bumper from the beginning of the lane that held it before the step; may lie past its end."""
    lateral_m: FloatColumn
    """Front bumper from the lane's centre line, positive left."""
    body_lateral_m: FloatColumn
    """Centre of the body, likewise."""
    width_m: FloatColumn
    """Width of the lane before the step."""
    error_m: FloatColumn
    """Distance of SUMO's front bumper from the plant's, if SUMO has it at this position and offset."""
    error_rad: FloatColumn
    """Largest difference of SUMO's heading from the plant's then, ``nan`` where SUMO's cannot be told."""


@dataclass(slots=True)
class LaneFrames:
    """Projects placements onto lanes; remembers the lanes behind each vehicle."""

    road: SumoRoad
    _ids: tuple[str, ...] = ()
    _lane: IntColumn = field(default_factory=lambda: np.zeros(0, np.int64))
    """Of each vehicle the lane on which it was last seen."""
    _next_lane: IntColumn = field(default_factory=lambda: np.zeros(0, np.int64))
    """And the one after that."""
    _behind: dict[str, tuple[int, ...]] = field(default_factory=dict)
    """The lanes that each vehicle has come over, nearest first."""
    _lateral_m: dict[str, float] = field(default_factory=dict)
    """Where each front bumper was across its lane in the step before."""
    _crossing_m: dict[str, float] = field(default_factory=dict)
    """And before it came onto its present lane: SUMO leaves the rear bumper there until it is over too."""

    def follow(self, ids: tuple[str, ...], lane: IntColumn, next_lane: IntColumn) -> None:
        """Note which lanes the vehicles are on now; -1 where SUMO has them on none."""
        if ids != self._ids:
            known = {name: place for place, name in enumerate(self._ids)}
            old = np.array([known.get(name, -1) for name in ids], np.int64)
            self._ids = ids
            self._lane = np.where(old >= 0, np.append(self._lane, -1)[old], lane)
            self._next_lane = np.where(old >= 0, np.append(self._next_lane, -1)[old], next_lane)
        for place in np.flatnonzero(lane != self._lane).tolist():
            before = int(self._lane[place]), int(self._next_lane[place])
            self._behind[ids[place]] = self._path(ids[place], *before, int(lane[place]))
        self._lane, self._next_lane = lane, next_lane

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that is bound no longer."""
        for kept in (self._behind, self._lateral_m, self._crossing_m):
            kept.pop(vehicle_id, None)

    def _path(self, name: str, left: int, following: int, now: int) -> tuple[int, ...]:
        """Return the lanes behind, nearest first, now that ``left`` was left; none after a lane change."""
        behind = (left, *self._behind.get(name, ()))
        lane = following
        while lane >= 0 and lane != now and len(behind) <= 2 * _LANES_BEHIND:
            behind = (lane, *behind)
            lane = self.road.only_successor(lane)
        return behind[:_LANES_BEHIND] if lane == now and left >= 0 else ()

    def project(self, placement: Placement, before: Snapshot, rows: IntColumn, at: IntColumn) -> InLane:
        """Return where the vehicles at ``at`` in the placement lie in their lanes.

        Args:
            placement: Where the plant puts the vehicles.
            before: The world before the step.
            rows: Rows of those vehicles in ``before``, shape ``(k,)``.
            at: Their places in the placement, shape ``(k,)``.
        """
        road, heading_rad = self.road, placement.heading_rad[at]
        front_x_m, front_y_m = placement.front_x_m[at], placement.front_y_m[at]
        lane, next_lane, length_m = before.lane[rows], before.next_lane[rows], before.length_m[rows]
        position_m = before.lane_position_m[rows] + placement.travelled_m[at]
        for _ in range(_SEARCHES):
            centre = road.points_ahead(lane, position_m, next_lane)
            cosine, sine = np.cos(centre.heading_rad), np.sin(centre.heading_rad)
            east_m, north_m = front_x_m - centre.x_m, front_y_m - centre.y_m
            lateral_m = north_m * cosine - east_m * sine
            position_m = position_m + np.nan_to_num(east_m * cosine + north_m * sine)
        body_m = lateral_m - 0.5 * length_m * np.sin(heading_rad - centre.heading_rad)
        front = road.points_ahead(lane, position_m, next_lane)
        sumo_x_m = front.x_m - lateral_m * np.sin(front.heading_rad)
        sumo_y_m = front.y_m + lateral_m * np.cos(front.heading_rad)
        names = [placement.ids[index] for index in at.tolist()]
        rear_lateral_m = self._rear_lateral_m(names, lane, position_m, length_m, lateral_m)
        rear = road.points_ahead(*self._rear_lanes(names, lane, position_m - length_m, next_lane))
        chord_x_m = sumo_x_m - (rear.x_m - rear_lateral_m * np.sin(rear.heading_rad))
        chord_y_m = sumo_y_m - (rear.y_m + rear_lateral_m * np.cos(rear.heading_rad))
        turned_rad = np.arctan2(chord_y_m, chord_x_m) - heading_rad
        turned_rad = np.abs(np.remainder(turned_rad + np.pi, 2.0 * np.pi) - np.pi)
        unsure_rad = np.where(position_m < length_m, _REAR_OFFSET_M / length_m, 0.0)
        return InLane(
            position_m,
            lateral_m,
            body_m,
            road.lane_width_m(lane),
            np.hypot(front_x_m - sumo_x_m, front_y_m - sumo_y_m),
            turned_rad + unsure_rad,
        )

    def _rear_lateral_m(
        self,
        names: list[str],
        lane: IntColumn,
        position_m: FloatColumn,
        length_m: FloatColumn,
        lateral_m: FloatColumn,
    ) -> FloatColumn:
        """Return where the rear bumpers are across their lanes: where the front is, or was as it crossed."""
        crossing = (lane >= 0) & (position_m > self.road.lane_length_m(lane))
        rear_lateral_m = lateral_m.copy()
        for index in np.flatnonzero(crossing | (position_m < length_m)).tolist():
            name = names[index]
            if crossing[index]:
                self._crossing_m[name] = self._lateral_m.get(name, float("nan"))
            rear_lateral_m[index] = self._crossing_m.get(name, float("nan"))
        self._lateral_m.update(zip(names, lateral_m.tolist(), strict=True))
        return rear_lateral_m

    def _rear_lanes(
        self, names: list[str], lane: IntColumn, position_m: FloatColumn, next_lane: IntColumn
    ) -> tuple[IntColumn, FloatColumn, IntColumn]:
        """Return lane, position and next lane of the rear bumpers; lane -1 where it is not known."""
        overhangs: BoolColumn = (position_m < 0.0) & (lane >= 0)
        if not overhangs.any():
            return lane, position_m, next_lane
        lane, position_m, next_lane = lane.copy(), position_m.copy(), next_lane.copy()
        for index in np.flatnonzero(overhangs).tolist():
            for previous in self._behind.get(names[index], ()):
                next_lane[index], lane[index] = lane[index], previous
                position_m[index] += self.road.lengths_m[previous]
                if position_m[index] >= 0.0:
                    break
            else:
                lane[index] = -1
        return lane, position_m, next_lane
