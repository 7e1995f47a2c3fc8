"""Modes of the whole fleet: each profile's tables, then who takes the axes that were released."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from xgv_cosim import kernel
from xgv_cosim.actuation import Driver, Lateral, Longitudinal, LostFunction
from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn, UInt8Column, WordMatrix
from xgv_cosim.fleet import Fleet
from xgv_cosim.fleet_columns import HeldOutputs, motion_table
from xgv_cosim.parameters import parameter_table
from xgv_cosim.vehicles.base import ModeInputs, Resolution, VehicleProfile


class AxisModes(NamedTuple):
    """Modes of each slot with the driver in them; every column has shape ``(num_slots,)``."""

    safety_mode: UInt8Column
    longitudinal: UInt8Column
    lateral: UInt8Column
    speed_released_s: FloatColumn
    steering_released_s: FloatColumn
    handed_over: BoolColumn


def has_changed(fleet: Fleet, seen: WordMatrix, now_s: float) -> bool:
    """Return whether modes and reports may be others than when ``seen`` was written, and write it.

    Not in it is what changes only with a call that touches the vehicle (``alarms``).
    """
    command = fleet.command
    return kernel.note_inputs(
        seen,
        motion_table(fleet.motion),
        parameter_table(fleet.parameters),
        fleet.safety_devices,
        fleet.control_mode,
        fleet.ready_mode,
        fleet.safety_mode,
        fleet.partial_mode,
        command.kind,
        fleet.lost_functions,
        fleet.longitudinal,
        fleet.lateral,
        fleet.gear_wanted,
        fleet.motion.gear,
        fleet.driver,
        fleet.frozen,
        fleet.handed_over,
        fleet.engine_on,
        fleet.parking_brake,
        command.speed_mps,
        command.throttle,
        command.brake,
        fleet.driver_reaction_s,
        fleet.speed_released_s,
        fleet.steering_released_s,
        now_s,
    )


def resolve(fleet: Fleet, groups: Sequence[tuple[VehicleProfile, IntColumn]]) -> Resolution:
    """Return every profile's answer, scattered over the slots; free slots keep what they have.

    Of a frozen controller only the devices act that need no software; else it holds what it put out
    last (XGV-67). A steering that an error has taken away is nobody's, whoever should have it (XGV-38).
    """
    answer = Resolution(
        safety_mode=fleet.safety_mode.copy(),
        longitudinal=fleet.longitudinal.copy(),
        lateral=fleet.lateral.copy(),
        speed_engaged=np.zeros(fleet.num_slots, np.bool_),
        steering_engaged=np.zeros(fleet.num_slots, np.bool_),
        in_run_state=np.zeros(fleet.num_slots, np.bool_),
        stop_demanded=np.zeros(fleet.num_slots, np.bool_),
        pausing=np.zeros(fleet.num_slots, np.bool_),
    )
    devices = fleet.safety_devices.copy()
    for profile, slots in groups:
        by_hardware = np.uint16(profile.hardware_override_bits)
        devices[slots] &= np.where(fleet.frozen[slots], by_hardware, np.uint16(0xFFFF))
    inputs = ModeInputs(devices, fleet.control_mode, fleet.ready_mode, fleet.partial_mode, fleet.command.kind)
    for profile, slots in groups:
        part = profile.resolve(
            ModeInputs(
                inputs.safety_devices[slots],
                inputs.control_mode[slots],
                inputs.ready_mode[slots],
                inputs.partial_mode[slots],
                inputs.command_kind[slots],
            )
        )
        for whole, column in zip(answer, part, strict=True):
            whole[slots] = column
    held = fleet.frozen & (devices == 0)
    if held.any():
        answer = _holding(answer, fleet.held, held)
    lost = fleet.lost_functions & LostFunction.STEERING != 0
    return answer if not lost.any() else _without_steering(answer, lost)


def _holding(answer: Resolution, outputs: HeldOutputs, held: BoolColumn) -> Resolution:
    return Resolution(
        safety_mode=np.where(held, outputs.safety_mode, answer.safety_mode),
        longitudinal=np.where(held, outputs.longitudinal, answer.longitudinal),
        lateral=np.where(held, outputs.lateral, answer.lateral),
        speed_engaged=answer.speed_engaged & ~held,
        steering_engaged=answer.steering_engaged & ~held,
        in_run_state=answer.in_run_state & ~held,
        stop_demanded=answer.stop_demanded & ~held,
        pausing=answer.pausing & ~held,
    )


def _without_steering(answer: Resolution, lost: BoolColumn) -> Resolution:
    """Return the answer with the wheel released where its actuator does nothing more.

    As with steering that is not initialised (XGV-69) nobody has given it to the driver: a rider takes it
    after his reaction time. A lost brake releases nothing: pedals and gear stay the computer's, which has
    the throttle at 0, and the rider stays passive; the stop without effect is an event (XGV-38).
    """
    return answer._replace(lateral=np.where(lost, np.uint8(Lateral.FREE), answer.lateral))


def _released_since(released: BoolColumn, since_s: FloatColumn, now_s: float) -> FloatColumn:
    return np.where(released, np.minimum(since_s, now_s), np.inf)


def _has_driver(
    fleet: Fleet, engaged: BoolColumn, held: BoolColumn, since_s: FloatColumn, now_s: float
) -> BoolColumn:
    """Return where the driver has a released axis by now; who holds it already keeps it (XGV-64)."""
    reacted = engaged | held | (now_s - since_s >= fleet.driver_reaction_s - 1e-9)
    present: BoolColumn = (fleet.driver == Driver.WORLD) | ((fleet.driver == Driver.RIDER) & reacted)
    return present


def take_axes(fleet: Fleet, answer: Resolution, now_s: float) -> AxisModes:
    """Return the axis modes after the driver has taken what is his.

    Released axes go to the driver by ``bind.driver`` and his reaction time (XGV-64). Before the
    hand-over the world's driver keeps both axes; a live command in the run state ends that, and so
    does a stop that an emergency stop device demands: a stop demand is never without effect.
    """
    handed_over = fleet.handed_over | answer.in_run_state | answer.stop_demanded
    speed_released = answer.longitudinal == Longitudinal.FREE
    steering_released = answer.lateral == Lateral.FREE
    speed_since = _released_since(speed_released, fleet.speed_released_s, now_s)
    steering_since = _released_since(steering_released, fleet.steering_released_s, now_s)
    drove, steered = fleet.longitudinal == Longitudinal.DRIVER, fleet.lateral == Lateral.DRIVER
    drives = speed_released & _has_driver(fleet, answer.speed_engaged, drove, speed_since, now_s)
    steers = steering_released & _has_driver(fleet, answer.steering_engaged, steered, steering_since, now_s)
    bound = np.zeros(fleet.num_slots, np.bool_)
    bound[fleet.bound] = True
    waiting = bound & ~handed_over
    return AxisModes(
        safety_mode=answer.safety_mode,
        longitudinal=np.where(drives | waiting, np.uint8(Longitudinal.DRIVER), answer.longitudinal),
        lateral=np.where(steers | waiting, np.uint8(Lateral.DRIVER), answer.lateral),
        speed_released_s=speed_since,
        steering_released_s=steering_since,
        handed_over=handed_over,
    )


def next_take_over_s(fleet: Fleet) -> float:
    """Return when the next rider takes an axis that nobody has, ``inf`` if none will (XGV-64)."""
    return kernel.next_take_over(
        fleet.driver,
        fleet.driver_reaction_s,
        fleet.longitudinal,
        fleet.lateral,
        fleet.speed_released_s,
        fleet.steering_released_s,
    )
