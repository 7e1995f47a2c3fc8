"""Lags of throttle, brake and steering."""

from __future__ import annotations

import math

from xgv_cosim.jit import inlinable

SETTLED = 1e-6
"""Distance from its command at which an actuator counts as there, so that released means exactly 0."""


@inlinable
def lag_share(lag_s: float, dt: float) -> float:
    """Return the share ``1 - exp(-dt / lag)`` of its way that a first-order lag makes in ``dt``."""
    if lag_s <= 0.0:
        return 1.0
    return 1.0 - math.exp(-dt / lag_s)


@inlinable
def advance_pedal(present: float, command: float, share: float) -> float:
    """Return the effort in effect after a tick, for a command held over it."""
    difference = command - present
    if abs(difference) < SETTLED:
        return command
    return present + share * difference


@inlinable
def taken_up_rad(steer_rad: float, command_rad: float, backlash_rad: float) -> float:
    """Return where a command leads a wheel with play in its linkage: nowhere until the play is taken up."""
    half = 0.5 * backlash_rad
    return min(command_rad + half, max(command_rad - half, steer_rad))


@inlinable
def advance_steer_rad(
    steer_rad: float, command_rad: float, share: float, max_rate_rad_s: float, max_steer_rad: float, dt: float
) -> float:
    """Return the road-wheel angle after a tick: first-order lag within the actuator's rate and stops."""
    limit = max_rate_rad_s * dt
    steer_rad += min(limit, max(-limit, share * (command_rad - steer_rad)))
    return min(max_steer_rad, max(-max_steer_rad, steer_rad))


@inlinable
def advance_released_steer_rad(
    steer_rad: float, speed_mps: float, self_align_distance_m: float, max_rate_rad_s: float, dt: float
) -> float:
    """Return the angle of a released wheel after a tick: caster turns it back as the car rolls (XGV-64)."""
    limit = max_rate_rad_s * dt
    back = steer_rad * (1.0 - math.exp(-abs(speed_mps) * dt / self_align_distance_m))
    return steer_rad - min(limit, max(-limit, back))
