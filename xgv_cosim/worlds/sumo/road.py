"""The lanes of a SUMO network as one set of flat columns, answered without a call into SUMO.

All centre lines stand one behind the other on a single axis of distance, so that one search finds the
segments of any number of points on any lanes. SUMO measures along a lane in a length that may differ from
that of the lane's drawn shape; positions are scaled from one to the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.road import LanePoints
from xgv_cosim.worlds.sumo.handedness import is_left_hand
from xgv_cosim.worlds.sumo.lane_table import LaneTables, tables_of

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.worlds.sumo.engine import Engine

_SHORTEST_SEGMENT_M = 1e-6
_MOST_LANES_AHEAD = 16
"""So many lanes are followed past the end of the first; more lie beyond any preview."""


def drawable(shape: FloatMatrix) -> FloatMatrix:
    """Return a centre line without repeated points, of two points at least."""
    steps = np.hypot(*np.diff(shape, axis=0).T)
    kept: FloatMatrix = shape[np.concatenate([[True], steps > _SHORTEST_SEGMENT_M])]
    if len(kept) == 1:
        kept = np.vstack([kept, kept + np.array([1e-3, 0.0])])
    return kept


def _junctions(engine: Engine, lane_ids: tuple[str, ...]) -> tuple[frozenset[str], ...]:
    """Return the names of the junctions at the ends of each lane; of a lane inside one, that one."""
    ends: dict[str, frozenset[str]] = {}
    for lane_id in lane_ids:
        edge_id = lane_id.rpartition("_")[0]
        if edge_id in ends:
            continue
        if edge_id.startswith(":"):
            ends[edge_id] = frozenset((edge_id[1:].rpartition("_")[0],))
        else:
            edge = engine.edge
            ends[edge_id] = frozenset((edge.getFromJunction(edge_id), edge.getToJunction(edge_id)))
    return tuple(ends[lane_id.rpartition("_")[0]] for lane_id in lane_ids)


@dataclass(frozen=True)
class SumoRoad:
    """All lanes of a network, internal ones too, numbered as SUMO lists them. Implements ``Road``."""

    lane_ids: tuple[str, ...]
    shapes: tuple[FloatMatrix, ...]
    """Centre line of each lane, shape ``(k, 2)``."""
    lengths_m: FloatColumn
    """SUMO's length of each lane, which positions refer to."""
    widths_m: FloatColumn
    limits_mps: FloatColumn
    edge_ids: tuple[str, ...]
    """The edge that each lane belongs to."""
    successors: tuple[tuple[tuple[str, int], ...], ...]
    """For each lane (edge reached, first lane on the way there), the junction's own lane if it has one."""
    junctions: tuple[frozenset[str], ...] = ()
    """Names of the junctions that each lane leads between, or of the one that it is inside of."""
    leftwards: int = 1
    """By how much a lane's number on its edge grows from one to its left: 1, in left-hand networks -1."""

    @classmethod
    def read(cls, engine: Engine) -> SumoRoad:
        """Read the network of the open simulation."""
        lane = engine.lane
        ids: tuple[str, ...] = tuple(lane.getIDList())
        number = {lane_id: index for index, lane_id in enumerate(ids)}
        shapes = {lane_id: drawable(np.array(lane.getShape(lane_id))[:, :2]) for lane_id in ids}
        return cls(
            lane_ids=ids,
            shapes=tuple(shapes.values()),
            lengths_m=np.array([lane.getLength(lane_id) for lane_id in ids], np.float64),
            widths_m=np.array([lane.getWidth(lane_id) for lane_id in ids], np.float64),
            limits_mps=np.array([lane.getMaxSpeed(lane_id) for lane_id in ids], np.float64),
            edge_ids=tuple(lane.getEdgeID(lane_id) for lane_id in ids),
            successors=tuple(
                tuple(
                    (lane.getEdgeID(link[0]), number[link[4] or link[0]]) for link in lane.getLinks(lane_id)
                )
                for lane_id in ids
            ),
            junctions=_junctions(engine, ids),
            leftwards=-1 if is_left_hand(engine, shapes) else 1,
        )

    @cached_property
    def inside_junction(self) -> BoolColumn:
        """Return which lanes are a junction's own, shape ``(number of lanes,)``."""
        return np.array([lane_id.startswith(":") for lane_id in self.lane_ids], np.bool_)

    @cached_property
    def index_of(self) -> dict[str, int]:
        """Return the number of each lane; SUMO's empty name for "off the road" has -1."""
        return {**{lane_id: index for index, lane_id in enumerate(self.lane_ids)}, "": -1}

    @property
    def onward(self) -> tuple[tuple[int, ...], ...]:
        """Return the lanes that each lane leads to."""
        return tuple(tuple(lane for _, lane in links) for links in self.successors)

    @cached_property
    def _only_successor(self) -> IntColumn:
        """Where a lane goes on when it has only one way to, else -1."""
        return np.array([links[0][1] if len(links) == 1 else -1 for links in self.successors], np.int64)

    @cached_property
    def _first(self) -> IntColumn:
        """Index of the first vertex of each lane; one entry more at the end."""
        return np.concatenate([[0], np.cumsum([len(shape) for shape in self.shapes])])

    @cached_property
    def _vertices(self) -> FloatMatrix:
        return np.concatenate(self.shapes)

    @cached_property
    def _scale(self) -> FloatColumn:
        """Metres of the drawn shape for each metre of SUMO's lane length."""
        drawn = np.array([np.hypot(*np.diff(shape, axis=0).T).sum() for shape in self.shapes])
        return drawn / np.maximum(self.lengths_m, _SHORTEST_SEGMENT_M)

    @cached_property
    def _start_m(self) -> FloatColumn:
        """Where each lane begins on the common axis."""
        return np.concatenate([[0.0], np.cumsum(self.lengths_m)[:-1]])

    @cached_property
    def _vertex_m(self) -> FloatColumn:
        """Each vertex on the common axis; never falls."""
        return np.concatenate(
            [
                start + np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(shape, axis=0).T))]) / scale
                for shape, start, scale in zip(self.shapes, self._start_m, self._scale, strict=True)
            ]
        )

    @cached_property
    def _segment_rad(self) -> FloatColumn:
        """Heading from each vertex to the next; meaningless at a lane's last vertex."""
        steps = np.diff(self._vertices, axis=0, append=self._vertices[-1:])
        return np.arctan2(steps[:, 1], steps[:, 0])

    @cached_property
    def tables(self) -> LaneTables:
        """Return the lanes for compiled code."""
        return tables_of(self.shapes, self.lengths_m, self.widths_m, self._only_successor, self.leftwards)

    def lane_length_m(self, lane: IntColumn) -> FloatColumn:
        """Return the length of each lane, 0 off-road."""
        return np.where(lane >= 0, self.lengths_m[lane], 0.0)

    def lane_width_m(self, lane: IntColumn) -> FloatColumn:
        """Return the width of each lane, 0 off-road."""
        return np.where(lane >= 0, self.widths_m[lane], 0.0)

    def lane_limit_mps(self, lane: IntColumn) -> FloatColumn:
        """Return the speed limit of each lane, 0 off-road."""
        return np.where(lane >= 0, self.limits_mps[lane], 0.0)

    def lane_shape_m(self, lane: int) -> FloatMatrix:
        """Return the centre line of one lane, shape ``(k, 2)``, frame east-north-up."""
        return self.shapes[lane].copy()

    def next_lane(self, lane: int, edge_id: str) -> int:
        """Return the lane that leads from ``lane`` to the edge, -1 if none does."""
        return next((index for edge, index in self.successors[lane] if edge == edge_id), -1)

    @cached_property
    def _beside(self) -> dict[tuple[str, int], int]:
        """(edge, place from the kerb) -> lane, of all edges between junctions."""
        return {
            (edge_id, int(lane_id.rpartition("_")[2])): number
            for number, (lane_id, edge_id) in enumerate(zip(self.lane_ids, self.edge_ids, strict=True))
            if not lane_id.startswith(":")
        }

    def beside(self, lane: int, side: int) -> int:
        """Return the lane of the same edge to the left (1) or right (-1), -1: none, or inside a junction."""
        place = int(self.lane_ids[lane].rpartition("_")[2])
        return self._beside.get((self.edge_ids[lane], place + side * self.leftwards), -1)

    @cached_property
    def lanes_beside(self) -> IntColumn:
        """Return ``beside`` of every lane as a table, shape ``(2, number of lanes)``: left, right."""
        lanes = range(len(self.lane_ids))
        return np.array([[self.beside(lane, side) for lane in lanes] for side in (1, -1)], np.int64)

    @cached_property
    def _innermost(self) -> dict[str, int]:
        """The lane next to the oncoming ones, of each edge between junctions."""
        innermost: dict[str, int] = {}
        for (edge_id, _), lane in sorted(self._beside.items()):
            innermost[edge_id] = lane
        return innermost

    @cached_property
    def _edges_between(self) -> dict[frozenset[str], tuple[str, ...]]:
        """Junctions at the two ends -> the edges that lead between them."""
        between: dict[frozenset[str], dict[str, None]] = {}
        for edge_id, lane in self._innermost.items():
            if self.junctions and len(self.junctions[lane]) == 2:
                between.setdefault(self.junctions[lane], {})[edge_id] = None
        return {ends: tuple(edges) for ends, edges in between.items()}

    def oncoming(self, lane: int) -> tuple[int, ...]:
        """Return the innermost lanes of the edges that lead back between the same two junctions."""
        if not self.junctions or self.inside_junction[lane]:
            return ()
        start_m = self.shapes[lane][0]
        found = []
        for edge_id in self._edges_between.get(self.junctions[lane], ()):
            innermost = self._innermost[edge_id]
            shape = self.shapes[innermost]
            if np.hypot(*(shape[-1] - start_m)) < np.hypot(*(shape[0] - start_m)):  # ends where this begins
                found.append(innermost)
        return tuple(found)

    def project(self, lane: int, x_m: FloatColumn, y_m: FloatColumn) -> tuple[FloatColumn, FloatColumn]:
        """Return (position, offset to the left) of points at the nearest place of one lane's centre line.

        Before its beginning and past its end the line goes straight on.
        """
        shape = self.shapes[lane]
        steps = np.diff(shape, axis=0)
        lengths_m = np.hypot(*steps.T)
        units = steps / lengths_m[:, None]
        off = np.stack([x_m, y_m], axis=1)[:, None, :] - shape[None, :-1, :]
        least_m, most_m = np.zeros(len(lengths_m)), lengths_m.copy()
        least_m[0], most_m[-1] = -np.inf, np.inf
        along_m = np.clip((off * units).sum(axis=2), least_m, most_m)
        away_m = np.hypot(*np.moveaxis(off - along_m[..., None] * units, 2, 0))
        nearest, points = away_m.argmin(axis=1), np.arange(len(x_m))
        starts_m = np.concatenate([[0.0], np.cumsum(lengths_m)[:-1]])
        side = units[nearest, 0] * off[points, nearest, 1] - units[nearest, 1] * off[points, nearest, 0]
        position_m = (starts_m[nearest] + along_m[points, nearest]) / self._scale[lane]
        return position_m, np.copysign(away_m[points, nearest], side)

    def only_successor(self, lane: int) -> int:
        """Return where a lane goes on when it has only one way to, else -1."""
        return int(self._only_successor[lane])

    def points_ahead(self, lane: IntColumn, position_m: FloatColumn, next_lane: IntColumn) -> LanePoints:
        """Return the centre-line points at ``position_m``; ``nan`` off-road.

        A position past the lane's end goes on along ``next_lane`` (-1: straight on past the end), and from
        there along every lane that has only one successor. A position before the lane's beginning lies
        straight back from it.
        """
        on_road = lane >= 0
        lane, position_m, following = lane.copy(), position_m.astype(np.float64), next_lane
        for _ in range(_MOST_LANES_AHEAD):
            past = on_road & (following >= 0) & (position_m > self.lengths_m[lane])
            if not past.any():
                break
            position_m = np.where(past, position_m - self.lengths_m[lane], position_m)
            lane = np.where(past, following, lane)
            following = np.where(past, self._only_successor[lane], following)
        on_axis_m = self._start_m[lane] + np.clip(position_m, 0.0, self.lengths_m[lane])
        vertex = np.searchsorted(self._vertex_m, on_axis_m, side="right") - 1
        vertex = np.clip(vertex, self._first[lane], self._first[lane + 1] - 2)
        beyond_m = (position_m + self._start_m[lane] - self._vertex_m[vertex]) * self._scale[lane]
        heading_rad = np.where(on_road, self._segment_rad[vertex], np.nan)
        return LanePoints(
            self._vertices[vertex, 0] + beyond_m * np.cos(heading_rad),
            self._vertices[vertex, 1] + beyond_m * np.sin(heading_rad),
            heading_rad,
        )
