"""The speed controller: from a speed reference to throttle and brake (XGV-06).

Feed-forward through the inverse of the car's force map, and a PI part for what the map does not know.
The demand is an acceleration; with road load and creep it becomes the acceleration that tyres have to
give, which is split between the two pedals. Because the pedals' own lags are known, each command
leads by so much that acceleration follows the demand with one short time constant, the *response*.
The speed therefore lags its reference by ``response * accel``; the error is taken against the speed
expected one response ahead, so that this lag is not corrected a second time by an overshoot.
"""

from __future__ import annotations

from xgv_cosim.controllers.limits import clipped
from xgv_cosim.jit import inlinable

RELEASED = 0.005
"""Share of effort below which a pedal counts as released."""
STANDSTILL_MPS = 0.05
"""Below this speed a stop is over and the holding effort acts (XGV-33)."""
STOP_FEEDBACK_SHARE = 0.04
"""Share of a controlled stop's deceleration that feedback may add or take: it stays constant (XGV-36)."""


@inlinable
def expected_speed_mps(speed_mps: float, accel_mps2: float, response_s: float) -> float:
    """Return the speed one response ahead, not beyond standstill: what the reference is compared with."""
    expected = speed_mps + response_s * accel_mps2
    return 0.0 if expected * speed_mps < 0.0 else expected


@inlinable
def speed_demand_mps2(
    error_mps: float,
    integral_m: float,
    reference_accel_mps2: float,
    gain_per_s: float,
    integral_gain_per_s2: float,
) -> float:
    """Return the acceleration demanded: ``a_ref + kp e + ki ∫e dt``."""
    return reference_accel_mps2 + gain_per_s * error_mps + integral_gain_per_s2 * integral_m


@inlinable
def stop_demand_mps2(error_mps: float, decel_mps2: float, gain_per_s: float) -> float:
    """Return the acceleration demanded during a controlled stop: ``-decel`` and little else (XGV-36)."""
    share = STOP_FEEDBACK_SHARE * decel_mps2
    return -decel_mps2 + clipped(gain_per_s * error_mps, -share, share)


@inlinable
def pedals(
    tyre_accel_mps2: float,
    throttle: float,
    brake: float,
    throttle_accel_mps2: float,
    full_throttle_accel_mps2: float,
    full_brake_decel_mps2: float,
    throttle_dead_band: float,
    band_mps2: float,
) -> tuple[float, float]:
    """Return the throttle and brake shares that give the tyres an acceleration, not yet limited to 1.

    Only one pedal is pressed at a time. With one pedal in effect the other is taken only when the
    demand exceeds the band, so that a demand near zero does not alternate between them.

    Args:
        tyre_accel_mps2: What throttle (positive) or brake (negative) have to give.
        throttle: Throttle in effect.
        brake: Brake effort in effect.
        throttle_accel_mps2: What the throttle in effect still gives: the brake makes up for it.
        full_throttle_accel_mps2: What full throttle would give at the present speed; 0 or less where the
            drive is off or in another gear: then only the brake acts.
        full_brake_decel_mps2: What full brake effort gives.
        throttle_dead_band: Throttle share without effect.
        band_mps2: Width of the hysteresis.
    """
    if tyre_accel_mps2 > 0.0:
        if full_throttle_accel_mps2 <= 0.0 or (brake > RELEASED and tyre_accel_mps2 < band_mps2):
            return 0.0, 0.0
        share = tyre_accel_mps2 / full_throttle_accel_mps2
        return throttle_dead_band + (1.0 - throttle_dead_band) * share, 0.0
    if throttle > RELEASED and -tyre_accel_mps2 < band_mps2:
        return 0.0, 0.0
    return 0.0, max(0.0, throttle_accel_mps2 - tyre_accel_mps2) / full_brake_decel_mps2


@inlinable
def leading(wanted: float, present: float, lead: float) -> float:
    """Return the command, 0 to 1, for which an actuator moves towards ``wanted`` ``lead`` times as fast."""
    return clipped(present + lead * (wanted - present), 0.0, 1.0)


@inlinable
def advance_integral_m(
    integral_m: float,
    error_mps: float,
    tyre_accel_mps2: float,
    most_push_mps2: float,
    most_braking_mps2: float,
    dt: float,
) -> float:
    """Return the integral of the error, which waits while drive, brake or grip cannot give more.

    Args:
        integral_m: The integral so far.
        error_mps: Reference less speed, in the direction of motion like all others here.
        tyre_accel_mps2: What throttle (positive) or brake (negative) are asked to give.
        most_push_mps2: The most that the throttle can give, 0 without drive.
        most_braking_mps2: The most that the brake can give, as a positive number.
        dt: The tick, in seconds.
    """
    if (tyre_accel_mps2 >= most_push_mps2 and error_mps > 0.0) or (
        tyre_accel_mps2 <= -most_braking_mps2 and error_mps < 0.0
    ):
        return integral_m
    return integral_m + error_mps * dt
