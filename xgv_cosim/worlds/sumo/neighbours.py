"""Who is before and behind each bound vehicle: SUMO's answer, or from positions where that would crash."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.worlds.sumo.traffic_lanes import LaneTraffic

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from xgv_cosim.columns import FloatColumn, IntColumn
    from xgv_cosim.worlds.sumo.bodies import Bodies
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad

SIGHT_M = 250.0
"""How far a leader or follower is looked for."""


class Neighbours(NamedTuple):
    """The columns of ``Snapshot`` that are filled for bound vehicles only."""

    leader: IntColumn
    leader_gap_m: FloatColumn
    follower: IntColumn
    follower_gap_m: FloatColumn


def nobody(num_vehicles: int) -> Neighbours:
    """Return the columns of vehicles that have no neighbours."""
    return Neighbours(
        np.full(num_vehicles, -1, np.int64),
        np.full(num_vehicles, np.inf),
        np.full(num_vehicles, -1, np.int64),
        np.full(num_vehicles, np.inf),
    )


@dataclass(slots=True)
class NeighbourReader:
    """Reads neighbours of the open simulation."""

    engine: Engine
    road: SumoRoad
    bodies: Bodies
    _lanes_ahead: dict[str, tuple[int, tuple[int, ...]]] = field(default_factory=dict)
    """Of each bound vehicle its lane and those along its route, as long as neighbours are read from lanes."""

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle."""
        self._lanes_ahead.pop(vehicle_id, None)

    def read(
        self,
        index_of: Mapping[str, int],
        lane: IntColumn,
        position_m: FloatColumn,
        bound_ids: Sequence[str],
        owner_of: Mapping[str, str],
    ) -> Neighbours:
        """Return the neighbours of ``bound_ids``; -1 and ``inf`` for everybody else.

        With a vehicle off the road SUMO follows a pointer to no lane in search of leaders, and crashes; one
        that is parked is on no lane either, but nobody's business there.

        Args:
            index_of: Row of each vehicle.
            lane: Lane of each row, -1: on none.
            position_m: Front bumper along the lane, of each row.
            bound_ids: Whose neighbours are asked for; all of them are there.
            owner_of: Ghost -> the vehicle that it stands for.
        """
        vehicle, names = self.engine.vehicle, tuple(index_of)
        on_no_lane = [names[row] for row in np.flatnonzero(lane < 0).tolist()]
        if any(not vehicle.isStoppedParking(vehicle_id) for vehicle_id in on_no_lane):
            return self._by_lanes(index_of, lane, position_m, bound_ids, owner_of)
        self._lanes_ahead.clear()
        return self._by_sumo(index_of, lane, position_m, bound_ids, owner_of)

    def _by_sumo(
        self,
        index_of: Mapping[str, int],
        lane: IntColumn,
        position_m: FloatColumn,
        bound_ids: Sequence[str],
        owner_of: Mapping[str, str],
    ) -> Neighbours:
        """Return what SUMO says."""
        vehicle = self.engine.vehicle
        neighbours = nobody(len(index_of))
        leader, leader_gap_m, follower, follower_gap_m = neighbours
        hidden: list[int] = []
        """Rows of whom SUMO's answer is their own ghost."""
        for vehicle_id in bound_ids:
            row = index_of[vehicle_id]
            for found, index, gap_m in (
                (vehicle.getLeader(vehicle_id, SIGHT_M), leader, leader_gap_m),
                (vehicle.getFollower(vehicle_id, SIGHT_M), follower, follower_gap_m),
            ):
                if not found:
                    continue
                name = owner_of.get(found[0], found[0])
                if name == vehicle_id:  # before whom or behind whom somebody else may drive
                    hidden.append(row)
                    continue
                if name not in index_of:
                    continue
                # SUMO subtracts the minimum gap that the one behind keeps; a ghost keeps its owner's.
                behind = vehicle_id if index is leader else name
                bumper_gap_m = found[1] + self.bodies.of(behind).min_gap_m
                if bumper_gap_m <= SIGHT_M:
                    index[row], gap_m[row] = index_of[name], bumper_gap_m
        if hidden:
            names = tuple(index_of)
            unhidden = [names[row] for row in hidden]
            by_lanes = self._by_lanes(index_of, lane, position_m, unhidden, owner_of)
            for column, other in zip(neighbours, by_lanes, strict=True):
                column[hidden] = other[hidden]
        return neighbours

    def _by_lanes(
        self,
        index_of: Mapping[str, int],
        lane: IntColumn,
        position_m: FloatColumn,
        bound_ids: Sequence[str],
        owner_of: Mapping[str, str],
    ) -> Neighbours:
        """Return the same from positions alone: leaders along the routes, followers in the own lane."""
        vehicle, number = self.engine.vehicle, self.road.index_of
        ghosts = [(ghost, index_of[owner]) for ghost, owner in owner_of.items() if owner in index_of]
        rows_of = np.array([*range(len(index_of)), *(row for _, row in ghosts)], np.int64)
        """Of each body, ghosts last, the row of the vehicle that it belongs to."""
        traffic = LaneTraffic.of(
            self.road,
            np.concatenate([lane, np.array([number[vehicle.getLaneID(g)] for g, _ in ghosts], np.int64)]),
            np.concatenate([position_m, np.array([vehicle.getLanePosition(g) for g, _ in ghosts])]),
        )
        traffic = replace(traffic, rows=rows_of[traffic.rows])  # nobody meets his own ghost
        neighbours, names = nobody(len(index_of)), tuple(index_of)
        leader, leader_gap_m, follower, follower_gap_m = neighbours
        for vehicle_id in bound_ids:
            row = index_of[vehicle_id]
            own = int(lane[row])
            if own < 0:
                continue
            ahead = self._way(vehicle_id, own)
            at_m = float(position_m[row])
            found, distance_m = traffic.ahead_on(ahead, at_m, row)
            if found >= 0:
                gap_m = distance_m - self.bodies.of(names[found]).length_m
                if gap_m <= SIGHT_M:
                    leader[row], leader_gap_m[row] = found, gap_m
            found, distance_m = traffic.behind_in_lane(own, at_m, row)
            if found >= 0:
                gap_m = distance_m - self.bodies.of(vehicle_id).length_m
                if gap_m <= SIGHT_M:
                    follower[row], follower_gap_m[row] = found, gap_m
        return neighbours

    def _way(self, vehicle_id: str, lane: int) -> tuple[int, ...]:
        """Return a vehicle's lane and those along its route, as far as it sees."""
        known = self._lanes_ahead.get(vehicle_id)
        if known is None or known[0] != lane:
            vehicle = self.engine.vehicle
            edges = iter(vehicle.getRoute(vehicle_id)[vehicle.getRouteIndex(vehicle_id) + 1 :])
            way, onward, following = [lane], lane, next(edges, "")
            while self.road.lengths_m[way[1:]].sum() < SIGHT_M:
                onward = self.road.next_lane(onward, following)
                if onward < 0:
                    break
                way.append(onward)
                if self.road.edge_ids[onward] == following:
                    following = next(edges, "")
            known = self._lanes_ahead[vehicle_id] = (lane, tuple(way))
        return known[1]
