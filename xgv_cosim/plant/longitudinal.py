"""Forces along the road and what they make of the speed, all as accelerations in m/s²."""

from __future__ import annotations

import math

from xgv_cosim.jit import inlinable
from xgv_cosim.parameters import GRAVITY_MPS2

SHORT_OF_LOCK_UP = 0.95
"""Share of the grip that maximum braking uses: an anti-lock controller's mean slip stays below the peak."""


@inlinable
def full_throttle_accel_mps2(
    speed_mps: float, max_force_n: float, max_power_w: float, mass_kg: float
) -> float:
    """Return what full throttle gives in either direction: ``min(F_max, P_max / |v|) / m``."""
    return min(max_force_n, max_power_w / max(abs(speed_mps), 0.1)) / mass_kg


@inlinable
def low_gear_share(speed_mps: float, cap_mps: float) -> float:
    """Return the share of the drive that low gear leaves: 1, fading to 0 over the last m/s to its cap."""
    return min(1.0, max(0.0, cap_mps - speed_mps))


@inlinable
def engine_braking_mps2(speed_mps: float, throttle: float, full_mps2: float, creep_speed_mps: float) -> float:
    """Return what low gear takes from a rolling car: less with throttle, nothing where the car creeps."""
    rolling = min(1.0, max(0.0, abs(speed_mps) / creep_speed_mps - 1.0))
    return full_mps2 * rolling * (1.0 - throttle)


@inlinable
def throttle_accel_mps2(throttle: float, full_mps2: float, dead_band: float) -> float:
    """Return what a throttle share gives: nothing within the dead band, then linear up to ``full_mps2``."""
    return full_mps2 * max(0.0, throttle - dead_band) / (1.0 - dead_band)


@inlinable
def creep_accel_mps2(speed_mps: float, creep_mps2: float, creep_speed_mps: float) -> float:
    """Return the push of the idling drive in gear, fading to 0 at the creep speed.

    Args:
        speed_mps: Speed in the direction of the gear; below 0 the car rolls against it.
        creep_mps2: The push at standstill.
        creep_speed_mps: Where it has faded to nothing.
    """
    return creep_mps2 * min(1.0, max(0.0, 1.0 - speed_mps / creep_speed_mps))


@inlinable
def road_load_mps2(
    speed_mps: float,
    mass_kg: float,
    rolling_mps2: float,
    drag_area_m2: float,
    air_density_kg_per_m3: float,
) -> float:
    """Return rolling resistance and drag: ``c_rr g + rho c_d A v² / 2m``."""
    return rolling_mps2 + 0.5 * air_density_kg_per_m3 * drag_area_m2 * speed_mps * speed_mps / mass_kg


@inlinable
def slope_mps2(grade: float) -> float:
    """Return what a grade pulls backwards: ``g sin(atan(grade))``, positive uphill."""
    return GRAVITY_MPS2 * grade / math.sqrt(1.0 + grade * grade)


@inlinable
def normal_mps2(grade: float) -> float:
    """Return what presses the tyres onto the road per mass: ``g cos(atan(grade))``."""
    return GRAVITY_MPS2 / math.sqrt(1.0 + grade * grade)


@inlinable
def brake_decel_mps2(
    brake: float, max_decel_mps2: float, parking_brake_mps2: float, grip_mps2: float
) -> float:
    """Return what a brake share, linear, and the parking brake give, up to the grip of the tyres."""
    return min(brake * max_decel_mps2 + parking_brake_mps2, grip_mps2)


@inlinable
def parking_brake_mps2(is_set: bool, decel_mps2: float, grip_mps2: float) -> float:
    """Return what the parking brake takes from a car, up to the grip of the tyres.

    It is a mechanism of its own: neither engine nor hydraulics nor their errors change it (XGV-60).
    """
    return min(decel_mps2, grip_mps2) if is_set else 0.0


@inlinable
def maximum_braking_share(lateral_accel_mps2: float, max_decel_mps2: float, grip_mps2: float) -> float:
    """Return the brake share at the friction circle, short of lock-up (GKC-24)."""
    grip = SHORT_OF_LOCK_UP * grip_mps2
    along = math.sqrt(max(0.0, grip * grip - lateral_accel_mps2 * lateral_accel_mps2))
    return min(1.0, along / max_decel_mps2)


@inlinable
def advance_speed(
    speed_mps: float, push_mps2: float, resistance_mps2: float, dt: float
) -> tuple[float, float, float]:
    """Return speed, mean acceleration and distance after a tick of constant push and resistance.

    Resistance (brake and road load) acts against motion only: it brings the car to exactly 0 within
    the tick and holds it there as long as the push does not exceed it. A car that comes to 0 stands
    for the rest of the tick, whatever the push.

    Args:
        speed_mps: Present speed, negative backwards.
        push_mps2: Drive and slope, signed like the speed.
        resistance_mps2: Brake and road load, 0 or more.
        dt: The tick, in seconds.
    """
    if speed_mps == 0.0:
        if abs(push_mps2) <= resistance_mps2:
            return 0.0, 0.0, 0.0
        accel = push_mps2 - math.copysign(resistance_mps2, push_mps2)
        return accel * dt, accel, 0.5 * accel * dt * dt
    accel = push_mps2 - math.copysign(resistance_mps2, speed_mps)
    after = speed_mps + accel * dt
    if (speed_mps > 0.0 and after <= 0.0) or (speed_mps < 0.0 and after >= 0.0):
        return 0.0, -speed_mps / dt, -0.5 * speed_mps * speed_mps / accel
    return after, accel, 0.5 * (speed_mps + after) * dt
