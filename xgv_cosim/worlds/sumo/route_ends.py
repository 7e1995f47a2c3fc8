"""Where routes and the lanes that follow them end: whose does within the coming step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.sumo.arrivals import ArrivalPositions

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad

_ROUTE_END_MARGIN_M = 0.1
"""So close to its end a route counts as driven: SUMO pins a placed vehicle to the last centimetres."""


class RouteEnds:
    """Tells of the placed vehicles, columns over the placement, ``rows`` being theirs in ``before``."""

    def __init__(self, engine: Engine, road: SumoRoad, step_s: float) -> None:
        self._road = road
        self._step_s = step_s
        self._arrivals = ArrivalPositions(engine)

    def lead_on(self, placement: Placement, before: Snapshot, rows: IntColumn) -> BoolColumn:
        """Return whose lane goes on along the route, or does not end within this step."""
        lane = np.where(rows >= 0, before.lane[rows], -1)
        left_m = self._road.lane_length_m(lane) - before.lane_position_m[rows]
        reach_m = np.maximum(placement.travelled_m, placement.speed_mps * self._step_s)
        leads_on: BoolColumn = (before.next_lane[rows] >= 0) | (left_m > reach_m)
        return leads_on

    def reached(self, placement: Placement, before: Snapshot, rows: IntColumn) -> BoolColumn:
        """Return whose route ends within this step, at the arrival position if the demand names one."""
        lane = np.where(rows >= 0, before.lane[rows], -1)
        reach_m = np.maximum(placement.travelled_m, placement.speed_mps * self._step_s)
        arrival_m = self._road.lane_length_m(lane)
        for number in np.flatnonzero((lane >= 0) & (before.next_lane[rows] < 0)):
            edge_id = self._road.edge_ids[lane[number]]
            length_m = float(arrival_m[number])
            arrival_m[number] = self._arrivals.position_m(placement.ids[number], edge_id, length_m)
        left_m = arrival_m - before.lane_position_m[rows] - _ROUTE_END_MARGIN_M
        ends = (lane >= 0) & (reach_m > 0.0) & (left_m <= reach_m)
        for number in np.flatnonzero(ends):
            edge_id = self._road.edge_ids[lane[number]]
            ends[number] = self._arrivals.is_on_last_edge(placement.ids[number], edge_id)
        return ends
