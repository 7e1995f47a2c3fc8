"""The rules of ``modes.py`` tabulated over every input, and looked up with the fleet's columns."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from xgv_cosim.columns import BoolColumn, IntColumn, UInt8Column
from xgv_cosim.commands import CommandKind
from xgv_cosim.vehicles.base import ModeInputs, Resolution
from xgv_cosim.vehicles.xgv.modes import (
    DEVICE_WORDS,
    MANUAL_SPEED,
    MANUAL_STEERING,
    PAUSES,
    STEERING_NOT_READY,
    is_driver_engaged,
    is_run_state,
    is_software_ready,
    is_stop_demanded,
    resolve_lateral,
    resolve_longitudinal,
    resolve_safety_mode,
)
from xgv_cosim.vehicles.xgv.settings import PauseSteering

SAFETY_MODE_TABLE = np.array(
    [
        [resolve_safety_mode(devices, software_ready=ready) for devices in range(DEVICE_WORDS)]
        for ready in (False, True)
    ],
    np.uint8,
)
"""Safety mode by (software ready, device word), shape ``(2, 2048)``."""

SOFTWARE_READY_TABLE = np.array(
    [[is_software_ready(control, ready) for ready in ReadyMode] for control in ControlMode], np.bool_
)
"""Whether neither mode is software pause, by (control mode, ready mode)."""

_SHAPE = (max(SafetyMode) + 1, len(ControlMode), len(CommandKind), (MANUAL_STEERING | MANUAL_SPEED) + 1, 2)


class AxisTables(NamedTuple):
    """Axis control by (safety mode, control mode, command kind, partial mode, steering initialised)."""

    longitudinal: UInt8Column
    lateral: UInt8Column
    speed_engaged: BoolColumn
    steering_engaged: BoolColumn
    in_run_state: BoolColumn


def _build_axis_tables(without_command: PauseSteering) -> AxisTables:
    tables = AxisTables(
        np.zeros(_SHAPE, np.uint8),
        np.zeros(_SHAPE, np.uint8),
        np.zeros(_SHAPE, np.bool_),
        np.zeros(_SHAPE, np.bool_),
        np.zeros(_SHAPE, np.bool_),
    )
    for safety, control, kind, partial, initialised in product(
        SafetyMode, ControlMode, CommandKind, range(_SHAPE[3]), (False, True)
    ):
        cell = (safety, control, kind, partial, int(initialised))
        tables.longitudinal[cell] = resolve_longitudinal(safety, control, kind, partial)
        tables.lateral[cell] = resolve_lateral(
            safety, control, kind, partial, steering_initialised=initialised, without_command=without_command
        )
        tables.speed_engaged[cell] = is_driver_engaged(safety, partial, MANUAL_SPEED)
        tables.steering_engaged[cell] = is_driver_engaged(safety, partial, MANUAL_STEERING)
        tables.in_run_state[cell] = is_run_state(safety, control, kind)
    return tables


AXIS_TABLES = {steering: _build_axis_tables(steering) for steering in PauseSteering}
"""One set of tables for each reading of XGV-35."""

STOP_DEMANDED_TABLE = np.zeros(_SHAPE[0], np.bool_)
PAUSING_TABLE = np.zeros(_SHAPE[0], np.bool_)
for _mode in SafetyMode:
    STOP_DEMANDED_TABLE[_mode] = is_stop_demanded(_mode)
    PAUSING_TABLE[_mode] = _mode in PAUSES


def resolve(inputs: ModeInputs, without_command: PauseSteering) -> Resolution:
    """Return modes and axis control of all slots, by look-up.

    A slot whose control mode is unknown (0) belongs to a system that is not active (XGV-32).
    """
    devices = inputs.safety_devices & (DEVICE_WORDS - 1)
    software_ready = SOFTWARE_READY_TABLE[inputs.control_mode, inputs.ready_mode].astype(np.intp)
    active = inputs.control_mode != ControlMode.UNKNOWN
    safety_mode = np.where(active, SAFETY_MODE_TABLE[software_ready, devices], np.uint8(SafetyMode.INACTIVE))
    initialised: IntColumn = (devices & STEERING_NOT_READY == 0).astype(np.int64)
    cells = (safety_mode, inputs.control_mode, inputs.command_kind, inputs.partial_mode, initialised)
    tables = AXIS_TABLES[without_command]
    return Resolution(
        safety_mode=safety_mode,
        longitudinal=tables.longitudinal[cells],
        lateral=tables.lateral[cells],
        speed_engaged=tables.speed_engaged[cells],
        steering_engaged=tables.steering_engaged[cells],
        in_run_state=tables.in_run_state[cells],
        stop_demanded=STOP_DEMANDED_TABLE[safety_mode],
        pausing=PAUSING_TABLE[safety_mode],
    )
