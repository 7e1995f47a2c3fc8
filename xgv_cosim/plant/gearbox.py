"""The gear selector: which way each gear drives, and how a gear changes (XGV-04, XGV-70)."""

from __future__ import annotations

from xgv_cosim.actuation import Gear
from xgv_cosim.jit import inlinable

PARK_LOCK_MPS2 = 20.0
"""What the parking pawl holds, as an acceleration: more than any road's slope."""
_ROUNDING_S = 1e-9
_DRIVE, _REVERSE = int(Gear.DRIVE), int(Gear.REVERSE)


@inlinable
def gear_direction(gear: int) -> float:
    """Return 1 for a gear that drives forward, -1 for reverse, 0 for park and neutral."""
    if gear == Gear.REVERSE:
        return -1.0
    return 0.0 if gear == Gear.PARK or gear == Gear.NEUTRAL else 1.0  # noqa: PLR1714 - compiled


@inlinable
def advance_shift(
    gear: int,
    shift_s: float,
    wanted: int,
    is_braked_standstill: bool,
    standstill_s: float,
    delay_s: float,
    dt: float,
) -> tuple[int, float]:
    """Return gear and time of the change under way after a tick (XGV-70).

    The car has to stand, braked, for ``standstill_s``; then the selector takes ``delay_s``. A car that
    moves or is released meanwhile begins anew.

    Args:
        gear: ``actuation.Gear`` in effect.
        shift_s: How long the change has been under way.
        wanted: ``actuation.Gear`` to which the selector is to go.
        is_braked_standstill: The car stands and the brake is pressed.
        standstill_s: Time at standstill before the selector moves.
        delay_s: Time that the selector takes.
        dt: The tick, in seconds.
    """
    if wanted == gear or not is_braked_standstill:
        return gear, 0.0
    shift_s += dt
    if shift_s >= standstill_s + delay_s - _ROUNDING_S:
        return wanted, 0.0
    return gear, shift_s


@inlinable
def is_between_gears(shift_s: float, standstill_s: float) -> bool:
    """Return whether the selector moves, so that no gear is engaged."""
    return shift_s > standstill_s + _ROUNDING_S


@inlinable
def gear_under_driver(gear: int, speed_mps: float, standstill_mps: float) -> int:
    """Return the gear that the world's driver must have selected to drive as he does."""
    if speed_mps > standstill_mps and gear_direction(gear) <= 0.0:
        return _DRIVE
    if speed_mps < -standstill_mps and gear_direction(gear) >= 0.0:
        return _REVERSE
    return gear
