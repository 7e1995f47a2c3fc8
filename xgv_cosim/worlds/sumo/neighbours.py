"""Who is before and behind each bound vehicle: SUMO's answer, or from positions where that would crash."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import repeat
from typing import TYPE_CHECKING, NamedTuple, Self

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


class Scene(NamedTuple):
    """A snapshot, as far as neighbours need it."""

    index_of: Mapping[str, int]
    """Row of each vehicle."""
    lane: IntColumn
    """Lane of each row, -1: on none."""
    position_m: FloatColumn
    """Front bumper along the lane, of each row."""
    bound_ids: Sequence[str]
    """Whose neighbours are asked for; all of them are there."""
    owner_of: Mapping[str, str]
    """Ghost -> the vehicle that it stands for."""


class Nearest(NamedTuple):
    """Columns of ``Snapshot`` that are filled for bound vehicles only."""

    row: IntColumn
    """-1: nobody."""
    gap_m: FloatColumn
    """Bumper to bumper, ``inf`` without anybody."""

    @classmethod
    def nobody(cls, num_vehicles: int) -> Self:
        """Return the columns of vehicles that have no neighbours."""
        return cls(np.full(num_vehicles, -1, np.int64), np.full(num_vehicles, np.inf))


@dataclass(slots=True)
class NeighbourReader:
    """Reads neighbours of the open simulation.

    With a vehicle off the road SUMO follows a pointer to no lane in search of leaders, and crashes; one that
    is parked is on no lane either, but nobody's business there.
    """

    engine: Engine
    road: SumoRoad
    bodies: Bodies
    _lanes_ahead: dict[str, tuple[int, tuple[int, ...]]] = field(default_factory=dict)
    """Of each bound vehicle its lane and those along its route, as long as neighbours are read from lanes."""

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle."""
        self._lanes_ahead.pop(vehicle_id, None)

    def leaders(self, scene: Scene) -> Nearest:
        """Return who is before the bound vehicles."""
        if self._is_anybody_off_the_road(scene):
            return self._leaders_by_lanes(scene)
        self._lanes_ahead.clear()
        return self._by_sumo(scene, is_ahead=True)

    def followers(self, scene: Scene) -> Nearest:
        """Return who is behind the bound vehicles."""
        if self._is_anybody_off_the_road(scene):
            return self._followers_by_lanes(scene)
        return self._by_sumo(scene, is_ahead=False)

    def _is_anybody_off_the_road(self, scene: Scene) -> bool:
        if (scene.lane >= 0).all():
            return False
        names, vehicle = tuple(scene.index_of), self.engine.vehicle
        on_no_lane = [names[row] for row in np.flatnonzero(scene.lane < 0).tolist()]
        return any(not vehicle.isStoppedParking(vehicle_id) for vehicle_id in on_no_lane)

    def _by_sumo(self, scene: Scene, *, is_ahead: bool) -> Nearest:
        """Return what SUMO says, and from lanes where it names somebody's own ghost."""
        index_of, owner_of, vehicle = scene.index_of, scene.owner_of, self.engine.vehicle
        ask = vehicle.getLeader if is_ahead else vehicle.getFollower
        nearest = Nearest.nobody(len(index_of))
        hidden: list[str] = []
        """Whose answer is their own ghost: before or behind it somebody else may drive."""
        answers = map(ask, scene.bound_ids, repeat(SIGHT_M))
        for vehicle_id, found in zip(scene.bound_ids, answers, strict=True):
            if not found:
                continue
            name = owner_of.get(found[0], found[0])
            if name == vehicle_id:
                hidden.append(vehicle_id)
            elif name in index_of:
                # SUMO subtracts the minimum gap that the one behind keeps; a ghost keeps its owner's.
                bumper_gap_m = found[1] + self.bodies.of(vehicle_id if is_ahead else name).min_gap_m
                if bumper_gap_m <= SIGHT_M:
                    row = index_of[vehicle_id]
                    nearest.row[row], nearest.gap_m[row] = index_of[name], bumper_gap_m
        if hidden:
            rows = [index_of[vehicle_id] for vehicle_id in hidden]
            by_lanes = self._leaders_by_lanes if is_ahead else self._followers_by_lanes
            for column, other in zip(nearest, by_lanes(scene._replace(bound_ids=hidden)), strict=True):
                column[rows] = other[rows]
        return nearest

    def _traffic(self, scene: Scene) -> LaneTraffic:
        """Return all vehicles and their ghosts along the lanes; nobody meets his own ghost."""
        vehicle, number, index_of = self.engine.vehicle, self.road.index_of, scene.index_of
        ghosts = [(ghost, index_of[owner]) for ghost, owner in scene.owner_of.items() if owner in index_of]
        rows_of = np.array([*range(len(index_of)), *(row for _, row in ghosts)], np.int64)
        lanes = np.array([number[vehicle.getLaneID(ghost)] for ghost, _ in ghosts], np.int64)
        positions_m = np.array([vehicle.getLanePosition(ghost) for ghost, _ in ghosts])
        return LaneTraffic.of(
            self.road,
            np.concatenate([scene.lane, lanes]),
            np.concatenate([scene.position_m, positions_m]),
            rows=rows_of,
        )

    def _leaders_by_lanes(self, scene: Scene) -> Nearest:
        """Return leaders along the routes, from positions alone."""
        nearest, names = Nearest.nobody(len(scene.index_of)), tuple(scene.index_of)
        traffic = self._traffic(scene)
        for vehicle_id, row in self._on_road(scene):
            ahead = self._way(vehicle_id, int(scene.lane[row]))
            found, distance_m = traffic.ahead_on(ahead, float(scene.position_m[row]), row)
            if found >= 0 and distance_m - (length_m := self.bodies.of(names[found]).length_m) <= SIGHT_M:
                nearest.row[row], nearest.gap_m[row] = found, distance_m - length_m
        return nearest

    def _followers_by_lanes(self, scene: Scene) -> Nearest:
        """Return followers in the own lane, likewise."""
        nearest, traffic = Nearest.nobody(len(scene.index_of)), self._traffic(scene)
        for vehicle_id, row in self._on_road(scene):
            lane, position_m = int(scene.lane[row]), float(scene.position_m[row])
            found, distance_m = traffic.behind_in_lane(lane, position_m, row)
            if found >= 0 and distance_m - (length_m := self.bodies.of(vehicle_id).length_m) <= SIGHT_M:
                nearest.row[row], nearest.gap_m[row] = found, distance_m - length_m
        return nearest

    def _on_road(self, scene: Scene) -> list[tuple[str, int]]:
        rows = [(vehicle_id, scene.index_of[vehicle_id]) for vehicle_id in scene.bound_ids]
        return [(vehicle_id, row) for vehicle_id, row in rows if scene.lane[row] >= 0]

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
