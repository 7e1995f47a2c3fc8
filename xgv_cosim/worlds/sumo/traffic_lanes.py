"""Who drives where on the lanes: all vehicles of a snapshot in order along each lane."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.worlds.sumo.network import SumoNetwork
    from xgv_cosim.worlds.sumo.road import SumoRoad

_BEHIND_M = 120.0
"""So far back followers are looked for."""


@dataclass(frozen=True, slots=True)
class LaneTraffic:
    """Vehicles sorted by lane and position."""

    road: SumoRoad
    rows: list[int]
    """Rows of the snapshot, by lane and then by position."""
    position_m: list[float]
    """Front bumpers, in that order."""
    first: list[int]
    """Where each lane's vehicles begin in that order; one entry more at the end."""

    @classmethod
    def of(cls, road: SumoRoad, lane: IntColumn, position_m: FloatColumn) -> LaneTraffic:
        """Return the traffic of a snapshot's columns."""
        on_road = np.flatnonzero(lane >= 0)
        lane, position_m = lane[on_road], position_m[on_road]
        order = np.lexsort((position_m, lane))
        first = np.searchsorted(lane[order], np.arange(len(road.lane_ids) + 1))
        return cls(road, on_road[order].tolist(), position_m[order].tolist(), first.tolist())

    def on(self, lane: int) -> list[tuple[int, float]]:
        """Return (row, front bumper) of the vehicles on a lane, the first one first."""
        begin, end = self.first[lane], self.first[lane + 1]
        if begin == end:
            return []
        return list(zip(self.rows[begin:end][::-1], self.position_m[begin:end][::-1], strict=True))

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
        count = len(lanes)
        found, distance_m = np.full(count, -1, np.int64), np.full(count, np.inf)
        if not len(self.rows):
            return found, distance_m
        starts = starts_m.tolist()
        for number, (way, here_m, row) in enumerate(
            zip(lanes.tolist(), position_m.tolist(), own.tolist(), strict=True)
        ):
            for step, lane in enumerate(way):
                if lane < 0:
                    break
                index = self._after(lane, here_m - starts[number][step], row)
                if index >= 0:
                    found[number] = self.rows[index]
                    distance_m[number] = starts[number][step] + self.position_m[index] - here_m
                    break
        return found, distance_m

    def ahead_on(self, lanes: Sequence[int], at_m: float, own: int) -> tuple[int, float]:
        """Return (row, distance of its front bumper) of the first vehicle from ``at_m`` on along lanes."""
        before_m = 0.0
        for step, lane in enumerate(lanes):
            index = self._after(lane, at_m if step == 0 else -1.0, own)
            if index >= 0:
                return self.rows[index], before_m + self.position_m[index] - at_m
            before_m += float(self.road.lengths_m[lane])
        return -1, np.inf

    def behind_in_lane(self, lane: int, at_m: float, own: int) -> tuple[int, float]:
        """Return (row, distance of its front bumper) of the nearest vehicle behind in a lane, -1: nobody."""
        index = self._before(lane, at_m, own)
        return (self.rows[index], at_m - self.position_m[index]) if index >= 0 else (-1, np.inf)

    def behind_on(self, network: SumoNetwork, lane: int, at_m: float, own: int) -> tuple[int, float]:
        """Return (row, distance of its front bumper) of the nearest vehicle behind ``at_m``, -1: nobody."""
        index = self._before(lane, at_m, own)
        if index >= 0:
            return self.rows[index], at_m - self.position_m[index]
        found, least_m = -1, np.inf
        waiting = [(source, at_m) for source in network.before[lane]]
        while waiting:
            source, ahead_m = waiting.pop()
            index = self._before(source, np.inf, own)
            gap_m = ahead_m + float(self.road.lengths_m[source])
            if index >= 0:
                distance_m = gap_m - self.position_m[index]
                if distance_m < least_m:
                    found, least_m = self.rows[index], distance_m
            elif gap_m < _BEHIND_M:
                waiting += [(further, gap_m) for further in network.before[source]]
        return found, least_m

    def _after(self, lane: int, position_m: float, own: int) -> int:
        """Return the place of the first vehicle on a lane beyond a position, -1: nobody."""
        begin, end = self.first[lane], self.first[lane + 1]
        index = bisect_left(self.position_m, position_m, begin, end)
        while index < end and self.rows[index] == own:
            index += 1
        return index if index < end else -1

    def _before(self, lane: int, position_m: float, own: int) -> int:
        """Return the place of the last vehicle on a lane before a position, -1: nobody."""
        begin, end = self.first[lane], self.first[lane + 1]
        index = bisect_left(self.position_m, position_m, begin, end) - 1
        while index >= begin and self.rows[index] == own:
            index -= 1
        return index if index >= begin else -1
