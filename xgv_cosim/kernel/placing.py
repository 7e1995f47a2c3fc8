"""Between the plant's rear axle and the world's front bumper, slot by slot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.jit import inlinable
from xgv_cosim.kernel.vehicle import vehicle_of

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, BoolMatrix, FloatMatrix, IntColumn, UInt8Column

SHORTEST_ARC_M = 0.2
"""Below this the change of heading of one step says nothing about curvature."""


def own_in_place(
    speed: BoolColumn, steering: BoolColumn, longitudinal: UInt8Column, lateral: UInt8Column
) -> None:
    """Mark the axes that are not the world's driver's now."""
    for slot in range(speed.shape[0]):
        speed[slot] = speed[slot] or longitudinal[slot] != Longitudinal.DRIVER
        steering[slot] = steering[slot] or lateral[slot] != Lateral.DRIVER


def place_in_place(
    placed: FloatMatrix,
    owned: BoolMatrix,
    slots: IntColumn,
    motion: FloatMatrix,
    parameters: FloatMatrix,
    speed: BoolColumn,
    steering: BoolColumn,
) -> None:
    """Write where the plant puts some slots, see ``worlds.base.Placement``.

    Args:
        placed: Shape ``(5, n)``: front x and y, heading, speed, distance travelled; written.
        owned: Shape ``(2, n)``: owners of speed and steering; written.
        slots: Which, shape ``(n,)``.
        motion: As in ``fleet.MotionTable``.
        parameters: As in ``parameters.ParameterTable``.
        speed: Over all slots: the plant has the speed.
        steering: Over all slots: likewise.
    """
    for index in range(slots.shape[0]):
        slot = slots[index]
        vehicle, heading = vehicle_of(parameters, slot), motion[slot, 2]
        reach = vehicle.wheelbase_m + vehicle.front_overhang_m
        placed[0, index] = motion[slot, 0] + reach * math.cos(heading)
        placed[1, index] = motion[slot, 1] + reach * math.sin(heading)
        placed[2, index], placed[3, index], placed[4, index] = heading, motion[slot, 3], motion[slot, 10]
        owned[0, index], owned[1, index] = speed[slot], steering[slot]


def adopt_in_place(
    motion: FloatMatrix,
    before: FloatMatrix,
    parameters: FloatMatrix,
    slots: IntColumn,
    speed: BoolColumn,
    steering: BoolColumn,
    seen: FloatMatrix,
) -> None:
    """Write into the motion what the world moved itself, see ``simulation.exchange.adopt``.

    Args:
        motion: After the plant, as in ``fleet.MotionTable``; written.
        before: At the start of the step, likewise.
        parameters: As in ``parameters.ParameterTable``.
        slots: Who takes something back, shape ``(n,)``.
        speed: Over all slots: the plant has the speed.
        steering: Over all slots: likewise.
        seen: Shape ``(5, n)``, from the world: front x and y, the heading that a steered car gets, and speed
            and acceleration of one that is driven.
    """
    for index in range(slots.shape[0]):
        slot = slots[index]
        row, vehicle = motion[slot], vehicle_of(parameters, slot)
        drives, steers = not speed[slot], not steering[slot]
        if steers:
            row[2] = seen[2, index]
        if drives:
            row[3], row[4], row[9] = seen[3, index], seen[4, index], 0.0
        reach, cosine, sine = (
            vehicle.wheelbase_m + vehicle.front_overhang_m,
            math.cos(row[2]),
            math.sin(row[2]),
        )
        row[0], row[1] = seen[0, index] - reach * cosine, seen[1, index] - reach * sine
        if drives:
            row[10] = (row[0] - before[slot, 0]) * cosine + (row[1] - before[slot, 1]) * sine
        if steers:
            row[5] = _driven_curvature(row[2] - before[slot, 2], row[10])
            understeer = vehicle.understeer_rad_s2_per_m * row[3] * row[3]
            # The angle that the plant's steady state gives this curvature, as closed loop will take it over.
            row[6] = math.atan(row[5] * (vehicle.wheelbase_m + understeer))


@inlinable
def _driven_curvature(turned_rad: float, travelled_m: float) -> float:
    """Return the mean curvature of the step from its change of heading; 0 where the car hardly moved."""
    if abs(travelled_m) <= SHORTEST_ARC_M:
        return 0.0
    return ((turned_rad + math.pi) % (2.0 * math.pi) - math.pi) / travelled_m
