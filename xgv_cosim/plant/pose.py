"""Where an arc leads: exact integration of the pose."""

from __future__ import annotations

import math

from xgv_cosim.jit import inlinable


@inlinable
def advance_pose(
    x_m: float, y_m: float, heading_rad: float, distance_m: float, curvature_per_m: float
) -> tuple[float, float, float]:
    """Return the pose at the end of a circular arc; frame east-north-up, rear axle.

    The chord of an arc of angle ``q`` points along ``heading + q/2`` and is ``s sin(q/2) / (q/2)`` long.
    """
    half = 0.5 * curvature_per_m * distance_m
    square = half * half
    if square < 1e-2:  # the series is exact to 1e-15 here; at 0 the quotient is not defined
        shortening = 1.0 - square / 6.0 * (
            1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0))
        )
    else:
        shortening = math.sin(half) / half
    chord_m = distance_m * shortening
    direction = heading_rad + half
    return x_m + chord_m * math.cos(direction), y_m + chord_m * math.sin(direction), heading_rad + 2.0 * half
