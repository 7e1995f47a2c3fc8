"""Motion profiles in closed form: what ruckig's velocity interface answers, for one axis at a time.

A profile brings a quantity ``v`` (speed, or curvature) to a target in the least time, with its first
derivative ``a`` within ``-decel_limit .. accel_limit`` and its second within ``-jerk .. jerk``, and
``a = 0`` at the end. It has up to four phases: an acceleration beyond its limit is brought back to it
first; then rise at constant jerk, hold, fall. Following a profile tick by tick, each tick starting a
new one, gives the same motion as following one profile throughout.
"""

from __future__ import annotations

import math

from xgv_cosim.jit import inlinable


@inlinable
def advance_profile(
    speed: float,
    accel: float,
    target: float,
    accel_limit: float,
    decel_limit: float,
    jerk: float,
    dt: float,
) -> tuple[float, float]:
    """Return speed and acceleration after ``dt`` on the time-optimal profile to ``target``.

    Args:
        speed: Present value.
        accel: Its present derivative; with infinite jerk it is ignored, because it may jump.
        target: Value at the end of the profile.
        accel_limit: Greatest derivative, above 0.
        decel_limit: Greatest negative derivative as a positive number, above 0.
        jerk: Greatest second derivative, above 0; ``inf`` lets the derivative jump.
        dt: Time ahead, in seconds.
    """
    if speed == target and accel == 0.0:
        return target, 0.0
    if math.isinf(jerk):
        return _advance_constant_accel(speed, target, accel_limit, decel_limit, dt)
    return _advance_jerk_limited(speed, accel, target, accel_limit, decel_limit, jerk, dt)


@inlinable
def _advance_constant_accel(
    speed: float, target: float, accel_limit: float, decel_limit: float, dt: float
) -> tuple[float, float]:
    accel = accel_limit if target > speed else -decel_limit
    # The nanosecond keeps rounding from leaving a last tick with nothing to do.
    if abs(target - speed) <= abs(accel) * (dt + 1e-9):
        return target, 0.0
    return speed + accel * dt, accel


@inlinable
def _advance_jerk_limited(
    speed: float,
    accel: float,
    target: float,
    accel_limit: float,
    decel_limit: float,
    jerk: float,
    dt: float,
) -> tuple[float, float]:
    # Pre-phase: an acceleration beyond its limit is brought back to it, wherever the target is.
    if accel > accel_limit or accel < -decel_limit:
        back = accel_limit if accel > accel_limit else -decel_limit
        duration = abs(accel - back) / jerk
        slope = jerk if back > accel else -jerk
        if dt < duration:
            return speed + dt * (accel + 0.5 * slope * dt), accel + slope * dt
        speed += 0.5 * (accel + back) * duration
        accel = back
        dt -= duration
    # Where v would end if a went to 0 at once tells on which side the target lies.
    released = speed + accel * abs(accel) / (2.0 * jerk)
    sign, limit = (1.0, accel_limit) if target >= released else (-1.0, decel_limit)
    gain, start = sign * (target - speed), sign * accel
    # Rise from `start` to `peak` and fall to 0: gain = (peak² - start²) / 2j + peak² / 2j.
    peak = math.sqrt(max(0.0, jerk * gain + 0.5 * start * start))
    hold = 0.0
    if peak > limit:
        peak = limit
        hold = max(0.0, (gain - (2.0 * limit * limit - start * start) / (2.0 * jerk)) / limit)
    rise, fall = max(0.0, (peak - start) / jerk), peak / jerk
    if dt < rise:
        return speed + sign * dt * (start + 0.5 * jerk * dt), sign * (start + jerk * dt)
    remaining = rise + hold + fall - dt
    if remaining <= 0.0:
        return target, 0.0
    if remaining > fall:
        return target - sign * peak * (0.5 * fall + remaining - fall), sign * peak
    return target - sign * 0.5 * jerk * remaining * remaining, sign * jerk * remaining


@inlinable
def advance_speed_profile(
    speed: float,
    accel: float,
    target: float,
    accel_limit: float,
    decel_limit: float,
    jerk: float,
    dt: float,
) -> tuple[float, float]:
    """Return ``advance_profile`` with a stop at zero instead of passing through it by accident.

    A profile that starts with more deceleration than it can shed before zero would pass through it
    (0.3 m/s at -3 m/s² and 4 m/s³ dips to -0.8 m/s). A car stops there; from standstill it goes on to
    the target. Only a target of the other sign takes the speed through zero.
    """
    if not crosses_zero(speed, accel, target, jerk):
        return advance_profile(speed, accel, target, accel_limit, decel_limit, jerk, dt)
    distance, slope = abs(speed), abs(accel)
    standstill = (slope - math.sqrt(max(0.0, slope * slope - 2.0 * jerk * distance))) / jerk
    if dt < standstill:
        return advance_profile(speed, accel, target, accel_limit, decel_limit, jerk, dt)
    return advance_profile(0.0, 0.0, target, accel_limit, decel_limit, jerk, dt - standstill)


@inlinable
def crosses_zero(speed: float, accel: float, target: float, jerk: float) -> bool:
    """Return whether the profile passes through zero although the target asks for no other direction."""
    if math.isinf(jerk):
        return False
    undershoots = accel * accel > 2.0 * jerk * abs(speed)
    forward = speed >= 0.0 and target >= 0.0 and accel < 0.0
    backward = speed <= 0.0 and target <= 0.0 and accel > 0.0
    return undershoots and (forward or backward)
