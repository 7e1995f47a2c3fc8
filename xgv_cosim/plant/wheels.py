"""Speeds of the four wheels, as sensors at the wheels would report them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn
    from xgv_cosim.fleet_columns import Motion
    from xgv_cosim.parameters import ParameterColumns


class WheelSpeeds(NamedTuple):
    """Speed over ground of each wheel in m/s, negative backwards; every column has shape ``(n,)``."""

    front_left_mps: FloatColumn
    front_right_mps: FloatColumn
    rear_left_mps: FloatColumn
    rear_right_mps: FloatColumn


def wheel_speeds_mps(motion: Motion, parameters: ParameterColumns) -> WheelSpeeds:
    """Return the wheel speeds of a rigid car that rolls along its path without slip.

    With the yaw rate ``kappa v`` each rear wheel goes at ``v (1 -+ kappa t / 2)``; a front wheel, one
    wheelbase ahead, goes sideways at ``v kappa L`` besides. The rear axle is the reference point.
    """
    speed, curvature = motion.speed_mps, motion.curvature_per_m
    sideways = curvature * parameters.wheelbase_m
    front, rear = 0.5 * curvature * parameters.front_track_m, 0.5 * curvature * parameters.rear_track_m
    return WheelSpeeds(
        speed * np.hypot(1.0 - front, sideways),
        speed * np.hypot(1.0 + front, sideways),
        speed * (1.0 - rear),
        speed * (1.0 + rear),
    )
