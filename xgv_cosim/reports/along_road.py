"""Distance along the road: one axis through the most travelled edges, found in the trajectories.

An edge is a bundle of parallel lanes; ids that end in ``_0``, ``_1``, ... (SUMO's custom) name its lanes
from the kerb. Where one edge goes on into the next, and how far it is, is read off the vehicles that
drove over it, so that short pieces within a junction, which a fast car may skip, need no special care.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

import numpy as np

from xgv_cosim.columns import FloatColumn, IntColumn
from xgv_cosim.recording import Trajectory

_LANE_OF_EDGE = re.compile(r"^(?P<edge>.+)_(?P<index>\d+)$")


@dataclass(frozen=True, slots=True)
class AlongRoad:
    """Where each row of the trajectories lies on the most travelled road."""

    distance_m: FloatColumn
    """Distance from the road's beginning, NaN elsewhere."""
    lane_index: IntColumn
    """Number of the lane from the kerb, -1 elsewhere."""
    edges: tuple[str, ...]
    """The edges in driving order."""
    share: float
    """Share of all rows that lie on this road."""


def edge_and_index(lane_id: str) -> tuple[str, int]:
    """Return the edge of a lane and the lane's number on it, counted from the kerb."""
    match = _LANE_OF_EDGE.match(lane_id)
    return (match["edge"], int(match["index"])) if match else (lane_id, 0)


def along_road(track: Trajectory) -> AlongRoad:
    """Find the most travelled chain of edges and put every row on it."""
    named = [edge_and_index(lane_id) for lane_id in track.lane_ids]
    edges = tuple(dict.fromkeys(edge for edge, _ in named))
    edge_of_lane = np.array([edges.index(edge) for edge, _ in named] + [-1], np.int64)
    index_of_lane = np.array([index for _, index in named] + [-1], np.int64)
    edge = edge_of_lane[track.lane]

    offsets = _offsets(edge, track)
    offset = np.array([offsets.get(number, np.nan) for number in range(len(edges))] + [np.nan])
    distance_m = offset[edge] + track["lane_position"]
    on_road = np.isfinite(distance_m)
    if on_road.any():
        distance_m -= min(offsets.values())
    return AlongRoad(
        distance_m=distance_m,
        lane_index=np.where(on_road, index_of_lane[track.lane], -1),
        edges=tuple(edges[number] for number in sorted(offsets, key=offsets.__getitem__)),
        share=float(on_road.mean()) if len(on_road) else 0.0,
    )


def _offsets(edge: IntColumn, track: Trajectory) -> dict[int, float]:
    """Return the beginning of each edge of the chain, relative to its busiest edge."""
    travelled = edge[edge >= 0]
    if not len(travelled):
        return {}
    gaps = _gaps(edge, track)
    counts = {pair: len(values) for pair, values in gaps.items()}
    start = Counter(travelled.tolist()).most_common(1)[0][0]
    offsets = {start: 0.0}
    for here, there in ((0, 1), (1, 0)):  # forward along the successors, then back along the predecessors
        current = start
        while True:
            ways = {p[there]: n for p, n in counts.items() if p[here] == current and p[there] not in offsets}
            if not ways:
                break
            nearest = max(ways, key=lambda number: (ways[number], -number))
            pair = (current, nearest) if here == 0 else (nearest, current)
            step = float(np.median(gaps[pair]))
            offsets[nearest] = offsets[current] + (step if here == 0 else -step)
            current = nearest
    return offsets


def _gaps(edge: IntColumn, track: Trajectory) -> dict[tuple[int, int], list[float]]:
    """Return, for each pair of consecutive edges, the distances between their beginnings as driven."""
    changes = np.flatnonzero(
        (track.vehicle[1:] == track.vehicle[:-1])
        & (edge[1:] != edge[:-1])
        & (edge[1:] >= 0)
        & (edge[:-1] >= 0)
    )
    position_m, speed_mps = track["lane_position"], track["measured_speed"]
    driven_m = (
        0.5
        * (speed_mps[changes] + speed_mps[changes + 1])
        * (track.time_s[changes + 1] - track.time_s[changes])
    )
    between_m = position_m[changes] + driven_m - position_m[changes + 1]
    gaps: dict[tuple[int, int], list[float]] = {}
    for row, gap_m in zip(changes.tolist(), between_m.tolist(), strict=True):
        gaps.setdefault((int(edge[row]), int(edge[row + 1])), []).append(gap_m)
    return gaps
