"""Where ways through a junction meet, and who goes first there. Worked out once for each connection.

SUMO tells who has the right of way (``getFoes``) and which lanes meet at all (``getInternalFoes``); where
they meet is measured on the lanes as drawn. Its own list of foes (``getJunctionFoes``) is no source: on
streets of more than one lane it leaves foes out, and it has them only as far as they look ahead themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.worlds.sumo.routes import through

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn, FloatMatrix
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.network import SumoNetwork
    from xgv_cosim.worlds.sumo.road import SumoRoad

_APART_M = 2.4
"""Ways whose centre lines are nearer than this meet: two cars and a hand's breadth."""
_EVERY_M = 0.5
"""Points on a way lie no further apart."""
_AHEAD_S, _AHEAD_M = 8.0, 20.0
"""Who comes to a junction is looked for as far as he drives in this time at the limit, and somewhat more."""
_WITHIN_M = 3.0
"""A place to wait may lie this far inside of where the ways meet: lanes are wider than cars."""
_WORTH_M = 2.0
"""Nobody enters a junction to wait less than this beyond its line."""
_TIGHT_M, _TIGHT_RAD = 4.0, 1.0
"""A way drawn with a smaller radius is tighter than a car's circle, where it turns by so much at least."""
_ROUND_RAD = 2.0
"""Who turns by more turns round."""
_REACH_M, _REACH_ROUND_M = 4.0, 8.0
"""So far from the drawn lane a car reaches in such a turn, and so much further it drives."""


class Connection(NamedTuple):
    """One way through a junction."""

    before: int
    """The lane that leads to it."""
    lanes: tuple[int, ...]
    """The junction's own lanes on it."""
    starts_m: tuple[float, ...]
    """Where each begins, from the line at which the junction begins."""
    length_m: float
    target: int
    """The lane that it leads to."""
    edge_id: str
    """The edge of that lane."""
    letter: str
    signal: tuple[str, int] | None


class Feeder(NamedTuple):
    """A lane from which one comes to a connection."""

    lane: int
    start_m: float
    """Where it begins, from the junction's line; below 0."""
    edges: tuple[str, ...]
    """The edges that a route has to have next for its vehicle to come through the connection."""


class Conflict(NamedTuple):
    """Where another connection meets the own one; distances from the lines at which each begins."""

    foe: Connection
    own_entry_m: float
    own_exit_m: float
    foe_entry_m: float
    foe_exit_m: float
    first: bool
    """Who comes there has the right of way."""
    first_inside: bool
    """Who waits inside the junction there goes before who enters it."""
    yields: bool
    yields_inside: bool
    gives_way: bool = False
    """Who comes there goes first whatever the own sign or signal: the own car needs his room."""


@dataclass(slots=True)
class Conflicts:
    """The conflicts of all connections, each worked out when it is first asked for."""

    engine: Engine
    road: SumoRoad
    network: SumoNetwork
    _connections: dict[tuple[int, int], Connection] = field(default_factory=dict)
    _at: dict[tuple[int, int], tuple[Conflict, ...]] = field(default_factory=dict)
    _first: dict[tuple[int, int], frozenset[int]] = field(default_factory=dict)
    _meeting: dict[int, frozenset[int]] = field(default_factory=dict)
    _feeders: dict[tuple[int, int], tuple[Feeder, ...]] = field(default_factory=dict)
    _inside: dict[str, tuple[Connection, ...]] = field(default_factory=dict)
    """The connections of each junction."""

    def connection(self, before: int, first: int) -> Connection:
        """Return the connection from a lane through the junction's lane ``first``."""
        key = before, first
        if key not in self._connections:
            link = next(link for link in self.network.links[before] if link.first == first)
            lanes = through(self.road, self.network, link, link.edge_id)
            inner = tuple(lane for lane in lanes if self.network.is_internal[lane])
            ends_m = np.cumsum(self.road.lengths_m[list(inner)]).tolist()
            self._connections[key] = Connection(
                before,
                inner,
                (0.0, *ends_m[:-1]),
                ends_m[-1],
                lanes[-1],
                link.edge_id,
                link.letter,
                link.signal,
            )
        return self._connections[key]

    def connection_of(self, lane: int) -> tuple[Connection, float] | None:
        """Return the connection that a junction's lane belongs to, and where on it the lane begins."""
        number = lane
        for _ in range(8):
            before = self.network.before[number]
            if not before:
                return None
            if not self.network.is_internal[before[0]]:
                found = self.connection(before[0], number)
                return (found, found.starts_m[found.lanes.index(lane)]) if lane in found.lanes else None
            number = before[0]
        return None

    def of(self, own: Connection) -> tuple[Conflict, ...]:
        """Return who meets a connection, and where."""
        key = own.before, own.lanes[0]
        if key not in self._at:
            found = (self._conflict(own, foe) for foe in self._others(own))
            self._at[key] = tuple(conflict for conflict in found if conflict is not None)
        return self._at[key]

    def waits_at_m(self, own: Connection) -> float:
        """Return where on a connection one waits for others: at its line, or where it has a place inside."""
        if len(own.lanes) < 2:
            return 0.0
        inner_m = own.starts_m[1]
        meets_m = [conflict.own_entry_m for conflict in self.of(own) if conflict.first]
        if not meets_m or min(meets_m) < inner_m - _WITHIN_M:
            return 0.0
        waits_m = min(inner_m, *meets_m)
        return waits_m if waits_m > _WORTH_M else 0.0

    def feeders(self, foe: Connection) -> tuple[Feeder, ...]:
        """Return the lanes from which one comes to a connection, as far as they matter."""
        key = foe.before, foe.lanes[0]
        if key not in self._feeders:
            sight_m = _AHEAD_S * float(self.road.limits_mps[foe.before]) + _AHEAD_M
            found: list[Feeder] = []
            waiting = [Feeder(foe.before, -float(self.road.lengths_m[foe.before]), (foe.edge_id,))]
            while waiting:
                feeder = waiting.pop(0)
                found.append(feeder)
                if feeder.start_m < -sight_m:
                    continue
                inside = self.network.is_internal[feeder.lane]
                edges = feeder.edges if inside else (self.road.edge_ids[feeder.lane], *feeder.edges)
                for lane in self.network.before[feeder.lane]:
                    start_m = feeder.start_m - float(self.road.lengths_m[lane])
                    waiting.append(Feeder(lane, start_m, edges))
            self._feeders[key] = tuple(found)
        return self._feeders[key]

    def _others(self, own: Connection) -> list[Connection]:
        """Return the connections of the same junction that begin on other lanes."""
        (junction,) = self.road.junctions[own.lanes[0]]
        if junction not in self._inside:
            lanes = [
                number
                for number, inside in enumerate(self.network.is_internal)
                if inside and junction in self.road.junctions[number]
            ]
            entries = [
                (before, lane)
                for lane in lanes
                for before in self.network.before[lane]
                if not self.network.is_internal[before]
            ]
            self._inside[junction] = tuple(self.connection(*entry) for entry in entries)
        return [foe for foe in self._inside[junction] if foe.before != own.before]

    def _conflict(self, own: Connection, foe: Connection) -> Conflict | None:
        """Return where two connections meet, None: nowhere."""
        reach_m = self._swings_out_m(own)
        if reach_m > 0.0:
            return self._while_swinging_out(own, foe, reach_m)
        if not any(foe_lane in self._meets(lane) for lane in own.lanes for foe_lane in foe.lanes) and not any(
            lane in self._meets(foe_lane) for lane in own.lanes for foe_lane in foe.lanes
        ):
            return None
        own_m, own_points = self._points(own)
        foe_m, foe_points = self._points(foe)
        apart_m = np.hypot(
            own_points[:, None, 0] - foe_points[None, :, 0], own_points[:, None, 1] - foe_points[None, :, 1]
        )
        near = apart_m < _APART_M
        if not near.any():
            return None
        on_own, on_foe = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
        first, first_before = self._first_of(own), self._first_of(foe)
        return Conflict(
            foe,
            float(own_m[on_own[0]]),
            float(own_m[on_own[-1]]),
            float(foe_m[on_foe[0]]),
            float(foe_m[on_foe[-1]]),
            first=foe.before in first,
            first_inside=any(lane in first for lane in foe.lanes),
            yields=own.before in first_before,
            yields_inside=any(lane in first_before for lane in own.lanes),
        )

    def _swings_out_m(self, own: Connection) -> float:
        """Return how far a car has to leave a connection that is tighter than its circle; 0: it is not."""
        _, points = self._points(own)
        steps = np.diff(points, axis=0)
        steps = steps[np.hypot(*steps.T) > 1e-6]
        heading_rad = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        turned_rad = abs(float(heading_rad[-1] - heading_rad[0]))
        if turned_rad < _TIGHT_RAD or own.length_m > _TIGHT_M * turned_rad:
            return 0.0
        return _REACH_ROUND_M if turned_rad > _ROUND_RAD else _REACH_M

    def _while_swinging_out(self, own: Connection, foe: Connection, reach_m: float) -> Conflict | None:
        """Return the conflict of who needs more room than the lanes are drawn with.

        He lets everybody pass who comes near, whoever has the right of way.
        """
        _, points = self._points(own)
        foe_m, foe_points = self._points(foe)
        away_m = np.hypot(*(foe_points[:, None] - points[None, :]).transpose(2, 0, 1)).min(axis=1)
        near = np.flatnonzero(away_m < reach_m)
        if not near.size:
            return None
        entry_m, exit_m = float(foe_m[near[0]]), float(foe_m[near[-1]])
        waits = self._swings_out_m(foe) < reach_m
        return Conflict(
            foe,
            0.0,
            own.length_m + reach_m,
            entry_m,
            exit_m,
            first=waits,
            first_inside=waits,
            yields=not waits,
            yields_inside=not waits,
            gives_way=waits,
        )

    def _first_of(self, own: Connection) -> frozenset[int]:
        """Return the lanes whose vehicles have the right of way before a connection's."""
        key = own.before, own.lanes[0]
        if key not in self._first:
            names, number = self.road.lane_ids, self.road.index_of
            found = self.engine.lane.getFoes(names[own.before], names[own.target])
            self._first[key] = frozenset(number[name] for name in found)
        return self._first[key]

    def _meets(self, lane: int) -> frozenset[int]:
        """Return the junction's lanes that meet one of them."""
        if lane not in self._meeting:
            names, number = self.road.lane_ids, self.road.index_of
            found = self.engine.lane.getInternalFoes(names[lane])
            self._meeting[lane] = frozenset(number[name] for name in found)
        return self._meeting[lane]

    def _points(self, way: Connection) -> tuple[FloatColumn, FloatMatrix]:
        """Return distances along a connection and the points there, shape ``(p,)`` and ``(p, 2)``."""
        at_m: list[FloatColumn] = []
        points: list[FloatMatrix] = []
        for lane, start_m in zip(way.lanes, way.starts_m, strict=True):
            length_m = float(self.road.lengths_m[lane])
            along_m = np.linspace(0.0, length_m, max(2, int(np.ceil(length_m / _EVERY_M)) + 1))
            numbers = np.full(along_m.size, lane, np.int64)
            here = self.road.points_ahead(numbers, along_m, np.full(along_m.size, -1, np.int64))
            at_m.append(start_m + along_m)
            points.append(np.stack([here.x_m, here.y_m], axis=-1))
        return np.concatenate(at_m), np.concatenate(points)
