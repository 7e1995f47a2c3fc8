"""What one slot has to do in a step, checked and clipped once, before its ticks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from xgv_cosim.actuation import Lateral, Longitudinal, LostFunction
from xgv_cosim.controllers.limits import (
    MAX_ACCEL_MPS2,
    MAX_CURVATURE_PER_M,
    MAX_CURVATURE_RATE_PER_M_S,
    MAX_SPEED_MPS,
    MIN_ACCEL_MPS2,
    MIN_CURVATURE_RATE_PER_M_S,
    are_usable,
    clipped,
    clipped_jerk,
    stop_decel_mps2,
)
from xgv_cosim.jit import inlinable

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatMatrix, UInt8Matrix


_BRAKE, _STEERING = int(LostFunction.BRAKE), int(LostFunction.STEERING)
_THROTTLE, _SPEED_FEEDBACK = int(LostFunction.THROTTLE), int(LostFunction.SPEED_FEEDBACK)


class Profile(NamedTuple):
    """The command of an axis that follows a profile."""

    target: float
    rise_limit: float
    fall_limit: float
    jerk: float
    is_held: bool
    """The reference stays as it is: a limit is 0 (XGV-70), or the command is not usable."""


class Orders(NamedTuple):
    """The setpoints of one slot."""

    longitudinal: int
    """``actuation.Longitudinal``."""
    lateral: int
    """``actuation.Lateral``."""
    follows_speed: bool
    follows_curvature: bool
    speed: Profile
    curvature: Profile
    throttle: float
    """Share, 0 to 1."""
    brake: float
    """Share, 0 to 1."""
    steer_rad: float
    """NaN where it is not usable."""
    gear_wanted: int
    """``actuation.Gear``."""
    engine_on: bool
    has_parking_brake: bool
    """It is set (XGV-60)."""
    brake_authority: float
    """Share, 0 to 1."""
    has_brake: bool
    """False, here and below: an error has taken the function away (XGV-38)."""
    has_steering: bool
    has_throttle: bool
    has_speed_feedback: bool


@inlinable
def orders_of(numbers: FloatMatrix, codes: UInt8Matrix, slot: int) -> Orders:
    """Return the orders of a slot; bad numbers become a held reference, a released pedal, a still wheel.

    Args:
        numbers: As in ``fleet.SetpointTables``.
        codes: Likewise.
        slot: Whose orders.
    """
    speed_mps, rise, fall, jerk, curvature, rate, rate_jerk, throttle, brake, steer, authority = _row(
        numbers, slot
    )
    longitudinal, lateral, gear, engine_on = codes[slot, 0], codes[slot, 1], codes[slot, 2], codes[slot, 3]
    parking_brake, lost = codes[slot, 4], int(codes[slot, 5])
    is_stopping = longitudinal == Longitudinal.CONTROLLED_STOP
    return Orders(
        int(longitudinal),
        int(lateral),
        longitudinal == Longitudinal.CLOSED_LOOP or is_stopping,
        lateral == Lateral.CLOSED_LOOP,
        _stop_profile(fall)
        if is_stopping
        else _profile(speed_mps, rise, fall, jerk, MAX_SPEED_MPS, MIN_ACCEL_MPS2, MAX_ACCEL_MPS2),
        _profile(
            curvature,
            rate,
            rate,
            rate_jerk,
            MAX_CURVATURE_PER_M,
            MIN_CURVATURE_RATE_PER_M_S,
            MAX_CURVATURE_RATE_PER_M_S,
        ),
        _effort(throttle),
        _effort(brake),
        steer if math.isfinite(steer) else math.nan,
        int(gear),
        bool(engine_on),
        bool(parking_brake),
        clipped(authority, 0.0, 1.0) if math.isfinite(authority) else 1.0,
        lost & _BRAKE == 0,
        lost & _STEERING == 0,
        lost & _THROTTLE == 0,
        lost & _SPEED_FEEDBACK == 0,
    )


@inlinable
def _row(numbers: FloatMatrix, slot: int) -> tuple[float, ...]:
    row = numbers[slot]
    return row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9], row[10]


@inlinable
def _stop_profile(decel_limit_mps2: float) -> Profile:
    decel = stop_decel_mps2(decel_limit_mps2)
    return Profile(0.0, decel, decel, math.inf, False)


@inlinable
def _profile(
    target: float, rise: float, fall: float, jerk: float, farthest: float, lowest: float, highest: float
) -> Profile:
    is_held = rise == 0.0 or fall == 0.0 or not are_usable(target, rise, fall, jerk)
    return Profile(
        clipped(target, -farthest, farthest),
        clipped(rise, lowest, highest),
        clipped(fall, lowest, highest),
        clipped_jerk(jerk),
        is_held,
    )


@inlinable
def _effort(share: float) -> float:
    return clipped(share, 0.0, 1.0) if math.isfinite(share) else 0.0
