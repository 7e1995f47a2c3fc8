"""Which lanes a body reaches into beside the one that SUMO has it on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.worlds.sumo.projecting import project

if TYPE_CHECKING:
    from collections.abc import Collection

    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.lane_table import Table
    from xgv_cosim.worlds.sumo.road import SumoRoad

APPEARS_M = 0.05
"""A body counts as in a lane when it reaches further than this beyond the line ..."""
STAYS_M = 0.0
"""... and goes on doing so as long as it reaches over the line at all."""


class Reach(NamedTuple):
    """A body in a lane that SUMO does not have it on."""

    owner: str
    lane: int
    front_m: float
    """Its foremost point, from the beginning of that lane."""
    speed_mps: float


class _Body(NamedTuple):
    name: str
    x_m: FloatColumn
    """East of its corners and of the centre of its front bumper, shape ``(5,)``."""
    y_m: FloatColumn
    width_m: float


_FRONT = 4
"""Place of the front bumper's centre among the points."""


class Owners(NamedTuple):
    """Who decides on the place across the lane, columns over the placed vehicles."""

    by_plant: BoolColumn
    """Not SUMO's driver, whose lane changes SUMO sees to itself."""
    freely: BoolColumn
    """Placed freely: SUMO takes the vehicle to the lane that its front is in."""


@dataclass(slots=True)
class Straddling:
    """Finds the lanes of an edge that bodies reach into."""

    road: SumoRoad

    def reaches(
        self,
        placement: Placement,
        before: Snapshot,
        rows: IntColumn,
        roster: Table,
        found: Table,
        owners: Owners,
        standing: Collection[tuple[str, int]],
    ) -> list[Reach]:
        """Return who reaches where at the end of the step.

        Args:
            placement: Where the plant puts the vehicles.
            before: The world before the step.
            rows: Rows of the placed vehicles in ``before``, -1 where SUMO has them nowhere.
            roster: What is kept of them, rows of ``ROSTER``; off the road the last lane counts.
            found: Rows of ``DECISION``.
            owners: Who decides on their place across the lane.
            standing: (owner, lane) of what was found in the step before.
        """
        reaches: list[Reach] = []
        numbers = np.flatnonzero(found["reaches_out"] & (rows >= 0) & owners.by_plant)
        if not len(numbers):
            return reaches
        at = rows[numbers]
        width_m = before.width_m[at]
        points_m = _points_m(placement, numbers, before.length_m[at], width_m)
        lane, around_lane = before.of("lane", at), roster["road_lane"][numbers]
        for place, number in enumerate(numbers.tolist()):
            name, now, around = placement.ids[number], int(lane[place]), int(around_lane[place])
            body = _Body(name, points_m[0, place], points_m[1, place], float(width_m[place]))
            own = now if now >= 0 and not owners.freely[number] else None
            speed_mps = float(placement.speed_mps[number])
            reaches += [
                Reach(name, reached, front_m, speed_mps)
                for reached, front_m in self._reached(body, around, own, standing)
            ]
            reaches += [
                Reach(name, reached, front_m, max(-speed_mps, 0.0))
                for reached, front_m in self._oncoming(body, around, standing)
                if reached != now
            ]
        return reaches

    def _reached(
        self, body: _Body, around: int, own: int | None, standing: Collection[tuple[str, int]]
    ) -> list[tuple[int, float]]:
        """Return (lane, foremost point) of the lanes that a body reaches into but SUMO does not have it on.

        Args:
            body: Where the body is.
            around: A lane near it, -1: none is known.
            own: The lane on which SUMO will have it, None: the one that its front is in, if any.
            standing: (owner, lane) of what was found in the step before.
        """
        if around < 0:
            return []
        reached: dict[int, float] = {}
        front_m: dict[int, float] = {}
        for side in (0, 1, -1):
            lane = around if side == 0 else self.road.beside(around, side)
            while lane >= 0:
                inside, at_m, lateral_m = self._in(lane, body, standing)
                front_m[lane] = abs(lateral_m) - 0.5 * float(self.road.widths_m[lane])
                if inside and 0.0 < at_m < self.road.lengths_m[lane]:
                    reached[lane] = at_m
                if side == 0 or not inside:
                    break
                lane = self.road.beside(lane, side)
        if own is None:
            nearest = min(front_m, key=lambda number: front_m[number])
            own = nearest if front_m[nearest] < 0.5 * body.width_m else -1  # SUMO's rule for "off the road"
        return [(lane, at_m) for lane, at_m in reached.items() if lane != own]

    def _in(self, lane: int, body: _Body, standing: Collection[tuple[str, int]]) -> tuple[bool, float, float]:
        """Return whether a body reaches into a lane, its foremost point there, and its front's offset."""
        along_m, lateral_m = project(self.road.tables, lane, body.x_m, body.y_m)
        half_m = 0.5 * float(self.road.widths_m[lane])
        least_m = STAYS_M if (body.name, lane) in standing else APPEARS_M
        inside = bool(lateral_m.min() < half_m - least_m and lateral_m.max() > least_m - half_m)
        return inside, float(along_m.max()), float(lateral_m[_FRONT])

    def _oncoming(
        self, body: _Body, around: int, standing: Collection[tuple[str, int]]
    ) -> list[tuple[int, float]]:
        """Return (lane, foremost point in its direction) of the oncoming lanes that a body reaches into.

        SUMO keeps a vehicle on lanes of its route or on none: no driver there would see it.
        """
        found = []
        for lane in self.road.oncoming(around) if around >= 0 else ():
            inside, at_m, _ = self._in(lane, body, standing)
            if inside and 0.0 < at_m < self.road.lengths_m[lane]:
                found.append((lane, at_m))
        return found


def _points_m(
    placement: Placement, numbers: IntColumn, length_m: FloatColumn, width_m: FloatColumn
) -> FloatColumn:
    """Return the corners of some bodies and the centres of their front bumpers, shape ``(2, n, 5)``."""
    front_m = np.stack([placement.front_x_m[numbers], placement.front_y_m[numbers]], axis=1)
    corners = corners_m(front_m[:, 0], front_m[:, 1], placement.heading_rad[numbers], length_m, width_m)
    points_m = np.concatenate([corners, front_m[:, None, :]], axis=1)
    return np.ascontiguousarray(np.moveaxis(points_m, 2, 0))


def corners_m(
    front_x_m: FloatColumn,
    front_y_m: FloatColumn,
    heading_rad: FloatColumn,
    length_m: FloatColumn,
    width_m: FloatColumn,
) -> FloatColumn:
    """Return the corners of bodies, shape ``(n, 4, 2)``: front left, front right, rear right, rear left."""
    forward = np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
    left = np.column_stack([-forward[:, 1], forward[:, 0]]) * (0.5 * width_m)[:, None]
    front = np.column_stack([front_x_m, front_y_m])
    rear = front - forward * length_m[:, None]
    corners: FloatColumn = np.stack([front + left, front - left, rear - left, rear + left], axis=1)
    return corners
