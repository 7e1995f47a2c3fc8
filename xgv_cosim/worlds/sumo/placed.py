"""After the step: what SUMO made of the placement, and the bound vehicles' true speeds."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Collection

    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import Engine

REPORTED_TOLERANCE_MPS = 0.01
"""SUMO is told the true speed where its own differs by more."""


def as_placed(
    engine: Engine,
    snapshot: Snapshot,
    placement: Placement,
    before: Snapshot,
    in_lane_frame: Collection[str],
    step_s: float,
) -> Snapshot:
    """Return the snapshot as the plant has its vehicles: true speeds and headings, and placement errors.

    In the frame of a lane SUMO's speed is the mean of the step; reverse it does not know at all. SUMO is
    told the speed at the end of the step, so that its drivers see that one (measured: the next step is
    not disturbed by it).

    Args:
        engine: The open simulation, after the step.
        snapshot: As read after the step.
        placement: What was asked for.
        before: The world before the step.
        in_lane_frame: Who was written as speed and lateral position.
        step_s: World step.
    """
    if not placement.ids:
        return snapshot
    rows = np.array([snapshot.index_of.get(name, -1) for name in placement.ids], np.int64)
    here = rows >= 0
    driven = np.flatnonzero(here & placement.computer_speed)
    speed_mps, accel_mps2 = snapshot.speed_mps.copy(), snapshot.accel_mps2.copy()
    wrong_mps = np.abs(np.maximum(placement.speed_mps[driven], 0.0) - speed_mps[rows[driven]])
    for number in driven[wrong_mps > REPORTED_TOLERANCE_MPS].tolist():
        name, now_mps = placement.ids[number], float(placement.speed_mps[number])
        engine.vehicle.setPreviousSpeed(name, max(now_mps, 0.0))
        row_before = before.index_of.get(name)
        if row_before is not None:
            accel_mps2[rows[number]] = (now_mps - before.speed_mps[row_before]) / step_s
    speed_mps[rows[driven]] = placement.speed_mps[driven]
    heading_rad = snapshot.heading_rad.copy()  # in the frame of a lane SUMO has the lane's
    steered = np.flatnonzero(here & placement.computer_steering)
    heading_rad[rows[steered]] = placement.heading_rad[steered]
    errors = _errors(snapshot, placement, rows, in_lane_frame)
    return replace(
        snapshot,
        heading_rad=heading_rad,
        speed_mps=speed_mps,
        accel_mps2=accel_mps2,
        placement_error_m=errors.distance_m,
        placement_error_rad=errors.turned_rad,
        in_lane_frame=errors.in_lane_frame,
    )


class _Errors(NamedTuple):
    distance_m: FloatColumn
    turned_rad: FloatColumn
    in_lane_frame: BoolColumn


def _errors(
    snapshot: Snapshot, placement: Placement, rows: IntColumn, in_lane_frame: Collection[str]
) -> _Errors:
    """Return how far SUMO's poses are from the plant's; 0 for those that a driver of SUMO's moves."""
    n = len(snapshot.ids)
    errors = _Errors(np.zeros(n), np.zeros(n), np.zeros(n, np.bool_))
    at = np.flatnonzero((rows >= 0) & placement.computer_speed & placement.computer_steering)
    rows = rows[at]
    errors.distance_m[rows] = np.hypot(
        snapshot.front_x_m[rows] - placement.front_x_m[at], snapshot.front_y_m[rows] - placement.front_y_m[at]
    )
    turned_rad = snapshot.heading_rad[rows] - placement.heading_rad[at]
    errors.turned_rad[rows] = np.abs(np.remainder(turned_rad + np.pi, 2.0 * np.pi) - np.pi)
    errors.in_lane_frame[rows] = [placement.ids[number] in in_lane_frame for number in at.tolist()]
    return errors
