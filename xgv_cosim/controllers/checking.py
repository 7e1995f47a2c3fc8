"""Commands and references of many slots, checked and clipped for ruckig (see ``limits``)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.controllers.limits import (
    FALLBACK_STOP_DECEL_MPS2,
    MAX_ACCEL_MPS2,
    MAX_CURVATURE_PER_M,
    MAX_CURVATURE_RATE_PER_M_S,
    MAX_JERK,
    MAX_SPEED_MPS,
    MAX_STATE_ACCEL_MPS2,
    MAX_STATE_CURVATURE_PER_M,
    MAX_STATE_CURVATURE_RATE_PER_M_S,
    MAX_STATE_SPEED_MPS,
    MIN_ACCEL_MPS2,
    MIN_CURVATURE_RATE_PER_M_S,
    MIN_JERK,
)

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatMatrix
    from xgv_cosim.fleet import Reference, Setpoints

_MAX_VALUE = np.array([[MAX_STATE_SPEED_MPS], [MAX_STATE_CURVATURE_PER_M]])
_MAX_RATE = np.array([[MAX_STATE_ACCEL_MPS2], [MAX_STATE_CURVATURE_RATE_PER_M_S]])
_FARTHEST = np.array([[MAX_SPEED_MPS], [MAX_CURVATURE_PER_M]])
_LOWEST = np.array([[MIN_ACCEL_MPS2], [MIN_CURVATURE_RATE_PER_M_S]])
_HIGHEST = np.array([[MAX_ACCEL_MPS2], [MAX_CURVATURE_RATE_PER_M_S]])


class Profiles(NamedTuple):
    """Profiles that ruckig accepts; every array has shape ``(2, n)``: row 0 speed, row 1 curvature."""

    value: FloatMatrix
    rate: FloatMatrix
    target: FloatMatrix
    rise_limit: FloatMatrix
    fall_limit: FloatMatrix
    jerk: FloatMatrix


def profile_axes(setpoints: Setpoints) -> tuple[BoolColumn, BoolColumn]:
    """Return which slots follow a profile in speed, and which in curvature."""
    speed = (setpoints.longitudinal == Longitudinal.CLOSED_LOOP) | (
        setpoints.longitudinal == Longitudinal.CONTROLLED_STOP
    )
    return speed, setpoints.lateral == Lateral.CLOSED_LOOP


def checked_profiles(reference: Reference, setpoints: Setpoints) -> tuple[Profiles, BoolColumn]:
    """Return the profiles of all slots, and which slots have an unusable command or reference.

    An axis that follows no profile, is held by a limit of 0 (XGV-70) or is unusable rests where it is,
    or at 0 if that is no number. A controlled stop with an unusable deceleration takes the default.
    """
    stops = setpoints.longitudinal == Longitudinal.CONTROLLED_STOP
    decel = setpoints.decel_limit_mps2
    lacks_decel = stops & ~(np.isfinite(decel) & (decel > 0.0))
    decel = np.where(lacks_decel, FALLBACK_STOP_DECEL_MPS2, decel)
    value = np.array([reference.speed_mps, reference.curvature_per_m])
    rate = np.array([reference.accel_mps2, reference.curvature_rate_per_m_s])
    target = np.array([np.where(stops, 0.0, setpoints.target_speed_mps), setpoints.target_curvature_per_m])
    rise = np.array(
        [np.where(stops, decel, setpoints.accel_limit_mps2), setpoints.curvature_rate_limit_per_m_s]
    )
    fall = np.array([decel, setpoints.curvature_rate_limit_per_m_s])
    jerk = np.array(
        [np.where(stops, np.inf, setpoints.jerk_limit_mps3), setpoints.curvature_jerk_limit_per_m_s2]
    )

    governed = np.array(profile_axes(setpoints))
    known = (np.abs(value) <= _MAX_VALUE) & (np.abs(rate) <= _MAX_RATE)
    usable = known & np.isfinite(target) & (rise >= 0.0) & (fall >= 0.0) & (jerk >= 0.0)
    failed = (governed & ~usable).any(axis=0) | lacks_decel
    moving = governed & usable & (rise > 0.0) & (fall > 0.0)
    value = np.where(known, value, 0.0)
    jerk = np.where(np.isinf(jerk), jerk, np.clip(jerk, MIN_JERK, MAX_JERK))
    profiles = Profiles(
        value,
        np.where(moving, rate, 0.0),
        np.where(moving, np.clip(target, -_FARTHEST, _FARTHEST), value),
        np.where(moving, np.clip(rise, _LOWEST, _HIGHEST), 1.0),
        np.where(moving, np.clip(fall, _LOWEST, _HIGHEST), 1.0),
        np.where(moving, jerk, 1.0),
    )
    return profiles, failed


def crossing_slots(profiles: Profiles) -> BoolColumn:
    """Return the slots whose speed profile ``profile.crosses_zero`` concerns."""
    speed, accel, target = profiles.value[0], profiles.rate[0], profiles.target[0]
    is_limited = np.isfinite(profiles.jerk[0])
    jerk = np.where(is_limited, profiles.jerk[0], 0.0)
    undershoots = is_limited & (accel * accel > 2.0 * jerk * np.abs(speed))
    forward = (speed >= 0.0) & (target >= 0.0) & (accel < 0.0)
    backward = (speed <= 0.0) & (target <= 0.0) & (accel > 0.0)
    crossing: BoolColumn = undershoots & (forward | backward)
    return crossing


def with_speed_at_rest(profiles: Profiles, slots: BoolColumn) -> Profiles:
    """Return the profiles with the speed axis of some slots at rest at 0."""
    if not slots.any():
        return profiles
    resting = Profiles(*(column.copy() for column in profiles))
    for column, rest in zip(resting, (0.0, 0.0, 0.0, 1.0, 1.0, 1.0), strict=True):
        column[0, slots] = rest
    return resting
