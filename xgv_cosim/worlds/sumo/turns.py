"""Turns that are drawn more tightly than a car can drive: SUMO's own cars turn on the spot if need be."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import FloatMatrix
    from xgv_cosim.worlds.sumo.road import SumoRoad

_TURN_RAD = 1.0
"""A bend by less is cut by any car: its lane is wide enough."""
_MOST_LANES = 8
"""A way through a junction has no more lanes of its own than this."""


def tightest_radius_m(line: FloatMatrix) -> float:
    """Return the least radius on which a line, shape ``(k, 2)``, turns by ``_TURN_RAD``; ``inf``: nowhere.

    Between the middles of two segments the line turns by the angle between them: on a circle that is exact.
    """
    steps = np.diff(line, axis=0)
    lengths_m = np.hypot(*steps.T)
    steps, lengths_m = steps[lengths_m > 0.0], lengths_m[lengths_m > 0.0]
    heading_rad = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    middle_m = np.cumsum(lengths_m) - 0.5 * lengths_m
    turned_rad = np.abs(heading_rad[None, :] - heading_rad[:, None])
    apart_m = np.abs(middle_m[None, :] - middle_m[:, None])
    turns = turned_rad >= _TURN_RAD
    return float((apart_m[turns] / turned_rad[turns]).min(initial=np.inf))


class Turn(NamedTuple):
    """The widest way from one edge to the next."""

    radius_m: float
    lane_id: str
    """Its first lane inside the junction."""


@dataclass(frozen=True)
class Turns:
    """Tells the turns of routes; each pair of edges is looked at once."""

    road: SumoRoad
    _known: dict[tuple[str, str], Turn] = field(default_factory=dict)

    def tighter_than(self, radius_m: float, edges: Sequence[str]) -> tuple[str, ...]:
        """Return in words where a route turns on a smaller radius, on every lane that leads on; each once."""
        pairs = {pair: self._turn(*pair) for pair in pairwise(edges)}
        return tuple(
            f"from {before} to {after} on lane {turn.lane_id}: {turn.radius_m:.1f} m"
            for (before, after), turn in pairs.items()
            if turn.radius_m < radius_m
        )

    @cached_property
    def _lanes_of(self) -> dict[str, list[int]]:
        lanes: dict[str, list[int]] = {}
        for lane, edge_id in enumerate(self.road.edge_ids):
            lanes.setdefault(edge_id, []).append(lane)
        return lanes

    def _turn(self, before: str, after: str) -> Turn:
        if (before, after) not in self._known:
            ways = [
                first
                for lane in self._lanes_of.get(before, ())
                for edge_id, first in self.road.successors[lane]
                if edge_id == after
            ]
            turns = [Turn(self._radius_m(first), self.road.lane_ids[first]) for first in ways]
            self._known[before, after] = max(turns, default=Turn(np.inf, ""))
        return self._known[before, after]

    def _radius_m(self, first: int) -> float:
        """Return the least radius of a way, whose first lane may be all that is inside the junction."""
        lanes = [first]
        while len(lanes) < _MOST_LANES and self.road.inside_junction[lanes[-1]]:
            onward = self.road.only_successor(lanes[-1])
            if onward < 0:
                break
            lanes.append(onward)
        inside = [self.road.shapes[lane] for lane in lanes if self.road.inside_junction[lane]]
        return tightest_radius_m(np.concatenate(inside)) if inside else np.inf
