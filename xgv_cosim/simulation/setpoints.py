"""Axis modes and commands become setpoints; references start from the measured state on entry."""

from __future__ import annotations

import numpy as np

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.columns import BoolColumn
from xgv_cosim.commands import CommandKind
from xgv_cosim.fleet import Fleet, Motion, Reference, Setpoints


def setpoints_of(fleet: Fleet) -> Setpoints:
    """Return what each axis has to do, from the axis modes and the command in force.

    A commanded limit of exactly 0 holds that axis at its present reference (XGV-70): controllers and
    kernel know it. Closed-loop steering without a live command stays where it is, or goes straight
    (XGV-35).
    """
    command, reference, limits = fleet.command, fleet.reference, fleet.parameters
    follows_motion = command.kind == CommandKind.MOTION_PROFILE
    stopping = fleet.longitudinal == Longitudinal.CONTROLLED_STOP

    without = np.where(fleet.centres_without_command, 0.0, reference.curvature_per_m)
    curvature = np.clip(command.curvature_per_m, -limits.max_curvature_per_m, limits.max_curvature_per_m)
    rate = np.where(follows_motion, command.max_curvature_rate_per_m_s, limits.max_curvature_rate_per_m_s)
    return Setpoints(
        longitudinal=fleet.longitudinal,
        lateral=fleet.lateral,
        target_speed_mps=np.where(stopping, 0.0, command.speed_mps),
        accel_limit_mps2=command.max_accel_mps2,
        decel_limit_mps2=np.where(stopping, fleet.stop_decel_mps2, command.max_accel_mps2),
        jerk_limit_mps3=np.where(stopping, np.inf, limits.max_jerk_mps3),
        target_curvature_per_m=np.where(follows_motion, curvature, without),
        curvature_rate_limit_per_m_s=rate,
        curvature_jerk_limit_per_m_s2=limits.max_curvature_jerk_per_m_s2,
        throttle=command.throttle,
        brake=np.where(fleet.longitudinal == Longitudinal.OPEN_LOOP, command.brake, fleet.stop_hold_brake),
        steer_rad=command.steering * limits.max_steer_rad,
    )


def seeded_references(
    reference: Reference, motion: Motion, speed_entered: BoolColumn, steering_entered: BoolColumn
) -> Reference:
    """Return references that start from the measured state on axes whose mode has just changed (XGV-70)."""
    return Reference(
        speed_mps=np.where(speed_entered, motion.speed_mps, reference.speed_mps),
        accel_mps2=np.where(speed_entered, motion.accel_mps2, reference.accel_mps2),
        curvature_per_m=np.where(steering_entered, motion.curvature_per_m, reference.curvature_per_m),
        curvature_rate_per_m_s=np.where(steering_entered, 0.0, reference.curvature_rate_per_m_s),
    )
