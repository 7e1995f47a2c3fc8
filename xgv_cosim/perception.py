"""What each vehicle may know: observations for the stacks, from the fleet, the snapshot and the road."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn
from xgv_cosim.fleet import Motion
from xgv_cosim.observation import DeviceReading, Observation
from xgv_cosim.road import Road
from xgv_cosim.snapshot import Snapshot

PREVIEW_M = np.array([0.0, 3.0, 6.0, 10.0, 15.0, 20.0, 26.0, 33.0, 41.0, 50.0])
"""Distances beyond the front bumper at which a stack sees the lane's centre line."""


@dataclass(frozen=True, slots=True)
class ModeView:
    """What a vehicle reports of its own modes and components."""

    safety_mode: str
    reasons: tuple[str, ...]
    component_status: dict[ComponentId, ComponentStatus]
    component_controller: dict[ComponentId, JausAddress | None]
    devices: DeviceReading


def lane_ahead(
    road: Road, snapshot: Snapshot, rows: IntColumn, motion: Motion, slots: IntColumn
) -> FloatMatrix:
    """Return centre-line points ahead in each vehicle's own frame, shape ``(n, len(PREVIEW_M), 2)``.

    Frame: x forward, y left, origin at the rear axle.
    """
    lane = np.repeat(snapshot.lane[rows], PREVIEW_M.size)
    following = np.repeat(snapshot.next_lane[rows], PREVIEW_M.size)
    position = (snapshot.lane_position_m[rows][:, None] + PREVIEW_M).ravel()
    points = road.points_ahead(lane, position, following)
    east = points.x_m.reshape(rows.size, -1) - motion.x_m[slots][:, None]
    north = points.y_m.reshape(rows.size, -1) - motion.y_m[slots][:, None]
    cosine = np.cos(motion.heading_rad[slots])[:, None]
    sine = np.sin(motion.heading_rad[slots])[:, None]
    return np.stack([cosine * east + sine * north, cosine * north - sine * east], axis=-1)


def leader_of(
    snapshot: Snapshot, rows: IntColumn, own_speed_mps: FloatColumn
) -> tuple[FloatColumn, FloatColumn]:
    """Return (gap, speed) of the leader of each row; ``inf`` and the own speed without a leader."""
    leader = snapshot.leader[rows]
    seen = leader >= 0
    speed = np.where(seen, snapshot.speed_mps[leader], own_speed_mps)
    return np.where(seen, snapshot.leader_gap_m[rows], np.inf), speed


def observe(
    snapshot: Snapshot,
    road: Road,
    motion: Motion,
    slots: IntColumn,
    vehicle_ids: Sequence[str],
    views: Sequence[ModeView],
) -> list[Observation]:
    """Return the observation of each bound vehicle in ``slots``.

    Args:
        snapshot: The world after the step.
        road: Lanes of the world.
        motion: The fleet's motion, as measured.
        slots: Slots to observe, shape ``(n,)``.
        vehicle_ids: Vehicle id of each slot, length n.
        views: Modes of each slot, length n.
    """
    if not len(slots):
        return []
    rows = np.array([snapshot.index_of[vehicle_id] for vehicle_id in vehicle_ids], np.int64)
    ahead = lane_ahead(road, snapshot, rows, motion, slots)
    gap, leader_speed = leader_of(snapshot, rows, motion.speed_mps[slots])
    on_road = snapshot.lane[rows] >= 0
    limit = np.where(on_road, road.lane_limit_mps(np.maximum(snapshot.lane[rows], 0)), np.inf)
    return [
        Observation(
            time_s=snapshot.time_s,
            vehicle_id=vehicle_id,
            x_m=float(motion.x_m[slot]),
            y_m=float(motion.y_m[slot]),
            heading_rad=float(motion.heading_rad[slot]),
            speed_mps=float(motion.speed_mps[slot]),
            accel_mps2=float(motion.accel_mps2[slot]),
            curvature_per_m=float(motion.curvature_per_m[slot]),
            limit_mps=float(limit[n]),
            lane_ahead_m=tuple((x, y) for x, y in ahead[n].tolist()) if on_road[n] else (),
            leader_gap_m=float(gap[n]),
            leader_speed_mps=float(leader_speed[n]),
            safety_mode=view.safety_mode,
            reasons=view.reasons,
            component_status=view.component_status,
            component_controller=view.component_controller,
            devices=view.devices,
        )
        for n, (slot, vehicle_id, view) in enumerate(zip(slots.tolist(), vehicle_ids, views, strict=True))
    ]
