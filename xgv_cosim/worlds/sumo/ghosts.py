"""Ghosts: vehicles that stand in for a bound one in the lanes that its body reaches into.

SUMO's drivers see a vehicle on one lane only, where its front bumper is: they drive through a body that
stands across the line (measured). So a ghost of the same length drives at the same place with the same
speed in each further lane, as long as the body is there. It is no vehicle to anybody but SUMO: its id
begins with ``GHOST_PREFIX``, and everything that reads SUMO leaves it out.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.sumo.couplings import (
    KEEP_ROUTE_AND_POSE,
    MATCH_THRESHOLD_M,
    NO_LANE_CHANGES,
    NO_SPEED_CHECKS,
)
from xgv_cosim.worlds.sumo.frames import angle_to_sumo
from xgv_cosim.worlds.sumo.standstill import Standstill

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad
    from xgv_cosim.worlds.sumo.straddling import Reach

GHOST_PREFIX = "_xgv_ghost:"
"""How the ids of ghosts, of their types and of their routes begin."""
DEVICES_LEFT_OUT = (
    "battery",
    "bluelight",
    "btreceiver",
    "btsender",
    "driverstate",
    "elechybrid",
    "emissions",
    "fcd",
    "friction",
    "glosa",
    "rerouting",
    "ssm",
    "stationfinder",
    "taxi",
    "toc",
    "tripinfo",
    "vehroute",
)
"""SUMO's devices of which a ghost has none: they write vehicles into files, or draw chance for them."""

_OF_ONE_VEHICLE = "@"
"""In the name of a type that SUMO has made for one vehicle, when somebody set something of it."""
_MAY_CHANGE = (
    *("Length", "Width", "Height", "MinGap", "Tau", "MaxSpeed"),
    *("Accel", "Decel", "EmergencyDecel", "ApparentDecel"),
)
"""What followers expect of a vehicle, in the names of SUMO's commands."""


def is_ghost(vehicle_id: str) -> bool:
    """Return whether an id of SUMO is a ghost's."""
    return vehicle_id.startswith(GHOST_PREFIX)


def owner_in(ghost: str) -> str:
    """Return the bound vehicle that the id of a ghost names."""
    return ghost.removeprefix(GHOST_PREFIX).partition(":")[2]


@dataclass(slots=True)
class Ghosts:
    """The ghosts of an open simulation."""

    engine: Engine
    road: SumoRoad
    standstill: Standstill
    owner_of: dict[str, str] = field(default_factory=dict)
    """Ghost -> the bound vehicle that it stands for."""
    _standing: dict[tuple[str, int], str] = field(default_factory=dict)
    """(owner, lane) -> ghost."""
    _types: dict[str, str] = field(default_factory=dict)
    """Type of an owner -> type of its ghosts."""
    _routes: set[str] = field(default_factory=set)
    _allowed: dict[int, tuple[str, ...]] = field(default_factory=dict)
    """Vehicle classes that may use a lane; empty: all."""
    _made: int = 0
    _new: dict[str, float] = field(default_factory=dict)
    """Speed of each ghost that comes in the coming step."""

    @property
    def standing(self) -> frozenset[tuple[str, int]]:
        """Return (owner, lane) of every ghost."""
        return frozenset(self._standing)

    def show(self, reaches: Sequence[Reach]) -> None:
        """Have exactly these ghosts at the end of the coming step."""
        wanted = {(reach.owner, reach.lane): reach for reach in reaches}
        for key in [key for key in self._standing if key not in wanted]:
            self._remove(key)
        for key, reach in wanted.items():
            if not self._may_use(reach):
                continue
            ghost = self._standing.get(key)
            if ghost is None:
                ghost = self._add(reach)
                self._new[ghost] = max(reach.speed_mps, 0.0)
            lane = np.array([reach.lane])
            at = self.road.points_ahead(lane, np.array([reach.front_m]), np.array([-1]))
            pose = float(at.x_m[0]), float(at.y_m[0]), float(at.heading_rad[0])
            if self.standstill.is_due(ghost, at_rest=reach.speed_mps <= 0.0):
                self.standstill.stir(ghost, *pose)
                continue
            self.engine.vehicle.setSpeed(ghost, max(reach.speed_mps, 0.0))
            self.engine.vehicle.moveToXY(
                ghost,
                self.road.edge_ids[reach.lane],
                -1,
                *pose[:2],
                angle_to_sumo(pose[2]),
                KEEP_ROUTE_AND_POSE,
                MATCH_THRESHOLD_M,
            )

    def settle(self) -> None:
        """Set right what SUMO's step has left: ghosts that are new, and those that it has taken off the road.

        SUMO has a vehicle stand in the step in which it comes; followers would brake for it in the next.
        Ghosts that are gone and still wanted are made anew.
        """
        if not self._standing:
            return
        present, loaded = self.engine.vehicle.getIDList(), self.engine.vehicle.getLoadedIDList()
        for ghost, speed_mps in self._new.items():
            if ghost in present:
                self.engine.vehicle.setPreviousSpeed(ghost, speed_mps)
        self._new.clear()
        for key, ghost in list(self._standing.items()):
            if ghost in present:
                continue
            if ghost in loaded:  # SUMO would put it back elsewhere
                self._remove(key)
            else:
                del self.owner_of[self._standing.pop(key)]

    def _may_use(self, reach: Reach) -> bool:
        """Return whether the lane is for vehicles like the owner: SUMO puts no ghost onto a pavement."""
        if reach.lane not in self._allowed:
            self._allowed[reach.lane] = tuple(self.engine.lane.getAllowed(self.road.lane_ids[reach.lane]))
        allowed = self._allowed[reach.lane]
        return not allowed or self.engine.vehicle.getVehicleClass(reach.owner) in allowed

    def _add(self, reach: Reach) -> str:
        vehicle, edge = self.engine.vehicle, self.road.edge_ids[reach.lane]
        route = GHOST_PREFIX + edge
        if route not in self._routes:
            self._routes.add(route)
            if route not in self.engine.route.getIDList():  # SUMO keeps what an earlier plugin has added
                self.engine.route.add(route, self._onward(reach.lane))
        loaded = frozenset(vehicle.getLoadedIDList())
        while (ghost := f"{GHOST_PREFIX}{self._made + 1}:{reach.owner}") in loaded:
            self._made += 1
        self._made += 1
        vehicle.add(ghost, route, typeID=self._type(vehicle.getTypeID(reach.owner)))
        vehicle.setSpeedMode(ghost, NO_SPEED_CHECKS)
        vehicle.setLaneChangeMode(ghost, NO_LANE_CHANGES)
        self._standing[reach.owner, reach.lane] = ghost
        self.owner_of[ghost] = reach.owner
        return ghost

    def _onward(self, lane: int) -> list[str]:
        """Return the edge of a lane, and from within a junction also the one that it leads to.

        SUMO crashes in its next step if a route ends on a junction's own edge of several lanes (measured).
        """
        edges = [self.road.edge_ids[lane]]
        if self.road.inside_junction[lane]:
            edges += [edge for edge, _ in self.road.successors[lane][:1]]
        return edges

    def _type(self, of_owner: str) -> str:
        """Return a type like the owner's, so that followers expect the same of it, without chance in it."""
        types = self.engine.vehicletype
        own = self._types.get(of_owner)
        if own is None:
            own = self._types[of_owner] = GHOST_PREFIX + of_owner
            if own not in types.getIDList():
                types.copy(of_owner, own)
            types.setSpeedDeviation(own, 0.0)
            for device in DEVICES_LEFT_OUT:
                types.setParameter(own, f"has.{device}.device", "false")
            types.setColor(own, (0, 0, 0, 0))
        elif _OF_ONE_VEHICLE in of_owner:  # a script may have set something since
            for name in _MAY_CHANGE:
                getattr(types, f"set{name}")(own, getattr(types, f"get{name}")(of_owner))
        return own

    def _remove(self, key: tuple[str, int]) -> None:
        ghost = self._standing.pop(key)
        del self.owner_of[ghost]
        self.standstill.forget(ghost)
        self.engine.vehicle.remove(ghost)
