"""The ways of all vehicles as columns, and the lines on each at which signals or others have a say."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.worlds.sumo.network import SumoNetwork
    from xgv_cosim.worlds.sumo.road import SumoRoad
    from xgv_cosim.worlds.sumo.routes import Way


class Line(NamedTuple):
    """A line on a way at which signals or others may have a say."""

    at_m: float
    """From the beginning of the way's first lane."""
    exit_m: float
    """Where the way leaves the junction behind it."""
    part_end_m: float
    """Where the next line inside the same junction is, or its exit."""
    letter: str
    signal: tuple[str, int] | None
    lanes: frozenset[str]
    """Names of the way's lanes from this line to the next."""


def lines_of(road: SumoRoad, network: SumoNetwork, way: Way) -> tuple[Line, ...]:
    """Return the lines on a way: before every junction, and inside it where one waits again."""
    at: list[int] = []
    for number in range(1, len(way.lanes)):
        before, lane = way.lanes[number - 1], way.lanes[number]
        link = next((link for link in network.links[before] if link.first == lane), None)
        if link is not None and (network.is_internal[lane] or link.signal):
            at.append(number)
    found: list[Line] = []
    for order, number in enumerate(at):
        before, lane = way.lanes[number - 1], way.lanes[number]
        link = next(link for link in network.links[before] if link.first == lane)
        out = next((n for n in range(number, len(way.lanes)) if not network.is_internal[way.lanes[n]]), -1)
        exit_m = way.starts_m[out] if out >= 0 else way.starts_m[-1] + float(road.lengths_m[way.lanes[-1]])
        part_end = at[order + 1] if order + 1 < len(at) else len(way.lanes)
        inner_end = min(part_end, out if out >= 0 else len(way.lanes))
        part_end_m = way.starts_m[inner_end] if inner_end < len(way.lanes) else exit_m
        found.append(
            Line(
                way.starts_m[number],
                exit_m,
                part_end_m,
                link.letter,
                link.signal,
                frozenset(road.lane_ids[n] for n in way.lanes[number:inner_end]),
            )
        )
    if network.is_internal[way.lanes[0]]:
        out = next((n for n, lane in enumerate(way.lanes) if not network.is_internal[lane]), -1)
        exit_m = way.starts_m[out] if out >= 0 else float(road.lengths_m[way.lanes[0]])
        end_m = way.starts_m[1] if len(way.lanes) > 1 else exit_m
        found.insert(0, Line(-1.0, exit_m, end_m, "M", None, frozenset((road.lane_ids[way.lanes[0]],))))
    return tuple(found)


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
