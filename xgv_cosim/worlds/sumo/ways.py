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


@dataclass(frozen=True, slots=True)
class Ways:
    """The ways of all vehicles as columns, padded."""

    lanes: IntColumn
    """Shape ``(n, k)``, -1 past the end."""
    starts_m: FloatMatrix
    """Shape ``(n, k)``, ``inf`` past the end."""
    end_m: FloatColumn
    route_end_m: FloatColumn
    changes: IntColumn

    @classmethod
    def of(cls, ways: Sequence[Way]) -> Ways:
        """Return the ways as columns."""
        most = max((len(way.lanes) for way in ways), default=1)
        lanes = np.full((len(ways), most), -1, np.int64)
        starts_m = np.full((len(ways), most), np.inf)
        for number, way in enumerate(ways):
            lanes[number, : len(way.lanes)] = way.lanes
            starts_m[number, : len(way.starts_m)] = way.starts_m
        return cls(
            lanes,
            starts_m,
            np.array([way.end_m for way in ways], np.float64),
            np.array([way.route_end_m for way in ways], np.float64),
            np.array([way.changes for way in ways], np.int64),
        )

    def at(self, distance_m: FloatMatrix) -> tuple[IntColumn, FloatMatrix]:
        """Return lane and position on it at distances from the beginning of each way, shape ``(n, p)``."""
        on = np.maximum((self.starts_m[:, None, :] <= distance_m[:, :, None]).sum(axis=-1) - 1, 0)
        row = np.arange(len(self.lanes))[:, None]
        return self.lanes[row, on], distance_m - self.starts_m[row, on]

    def first_left_m(self, position_m: FloatColumn) -> LeftM:
        """Return how far the ends are from positions on the first lanes."""
        return LeftM(self.end_m - position_m, self.route_end_m - position_m)
