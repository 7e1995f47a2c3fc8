"""Where routes and the lanes that follow them end: whose does within the coming step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.sumo.arrivals import ArrivalPositions

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad

_ROUTE_END_MARGIN_M = 0.1
"""So close to its end a route counts as driven: SUMO pins a placed vehicle to the last centimetres."""


class RouteEnds:
    """Tells of the placed vehicles, columns over the placement."""

    def __init__(self, engine: Engine, road: SumoRoad, step_s: float) -> None:
        self._road = road
        self._step_s = step_s
        self._arrivals = ArrivalPositions(engine)

    def forget(self, vehicle_id: str) -> None:
        """Know nothing of a vehicle's arrival any more: another one may have its id."""
        self._arrivals.forget(vehicle_id)

    def reached(
        self, placement: Placement, lane: IntColumn, next_lane: IntColumn, position_m: FloatColumn
    ) -> BoolColumn:
        """Return whose route ends within this step, at the arrival position if the demand names one.

        Args:
            placement: Where the plant puts the vehicles.
            lane: Where they are before the step, -1: on none; so the next two.
            next_lane: The lane that follows on the route, -1: none.
            position_m: Front bumper from the beginning of the lane.
        """
        ends = np.zeros(len(lane), np.bool_)
        for number in np.flatnonzero((lane >= 0) & (next_lane < 0)).tolist():
            name, edge_id = placement.ids[number], self._road.edge_ids[lane[number]]
            arrival_m = self._arrivals.position_m(name, edge_id, float(self._road.lengths_m[lane[number]]))
            left_m = arrival_m - position_m[number] - _ROUTE_END_MARGIN_M
            reach_m = max(placement.travelled_m[number], placement.speed_mps[number] * self._step_s)
            ends[number] = 0.0 < reach_m >= left_m and self._arrivals.is_on_last_edge(name, edge_id)
        return ends
