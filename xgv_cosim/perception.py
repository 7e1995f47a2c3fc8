"""What each vehicle may know: observations for the stacks, from the fleet, the snapshot and the road."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import NamedTuple, Self

import numpy as np

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from xgv_cosim.columns import FloatBlock, FloatColumn, FloatMatrix, IntColumn
from xgv_cosim.fleet_columns import Motion
from xgv_cosim.observation import DeviceReading, LaneBeside, Observation
from xgv_cosim.points import Points
from xgv_cosim.road import Road
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.surroundings import PREVIEW_M, Beside, Surroundings


class ModeView(NamedTuple):
    """What a vehicle reports of its own modes and components."""

    safety_mode: str
    reasons: tuple[str, ...]
    component_status: dict[ComponentId, ComponentStatus]
    component_controller: dict[ComponentId, JausAddress | None]
    devices: DeviceReading


def lane_ahead(surroundings: Surroundings, motion: Motion, slots: IntColumn) -> FloatBlock:
    """Return centre-line points ahead in each vehicle's own frame, shape ``(n, len(PREVIEW_M), 2)``.

    Frame: x forward, y left, origin at the rear axle.
    """
    east = surroundings.way_x_m - motion.x_m[slots][:, None]
    north = surroundings.way_y_m - motion.y_m[slots][:, None]
    cosine = np.cos(motion.heading_rad[slots])[:, None]
    sine = np.sin(motion.heading_rad[slots])[:, None]
    return np.stack([cosine * east + sine * north, cosine * north - sine * east], axis=-1)


CHORDS_M = (4.0, 8.0, 16.0, 32.0)
"""Lengths over which the curvature of the way is judged."""
CUT_M = 0.25
"""So far a car may cut a kink of the drawn line: the longest chord that cuts no more counts."""


def _at(distance_m: FloatColumn) -> FloatMatrix:
    """Return weights that give a way's point at distances from its points at ``PREVIEW_M``."""
    weights = np.zeros((PREVIEW_M.size, distance_m.size))
    after = np.clip(np.searchsorted(PREVIEW_M, distance_m), 1, PREVIEW_M.size - 1)
    share = (distance_m - PREVIEW_M[after - 1]) / (PREVIEW_M[after] - PREVIEW_M[after - 1])
    columns = np.arange(distance_m.size)
    weights[after - 1, columns], weights[after, columns] = 1.0 - share, share
    return weights


class _Chord(NamedTuple):
    """A chord before and one after each of ``PREVIEW_M``, as weights of a way's points."""

    back: FloatMatrix
    onward: FloatMatrix
    mean_m: FloatColumn

    @classmethod
    def of(cls, chord_m: float) -> Self:
        """Return chords of a length, shorter at the ends of the preview."""
        back_m = np.clip(PREVIEW_M - chord_m, 0.0, None)
        onward_m = np.clip(PREVIEW_M + chord_m, None, PREVIEW_M[-1])
        return cls(_at(back_m), _at(onward_m), np.maximum(0.5 * (onward_m - back_m), 1e-6))


_CHORDS = tuple(map(_Chord.of, CHORDS_M))


def way_curvature(x_m: FloatMatrix, y_m: FloatMatrix) -> FloatMatrix:
    """Return the curvature of ways at ``PREVIEW_M``, positive to the left, shape ``(n, len(PREVIEW_M))``.

    A drawn lane is straight but for kinks. At each point the way turns between the chord before and the
    chord after it; chords grow as long as a kink is cut by no more than ``CUT_M``.
    """
    curvature, counts = np.zeros(x_m.shape), np.ones(x_m.shape, np.bool_)
    for back, onward, mean_m in _CHORDS:
        before_x, before_y = x_m - x_m @ back, y_m - y_m @ back
        after_x, after_y = x_m @ onward - x_m, y_m @ onward - y_m
        turned = np.arctan2(before_x * after_y - before_y * after_x, before_x * after_x + before_y * after_y)
        counts &= np.abs(turned) * mean_m / 8.0 <= CUT_M
        judged = counts | (mean_m is _CHORDS[0].mean_m)
        curvature = np.where(judged, turned / mean_m, curvature)
    curvature[:, 0], curvature[:, -1] = curvature[:, 1], curvature[:, -2]
    return np.nan_to_num(curvature)


def lanes_beside(beside: Beside) -> list[LaneBeside | None]:
    """Return the lane to one side of each vehicle, None where no lane may be changed to."""
    found: list[LaneBeside | None] = [None] * len(beside.offset_m)
    there = np.flatnonzero(~np.isnan(beside.offset_m))
    lanes = map(LaneBeside, *(column[there].tolist() for column in beside))
    for number, lane in zip(there.tolist(), lanes, strict=True):
        found[number] = lane
    return found


def observe(
    snapshot: Snapshot,
    road: Road,
    surroundings: Surroundings,
    motion: Motion,
    slots: IntColumn,
    vehicle_ids: Sequence[str],
    views: Sequence[ModeView],
) -> list[Observation]:
    """Return the observation of each bound vehicle in ``slots``.

    Args:
        snapshot: The world after the step.
        road: Lanes of the world.
        surroundings: What surrounds these vehicles, length n.
        motion: The fleet's motion, as measured.
        slots: Slots to observe, shape ``(n,)``.
        vehicle_ids: Vehicle id of each slot, length n.
        views: Modes of each slot, length n.
    """
    around, count = surroundings, len(slots)
    has_way = around.has_way.tolist()
    distances_m = np.broadcast_to(PREVIEW_M, around.way_x_m.shape)
    curvature = np.stack([distances_m, way_curvature(around.way_x_m, around.way_y_m)], axis=-1)
    sees_leader = np.isfinite(around.leader_gap_m)
    own = {name: getattr(motion, name)[slots].tolist() for name in _OWN}
    columns: dict[str, Sequence[object]] = {
        **own,
        **{name: getattr(around, name).tolist() for name in _AROUND},
        **{name: [view[place] for view in views] for place, name in enumerate(ModeView._fields)},
        "time_s": [snapshot.time_s] * count,
        "vehicle_id": vehicle_ids,
        "lane_ahead_m": _points(lane_ahead(around, motion, slots), has_way),
        "curvature_ahead": _points(curvature, has_way),
        "leader_speed_mps": np.where(sees_leader, around.leader_speed_mps, own["speed_mps"]).tolist(),
        "length_m": snapshot.length_m[snapshot.rows_of(vehicle_ids)].tolist(),
        "on_road": (around.lane >= 0).tolist(),
        "lane_id": [road.lane_ids[lane] if lane >= 0 else "" for lane in around.lane.tolist()],
        "left": lanes_beside(around.left),
        "right": lanes_beside(around.right),
        "limits_ahead": around.limits_ahead,
        "signal": around.signals,
        "junction": around.junctions,
    }
    return list(map(Observation, *(columns[name] for name in _FIELDS)))


_FIELDS = tuple(field.name for field in fields(Observation))
_OWN = ("x_m", "y_m", "heading_rad", "speed_mps", "accel_mps2", "curvature_per_m")
_AROUND = (
    "limit_mps", "leader_gap_m", "lane_width_m", "lateral_m", "lane_changes", "lane_end_m", "route_end_m",
)  # fmt: skip


def _points(matrices: FloatBlock, has_way: Sequence[bool]) -> list[Sequence[tuple[float, float]]]:
    """Return the points of each way, none where there is none."""
    points: list[Sequence[tuple[float, float]]] = list(map(Points, matrices))
    for number, known in enumerate(has_way):
        if not known:
            points[number] = ()
    return points
