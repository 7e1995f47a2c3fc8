"""The ways of all vehicles as columns, and the lines on each at which signals or others have a say."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.worlds.sumo.conflicts import Conflict, Conflicts, Connection
    from xgv_cosim.worlds.sumo.network import SumoNetwork
    from xgv_cosim.worlds.sumo.routes import Way


class Line(NamedTuple):
    """A line on a way at which signals or others may have a say; distances from where the way begins."""

    at_m: float
    """Where the junction begins: a signal's line."""
    waits_m: float
    """Where one waits for others, there or inside the junction."""
    exit_m: float
    """Where the way leaves the junction."""
    letter: str
    signal: tuple[str, int] | None
    conflicts: tuple[Conflict, ...]


def lines_of(network: SumoNetwork, conflicts: Conflicts, way: Way) -> tuple[Line, ...]:
    """Return the lines on a way: of the junction that it begins in, and of every one ahead."""
    found: list[Line] = []
    if network.is_internal[way.lanes[0]]:
        inside = conflicts.connection_of(way.lanes[0])
        if inside is not None:
            found.append(_line(conflicts, inside[0], -inside[1]))
    for number in range(1, len(way.lanes)):
        before, lane = way.lanes[number - 1], way.lanes[number]
        if network.is_internal[before]:
            continue
        link = next((link for link in network.links[before] if link.first == lane), None)
        if link is None:
            continue
        if network.is_internal[lane]:
            found.append(_line(conflicts, conflicts.connection(before, lane), way.starts_m[number]))
        elif link.signal:
            at_m = way.starts_m[number]
            found.append(Line(at_m, at_m, at_m, link.letter, link.signal, ()))
    return tuple(found)


def _line(conflicts: Conflicts, own: Connection, at_m: float) -> Line:
    waits_m = at_m + conflicts.waits_at_m(own)
    return Line(at_m, waits_m, at_m + own.length_m, own.letter, own.signal, conflicts.of(own))


class LeftM(NamedTuple):
    """How far ahead things end, shape ``(n,)``, ``inf``: not in sight."""

    lane_end_m: FloatColumn
    route_end_m: FloatColumn


@dataclass(slots=True)
class PaddedLanes:
    """Lanes one after the other, of all vehicles."""

    lanes: IntColumn
    """Shape ``(n, k)``, -1 past the end."""
    starts_m: FloatMatrix
    """Where each begins, from the beginning of the first, shape ``(n, k)``, ``inf`` past the end."""

    @classmethod
    def of(cls, count: int) -> PaddedLanes:
        """Return no lanes for so many vehicles."""
        return cls(np.full((count, 1), -1, np.int64), np.full((count, 1), np.inf))

    def put(self, number: int, lanes: Sequence[int], starts_m: Sequence[float]) -> None:
        """Replace the lanes of one vehicle."""
        further = len(lanes) - self.lanes.shape[1]
        if further > 0:
            count = len(self.lanes)
            self.lanes = np.hstack([self.lanes, np.full((count, further), -1, np.int64)])
            self.starts_m = np.hstack([self.starts_m, np.full((count, further), np.inf)])
        self.lanes[number], self.starts_m[number] = -1, np.inf
        self.lanes[number, : len(lanes)], self.starts_m[number, : len(lanes)] = lanes, starts_m


@dataclass(slots=True)
class Ways:
    """The ways of all vehicles as columns, padded."""

    along: PaddedLanes
    end_m: FloatColumn
    route_end_m: FloatColumn
    changes: IntColumn

    @classmethod
    def of(cls, count: int) -> Ways:
        """Return no ways for so many vehicles."""
        endless = np.full((2, count), np.inf)
        return cls(PaddedLanes.of(count), endless[0], endless[1], np.zeros(count, np.int64))

    @property
    def lanes(self) -> IntColumn:
        """Return the lanes of each, shape ``(n, k)``, -1 past the end."""
        return self.along.lanes

    @property
    def starts_m(self) -> FloatMatrix:
        """Return where each lane begins, shape ``(n, k)``, ``inf`` past the end."""
        return self.along.starts_m

    def put(self, number: int, way: Way) -> None:
        """Replace the way of one vehicle."""
        self.along.put(number, way.lanes, way.starts_m)
        self.end_m[number], self.route_end_m[number] = way.end_m, way.route_end_m
        self.changes[number] = way.changes

    def at(self, distance_m: FloatMatrix, numbers: IntColumn | None = None) -> tuple[IntColumn, FloatMatrix]:
        """Return lane and position on it at distances from the beginning of ways, shape ``(m, p)``.

        Args:
            distance_m: Shape ``(m, p)``.
            numbers: Which ways, shape ``(m,)``; None: all.
        """
        row = (np.arange(len(self.lanes)) if numbers is None else numbers)[:, None]
        on = np.zeros(distance_m.shape, np.int64)
        for number in range(1, self.lanes.shape[1]):  # lanes are few, and begin one behind the other
            on += self.starts_m[row, number] <= distance_m
        return self.lanes[row, on], distance_m - self.starts_m[row, on]

    def first_left_m(self, position_m: FloatColumn) -> LeftM:
        """Return how far the ends are from positions on the first lanes."""
        return LeftM(self.end_m - position_m, self.route_end_m - position_m)
