"""What a stop can reach, so that nobody takes what is set, or full brake, for the real one (XGV-36)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.columns import BoolColumn, FloatColumn, UInt8Column
from xgv_cosim.fleet import Fleet
from xgv_cosim.parameters import GRAVITY_MPS2

TOLERANCE = 0.05
"""A stop brakes as it is to if it is no further from that than this share."""
_FULL_BRAKE = (Longitudinal.FULL_BRAKE, Longitudinal.MAXIMUM_BRAKING)


class Reach(NamedTuple):
    """The hardest braking of each slot as it rolls out; every column has shape ``(num_slots,)``."""

    decel_mps2: FloatColumn
    """With rolling resistance and slope; without drag, which fades with the speed, and without creep."""
    is_grip: BoolColumn
    """True: the grip of the tyres limits it. False: the brake does."""
    brakes_mps2: FloatColumn
    """What tyres and brake give of it."""
    full_brakes_mps2: FloatColumn
    """What they would give at full effort with the engine's assistance."""


def reach_of(fleet: Fleet) -> Reach:
    """Return how hard each vehicle can brake on its road, with the engine as it is.

    A frozen controller brakes with the effort that it holds and no other (XGV-67).
    """
    car = fleet.parameters
    steepness = np.hypot(1.0, car.grade)
    authority = np.where(fleet.engine_on, 1.0, fleet.brake_share_without_engine)
    effort = np.where(fleet.frozen, fleet.held.brake, 1.0)
    brake, grip = car.max_brake_decel_mps2 * authority * effort, car.friction * GRAVITY_MPS2 / steepness
    uphill = np.copysign(1.0, fleet.motion.speed_mps) * car.grade
    road = GRAVITY_MPS2 * (car.rolling_resistance + uphill) / steepness
    brakes = np.minimum(brake, grip)
    return Reach(brakes + road, grip < brake, brakes, np.minimum(car.max_brake_decel_mps2, grip))


def governed_by(fleet: Fleet) -> UInt8Column:
    """Return who governs speed; where a frozen controller holds it, who did when it froze (XGV-67)."""
    held = fleet.frozen & (fleet.longitudinal == Longitudinal.OPEN_LOOP)
    return np.where(held, fleet.held.governed, fleet.longitudinal)


def is_full_brake(governed: UInt8Column) -> BoolColumn:
    """Return where the brake is to be pressed fully."""
    full: BoolColumn = np.isin(governed, _FULL_BRAKE)
    return full


def is_weaker_than_set(fleet: Fleet, reach: Reach) -> BoolColumn:
    """Return which vehicles roll in a pause whose set deceleration is out of reach."""
    rolls = (governed_by(fleet) == Longitudinal.CONTROLLED_STOP) & (fleet.motion.speed_mps != 0.0)
    weaker: BoolColumn = rolls & (reach.decel_mps2 < (1.0 - TOLERANCE) * fleet.stop_decel_mps2)
    return weaker


def is_weaker_than_full(fleet: Fleet, reach: Reach) -> BoolColumn:
    """Return which vehicles roll in a disable whose brake does not give what full brake does (XGV-31)."""
    rolls = is_full_brake(governed_by(fleet)) & (fleet.motion.speed_mps != 0.0)
    weaker: BoolColumn = rolls & (reach.brakes_mps2 < (1.0 - TOLERANCE) * reach.full_brakes_mps2)
    return weaker


def why_weaker_than_full(fleet: Fleet, reach: Reach, slot: int) -> str:
    """Return what the disable of a slot can reach, and what limits it."""
    what = "what the frozen controller holds" if fleet.frozen[slot] else "a brake without assistance"
    full, brakes = float(reach.full_brakes_mps2[slot]), float(reach.brakes_mps2[slot])
    return f"full brake gives {full:.2f} m/s² here, but {what} gives {brakes:.2f} m/s²"


def why_weaker(fleet: Fleet, reach: Reach, slot: int) -> str:
    """Return what the pause of a slot can reach, and what limits it."""
    if fleet.frozen[slot]:
        held, set_to = float(reach.decel_mps2[slot]), float(fleet.stop_decel_mps2[slot])
        return f"set to {set_to:.2f} m/s², but the frozen controller holds a brake that gives {held:.2f} m/s²"
    limit = "grip" if reach.is_grip[slot] else "brake"
    decel, wanted = float(reach.decel_mps2[slot]), float(fleet.stop_decel_mps2[slot])
    if decel <= 0.0:
        return f"set to {wanted:.2f} m/s², but on this slope the {limit} does not stop it at all"
    return f"set to {wanted:.2f} m/s², but on this road the {limit} allows {decel:.2f} m/s²"
