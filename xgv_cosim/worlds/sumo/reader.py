"""Snapshots of a SUMO simulation. Direct getters: within libsumo they cost less than subscriptions."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.snapshot import Collision, Snapshot
from xgv_cosim.worlds.sumo.frames import headings_from_sumo
from xgv_cosim.worlds.sumo.ghosts import is_ghost
from xgv_cosim.worlds.sumo.traffic_lanes import LaneTraffic

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from xgv_cosim.columns import FloatColumn, IntColumn
    from xgv_cosim.worlds.sumo.engine import OpenSimulation
    from xgv_cosim.worlds.sumo.road import SumoRoad

SIGHT_M = 250.0
"""How far a leader or follower is looked for."""


class Body(NamedTuple):
    """What does not change about a vehicle."""

    type_id: str
    length_m: float
    width_m: float
    min_gap_m: float


class Neighbours(NamedTuple):
    """The columns of ``Snapshot`` that are filled for bound vehicles only."""

    next_lane: IntColumn
    leader: IntColumn
    leader_gap_m: FloatColumn
    follower: IntColumn
    follower_gap_m: FloatColumn


@dataclass(slots=True)
class SnapshotReader:
    """Reads the open simulation into columns; keeps what does not change from step to step."""

    session: OpenSimulation
    road: SumoRoad
    _bodies: dict[str, Body] = field(default_factory=dict)
    _next_lanes: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Of each bound vehicle its lane and the one that follows."""
    _lanes_ahead: dict[str, tuple[int, tuple[int, ...]]] = field(default_factory=dict)
    """Of each bound vehicle its lane and those along its route, as long as neighbours are read from lanes."""
    _present: frozenset[str] = frozenset()
    """Who was there in the snapshot before."""

    def read(
        self,
        bound_ids: Collection[str],
        notes: Sequence[tuple[str, str]] = (),
        owner_of: Mapping[str, str] = MappingProxyType({}),
    ) -> Snapshot:
        """Return the present state without ghosts; neighbours and next lanes for ``bound_ids`` only.

        Args:
            bound_ids: Vehicles that are bound.
            notes: What the snapshot has to tell.
            owner_of: Ghost -> the vehicle that it stands for.
        """
        engine = self.session.engine
        vehicle, simulation = engine.vehicle, engine.simulation
        arrived: tuple[str, ...] = _vehicles(simulation.getArrivedIDList())
        for vehicle_id in arrived:
            self._bodies.pop(vehicle_id, None)
            self._next_lanes.pop(vehicle_id, None)
            self._lanes_ahead.pop(vehicle_id, None)
        ids: tuple[str, ...] = _vehicles(vehicle.getIDList())
        # SUMO's own list of departures lacks who came with a loaded state or returns from a teleport
        departed = tuple(vehicle_id for vehicle_id in ids if vehicle_id not in self._present)
        self._present = frozenset(ids)
        index_of = {vehicle_id: index for index, vehicle_id in enumerate(ids)}
        bodies = [self.body(vehicle_id) for vehicle_id in ids]
        positions = [vehicle.getPosition(vehicle_id) for vehicle_id in ids]
        number = self.road.index_of
        lane = np.array([number[vehicle.getLaneID(vehicle_id)] for vehicle_id in ids], np.int64)
        lane_position_m = np.array([vehicle.getLanePosition(vehicle_id) for vehicle_id in ids], np.float64)
        here = [name for name in bound_ids if name in index_of]
        # With a vehicle off the road SUMO follows a pointer to no lane in search of leaders, and crashes;
        # one that is parked is on no lane either, but nobody's business there.
        on_no_lane = [ids[row] for row in np.flatnonzero(lane < 0).tolist()]
        if any(not vehicle.isStoppedParking(vehicle_id) for vehicle_id in on_no_lane):
            neighbours = self._neighbours_on_lanes(index_of, lane, lane_position_m, here, owner_of)
        else:
            self._lanes_ahead.clear()
            neighbours = self._neighbours(index_of, lane, lane_position_m, here, owner_of)
        return Snapshot(
            time_s=round(simulation.getTime() - self.session.begin_s, 3),  # SUMO counts milliseconds
            ids=ids,
            type_ids=tuple(body.type_id for body in bodies),
            front_x_m=np.array([position[0] for position in positions], np.float64),
            front_y_m=np.array([position[1] for position in positions], np.float64),
            heading_rad=headings_from_sumo(np.array([vehicle.getAngle(name) for name in ids], np.float64)),
            speed_mps=np.array([vehicle.getSpeed(name) for name in ids], np.float64),
            accel_mps2=np.array([vehicle.getAcceleration(name) for name in ids], np.float64),
            length_m=np.array([body.length_m for body in bodies], np.float64),
            width_m=np.array([body.width_m for body in bodies], np.float64),
            lane=lane,
            lane_position_m=np.where(lane >= 0, lane_position_m, 0.0),
            next_lane=neighbours.next_lane,
            leader=neighbours.leader,
            leader_gap_m=neighbours.leader_gap_m,
            follower=neighbours.follower,
            follower_gap_m=neighbours.follower_gap_m,
            placement_error_m=np.zeros(len(ids)),
            placement_error_rad=np.zeros(len(ids)),
            in_lane_frame=np.zeros(len(ids), np.bool_),
            departed=departed,
            arrived=arrived,
            teleported=_vehicles(simulation.getStartingTeleportIDList()),
            collisions=tuple(
                Collision(contact.collider, contact.victim, contact.type, contact.lane, contact.pos)
                for contact in simulation.getCollisions()
                if not (is_ghost(contact.collider) or is_ghost(contact.victim))
            ),
            notes=tuple(notes),
        )

    def body(self, vehicle_id: str) -> Body:
        """Return what does not change about a vehicle."""
        body = self._bodies.get(vehicle_id)
        if body is None:
            vehicle = self.session.engine.vehicle
            body = self._bodies[vehicle_id] = Body(
                vehicle.getTypeID(vehicle_id),
                vehicle.getLength(vehicle_id),
                vehicle.getWidth(vehicle_id),
                vehicle.getMinGap(vehicle_id),
            )
        return body

    def _neighbours(
        self,
        index_of: dict[str, int],
        lane: IntColumn,
        position_m: FloatColumn,
        bound_ids: Sequence[str],
        owner_of: Mapping[str, str],
    ) -> Neighbours:
        """Return the columns that are filled for bound vehicles only."""
        vehicle = self.session.engine.vehicle
        next_lane, leader, follower = (np.full(len(index_of), -1, np.int64) for _ in range(3))
        leader_gap_m, follower_gap_m = (np.full(len(index_of), np.inf) for _ in range(2))
        hidden: list[int] = []
        """Rows of whom SUMO's answer is their own ghost."""
        for vehicle_id in bound_ids:
            row = index_of[vehicle_id]
            next_lane[row] = self._next_lane(vehicle_id, int(lane[row]))
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
                bumper_gap_m = found[1] + self.body(behind).min_gap_m
                if bumper_gap_m <= SIGHT_M:
                    index[row], gap_m[row] = index_of[name], bumper_gap_m
        neighbours = Neighbours(next_lane, leader, leader_gap_m, follower, follower_gap_m)
        if hidden:
            names = tuple(index_of)
            by_lanes = self._neighbours_on_lanes(
                index_of, lane, position_m, [names[row] for row in hidden], owner_of
            )
            for column, other in zip(neighbours, by_lanes, strict=True):
                column[hidden] = other[hidden]
        return neighbours

    def _neighbours_on_lanes(
        self,
        index_of: dict[str, int],
        lane: IntColumn,
        position_m: FloatColumn,
        bound_ids: Sequence[str],
        owner_of: Mapping[str, str],
    ) -> Neighbours:
        """Return the same from positions alone: leaders along the routes, followers in the own lane."""
        vehicle, number = self.session.engine.vehicle, self.road.index_of
        ghosts = [(ghost, index_of[owner]) for ghost, owner in owner_of.items() if owner in index_of]
        rows_of = [*range(len(index_of)), *(row for _, row in ghosts)]
        """Of each body, ghosts last, the row of the vehicle that it belongs to."""
        traffic = LaneTraffic.of(
            self.road,
            np.concatenate([lane, np.array([number[vehicle.getLaneID(g)] for g, _ in ghosts], np.int64)]),
            np.concatenate([position_m, np.array([vehicle.getLanePosition(g) for g, _ in ghosts])]),
        )
        traffic = replace(
            traffic, rows=[rows_of[body] for body in traffic.rows]
        )  # nobody meets his own ghost
        next_lane, leader, follower = (np.full(len(index_of), -1, np.int64) for _ in range(3))
        leader_gap_m, follower_gap_m = (np.full(len(index_of), np.inf) for _ in range(2))
        names = tuple(index_of)
        for vehicle_id in bound_ids:
            row = index_of[vehicle_id]
            own = int(lane[row])
            if own < 0:
                continue
            next_lane[row] = self._next_lane(vehicle_id, own)
            ahead = self._way(vehicle_id, own)
            at_m = float(position_m[row])
            found, distance_m = traffic.ahead_on(ahead, at_m, row)
            if found >= 0:
                gap_m = distance_m - self.body(names[found]).length_m
                if gap_m <= SIGHT_M:
                    leader[row], leader_gap_m[row] = found, gap_m
            found, distance_m = traffic.behind_in_lane(own, at_m, row)
            if found >= 0:
                gap_m = distance_m - self.body(vehicle_id).length_m
                if gap_m <= SIGHT_M:
                    follower[row], follower_gap_m[row] = found, gap_m
        return Neighbours(next_lane, leader, leader_gap_m, follower, follower_gap_m)

    def _way(self, vehicle_id: str, lane: int) -> tuple[int, ...]:
        """Return a vehicle's lane and those along its route, as far as it sees."""
        known = self._lanes_ahead.get(vehicle_id)
        if known is None or known[0] != lane:
            vehicle = self.session.engine.vehicle
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

    def _next_lane(self, vehicle_id: str, lane: int) -> int:
        if lane < 0:
            return -1
        known = self._next_lanes.get(vehicle_id)
        if known is None or known[0] != lane:
            vehicle = self.session.engine.vehicle
            route, index = vehicle.getRoute(vehicle_id), vehicle.getRouteIndex(vehicle_id)
            following = route[index + 1] if index + 1 < len(route) else ""
            known = self._next_lanes[vehicle_id] = (lane, self.road.next_lane(lane, following))
        return known[1]


def _vehicles(ids: Iterable[str]) -> tuple[str, ...]:
    """Return the ids without those of ghosts."""
    return tuple(vehicle_id for vehicle_id in ids if not is_ghost(vehicle_id))
