"""What a pause can reach on its road, so that nobody takes the set deceleration for the real one (XGV-36)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.columns import BoolColumn, FloatColumn
from xgv_cosim.fleet import Fleet
from xgv_cosim.parameters import GRAVITY_MPS2

TOLERANCE = 0.05
"""A pause brakes as set if it is no further from the set value than this share."""


class Reach(NamedTuple):
    """The hardest braking of each slot as it rolls out; every column has shape ``(num_slots,)``."""

    decel_mps2: FloatColumn
    """With rolling resistance and slope; without drag, which fades with the speed, and without creep."""
    is_grip: BoolColumn
    """True: the grip of the tyres limits it. False: the brake does."""


def reach_of(fleet: Fleet) -> Reach:
    """Return how hard each vehicle can brake on its road, with the engine as it is."""
    car = fleet.parameters
    steepness = np.hypot(1.0, car.grade)
    authority = np.where(fleet.engine_on, 1.0, fleet.brake_share_without_engine)
    brake, grip = car.max_brake_decel_mps2 * authority, car.friction * GRAVITY_MPS2 / steepness
    uphill = np.copysign(1.0, fleet.motion.speed_mps) * car.grade
    road = GRAVITY_MPS2 * (car.rolling_resistance + uphill) / steepness
    return Reach(np.minimum(brake, grip) + road, grip < brake)


def is_weaker_than_set(fleet: Fleet, reach: Reach) -> BoolColumn:
    """Return which vehicles roll in a pause whose set deceleration is out of reach."""
    rolls = (fleet.longitudinal == Longitudinal.CONTROLLED_STOP) & (fleet.motion.speed_mps != 0.0)
    weaker: BoolColumn = rolls & (reach.decel_mps2 < (1.0 - TOLERANCE) * fleet.stop_decel_mps2)
    return weaker


def why_weaker(fleet: Fleet, reach: Reach, slot: int) -> str:
    """Return what the pause of a slot can reach, and what limits it."""
    limit = "grip" if reach.is_grip[slot] else "brake"
    decel, wanted = float(reach.decel_mps2[slot]), float(fleet.stop_decel_mps2[slot])
    if decel <= 0.0:
        return f"set to {wanted:.2f} m/s², but on this slope the {limit} does not stop it at all"
    return f"set to {wanted:.2f} m/s², but on this road the {limit} allows {decel:.2f} m/s²"
