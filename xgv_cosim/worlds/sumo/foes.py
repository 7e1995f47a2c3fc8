"""Who comes to the junctions that vehicles are about to enter, or is in them: once for each way through."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from xgv_cosim.surroundings import Foe

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.conflicts import Conflict, Conflicts, Connection, Feeder
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.network import SumoNetwork
    from xgv_cosim.worlds.sumo.traffic_lanes import LaneTraffic

_REREAD_S = 5.0
"""So often the route of somebody who stays on one road is read again."""
_EDGES_AHEAD = 8
"""So many edges of a route are kept."""
_STOPS_AT_YELLOW_MPS2 = 3.0
"""Who can stop at yellow with this stops."""


@dataclass(slots=True)
class Signals:
    """The states of the traffic lights in one step; each is asked once."""

    engine: Engine
    _states: dict[str, str] = field(default_factory=dict)

    def letter(self, signal: tuple[str, int]) -> str:
        """Return SUMO's letter for one link of a traffic light."""
        light, index = signal
        if light not in self._states:
            self._states[light] = self.engine.trafficlight.getRedYellowGreenState(light)
        return self._states[light][index]


@dataclass(slots=True)
class RoutesAhead:
    """The next edges of vehicles' routes; asked when one comes onto another road, and now and then."""

    engine: Engine
    _known: dict[str, tuple[int, float, tuple[str, ...]]] = field(default_factory=dict)
    """Lane of the road, when it was read, edges."""

    def edges(self, vehicle_id: str, road: int, now_s: float) -> tuple[str, ...]:
        """Return the edges after the one that a vehicle is on, or that it has left for a junction.

        Args:
            vehicle_id: Who.
            road: A number for the edge that it is on; -1 inside a junction.
            now_s: The time.
        """
        entry = self._known.get(vehicle_id)
        if entry is not None and (road in (-1, entry[0])) and now_s - entry[1] < _REREAD_S:
            return entry[2]
        vehicle = self.engine.vehicle
        route, index = vehicle.getRoute(vehicle_id), vehicle.getRouteIndex(vehicle_id)
        edges = tuple(route[index + 1 : index + 1 + _EDGES_AHEAD])
        self._known[vehicle_id] = road, now_s, edges
        return edges

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that has left the world."""
        self._known.pop(vehicle_id, None)


class Comer(NamedTuple):
    """Somebody on a way through a junction, or on the road to it."""

    row: int
    vehicle_id: str
    at_m: float
    """His front bumper, from the line at which the junction begins."""
    speed_mps: float
    length_m: float
    inside: bool


@dataclass(slots=True)
class FoesOf:
    """The foes of one step."""

    snapshot: Snapshot
    traffic: LaneTraffic
    network: SumoNetwork
    conflicts: Conflicts
    routes: RoutesAhead
    signals: Signals
    _comers: dict[tuple[int, int], tuple[Comer, ...]] = field(default_factory=dict)

    def at(self, conflicts: Sequence[Conflict], own_m: float, *, goes_first: bool) -> tuple[Foe, ...]:
        """Return who is where ways meet the own one, or comes there.

        Args:
            conflicts: Where they do.
            own_m: The own front bumper, from the line at which the junction begins.
            goes_first: The own signal or sign lets the vehicle go before all who are not inside yet.
        """
        return tuple(
            Foe(
                comer.vehicle_id,
                conflict.own_entry_m - own_m,
                conflict.own_exit_m - own_m,
                conflict.foe_entry_m - comer.at_m,
                conflict.foe_exit_m - comer.at_m,
                comer.speed_mps,
                comer.length_m,
                *_order(conflict, inside=comer.inside, goes_first=goes_first),
            )
            for conflict in conflicts
            if conflict.own_exit_m >= own_m
            for comer in self._on(conflict.foe)
            if comer.at_m - comer.length_m <= conflict.foe_exit_m
        )

    def _on(self, way: Connection) -> tuple[Comer, ...]:
        """Return who is on a way through a junction or comes to it, the first one first."""
        key = way.before, way.lanes[0]
        if key not in self._comers:
            inside = [
                self._comer(row, start_m + position_m, inside=True)
                for lane, start_m in zip(way.lanes[::-1], way.starts_m[::-1], strict=True)
                for row, position_m in self.traffic.on(lane)
            ]
            self._comers[key] = (*inside, *self._coming(way))
        return self._comers[key]

    def _coming(self, way: Connection) -> list[Comer]:
        """Return who comes to a way through a junction and does not have to stop at its signal."""
        letter = self.signals.letter(way.signal) if way.signal else "M"
        if letter in "ru":
            return []
        found = [
            comer
            for feeder in self.conflicts.feeders(way)
            for row, position_m in self.traffic.on(feeder.lane)
            if self._comes_by(row, feeder)
            and not _stops_at(letter, comer := self._comer(row, feeder.start_m + position_m, inside=False))
        ]
        return sorted(found, key=lambda comer: (-comer.at_m, comer.row))

    def _comes_by(self, row: int, feeder: Feeder) -> bool:
        """Return whether a vehicle's route leads from a feeder through its connection."""
        road = -1 if self.network.is_internal[feeder.lane] else self.network.lanes_of_edge_at(feeder.lane)[0]
        ahead = self.routes.edges(self.snapshot.ids[row], road, self.snapshot.time_s)
        return ahead[: len(feeder.edges)] == feeder.edges

    def _comer(self, row: int, at_m: float, *, inside: bool) -> Comer:
        snapshot = self.snapshot
        return Comer(
            row,
            snapshot.ids[row],
            at_m,
            float(snapshot.speed_mps[row]),
            float(snapshot.length_m[row]),
            inside,
        )


def _order(conflict: Conflict, *, inside: bool, goes_first: bool) -> tuple[bool, bool]:
    """Return whether a foe has the right of way, and whether he has to let the own vehicle pass."""
    first = conflict.first and (inside or conflict.gives_way or not goes_first)
    if inside and conflict.first_inside:
        return True, False
    return first, not first and (goes_first or conflict.yields or (inside and conflict.yields_inside))


def _stops_at(letter: str, comer: Comer) -> bool:
    """Return whether somebody stops at yellow."""
    return letter in "yY" and comer.speed_mps**2 < 2.0 * _STOPS_AT_YELLOW_MPS2 * max(0.0, -comer.at_m)
