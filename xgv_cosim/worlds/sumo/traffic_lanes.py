"""Who drives where on the lanes: all vehicles of a snapshot in order along each lane."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.sumo import lane_search

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.worlds.sumo.network import SumoNetwork
    from xgv_cosim.worlds.sumo.road import SumoRoad

_BEHIND_M = 120.0
"""So far back followers are looked for."""


@dataclass(frozen=True)
class LaneTraffic:
    """Vehicles sorted by lane and position."""

    road: SumoRoad
    rows: IntColumn
    """Rows of the snapshot, by lane and then by position."""
    position_m: FloatColumn
    """Front bumpers, in that order."""
    first: IntColumn
    """Where each lane's vehicles begin in that order; one entry more at the end."""

    @classmethod
    def of(
        cls, road: SumoRoad, lane: IntColumn, position_m: FloatColumn, *, rows: IntColumn | None = None
    ) -> LaneTraffic:
        """Return the traffic of a snapshot's columns, or of bodies that may be in more lanes than one.

        Args:
            road: The lanes.
            lane: Of each body, shape ``(n,)``, -1: on none.
            position_m: Front bumper along it, likewise.
            rows: Whose body it is, likewise; None: the columns are the snapshot's.
        """
        on_road = np.flatnonzero(lane >= 0)
        lane, position_m = lane[on_road], position_m[on_road]
        order = np.lexsort((position_m, lane))
        first = np.searchsorted(lane[order], np.arange(len(road.lane_ids) + 1))
        whose = on_road if rows is None else rows[on_road]
        return cls(road, whose[order], position_m[order], first)

    @cached_property
    def _lists(self) -> tuple[list[int], list[float], list[int]]:
        """The columns for questions about one vehicle."""
        return self.rows.tolist(), self.position_m.tolist(), self.first.tolist()

    def on(self, lane: int) -> list[tuple[int, float]]:
        """Return (row, front bumper) of the vehicles on a lane, the first one first."""
        rows, position_m, first = self._lists
        begin, end = first[lane], first[lane + 1]
        if begin == end:
            return []
        return list(zip(rows[begin:end][::-1], position_m[begin:end][::-1], strict=True))

    def first_ahead(
        self, lanes: IntColumn, starts_m: FloatMatrix, position_m: FloatColumn, own: IntColumn
    ) -> tuple[IntColumn, FloatColumn]:
        """Return (row, distance of its front bumper) of the first vehicle ahead along ways, -1: nobody.

        Args:
            lanes: Shape ``(n, k)``, -1 past the end.
            starts_m: Where each lane begins, shape ``(n, k)``.
            position_m: Own position on the first lane, shape ``(n,)``.
            own: Own row in the snapshot, shape ``(n,)``.
        """
        found, distance_m = np.full(len(lanes), -1, np.int64), np.full(len(lanes), np.inf)
        traffic = self.rows, self.position_m, self.first
        lane_search.first_ahead(*traffic, lanes, starts_m, position_m, own, found, distance_m)
        return found, distance_m

    def first_behind(
        self, network: SumoNetwork, lane: IntColumn, position_m: FloatColumn, own: IntColumn
    ) -> tuple[IntColumn, FloatColumn]:
        """Return (row, distance of its front bumper) of the nearest vehicle behind, -1: nobody.

        Args:
            network: Tells which lanes lead to a lane.
            lane: Shape ``(n,)``, -1: none.
            position_m: Where on it the vehicle behind is looked for from, likewise.
            own: Own row in the snapshot, likewise.
        """
        found, distance_m = np.full(len(lane), -1, np.int64), np.full(len(lane), np.inf)
        lane_search.first_behind(
            self.rows,
            self.position_m,
            self.first,
            self.road.lengths_m,
            *network.before_columns,
            lane,
            position_m,
            own,
            _BEHIND_M,
            found,
            distance_m,
        )
        return found, distance_m

    def ahead_on(self, lanes: Sequence[int], at_m: float, own: int) -> tuple[int, float]:
        """Return (row, distance of its front bumper) of the first vehicle from ``at_m`` on along lanes."""
        before_m = 0.0
        for step, lane in enumerate(lanes):
            index = self._after(lane, at_m if step == 0 else -1.0, own)
            if index >= 0:
                rows, position_m, _ = self._lists
                return rows[index], before_m + position_m[index] - at_m
            before_m += float(self.road.lengths_m[lane])
        return -1, np.inf

    def behind_in_lane(self, lane: int, at_m: float, own: int) -> tuple[int, float]:
        """Return (row, distance of its front bumper) of the nearest vehicle behind in a lane, -1: nobody."""
        index = self._before(lane, at_m, own)
        rows, position_m, _ = self._lists
        return (rows[index], at_m - position_m[index]) if index >= 0 else (-1, np.inf)

    def _after(self, lane: int, position_m: float, own: int) -> int:
        """Return the place of the first vehicle on a lane beyond a position, -1: nobody."""
        rows, positions_m, first = self._lists
        begin, end = first[lane], first[lane + 1]
        index = bisect_left(positions_m, position_m, begin, end)
        while index < end and rows[index] == own:
            index += 1
        return index if index < end else -1

    def _before(self, lane: int, position_m: float, own: int) -> int:
        """Return the place of the last vehicle on a lane before a position, -1: nobody."""
        rows, positions_m, first = self._lists
        begin, end = first[lane], first[lane + 1]
        index = bisect_left(positions_m, position_m, begin, end) - 1
        while index >= begin and rows[index] == own:
            index -= 1
        return index if index >= begin else -1
