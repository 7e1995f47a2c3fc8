"""The columns of ``trajectory.parquet``: name, unit, quantum, meaning. The one place that lists them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.columns import FloatColumn, IntColumn

TRAJECTORY_SCHEMA: Final = "xgv-cosim/trajectory/1"

NULL: Final = np.iinfo(np.int32).min
"""Stands for "no value" in the buffers; a null in the file."""
LARGEST: Final = np.iinfo(np.int32).max


@dataclass(frozen=True, slots=True)
class Quantity:
    """One column of whole numbers; the value is ``number * scale`` in ``unit``."""

    name: str
    unit: str
    """Empty for codes and counts."""
    scale: float
    meaning: str


EVERY_VEHICLE: Final = (
    Quantity("tick", "s", CONTROL_TICK_S, "time since the start of the run"),
    Quantity("lane_position", "m", 0.01, "front bumper from the beginning of the lane"),
    Quantity("x", "m", 0.01, "front bumper centre, east"),
    Quantity("y", "m", 0.01, "front bumper centre, north"),
    Quantity("heading", "rad", 1e-4, "counter-clockwise from east"),
    Quantity("measured_speed", "m/s", 0.01, "forward speed that the vehicle has"),
    Quantity("measured_accel", "m/s2", 0.01, "longitudinal acceleration that the vehicle has"),
    Quantity("length", "m", 0.01, "vehicle length"),
    Quantity("width", "m", 0.01, "vehicle width"),
    Quantity("leader_gap", "m", 0.01, "front bumper to the leader's rear bumper; null without a leader"),
)
"""Columns with a value for every vehicle (``leader_gap``: for bound ones with a leader in sight)."""

BOUND_VEHICLES: Final = (
    Quantity("command_kind", "", 1.0, "0 none, 1 motion profile, 2 wrench efforts"),
    Quantity("commanded_speed", "m/s", 0.01, "speed of the motion profile in force"),
    Quantity("commanded_accel_limit", "m/s2", 0.01, "acceleration limit of the motion profile in force"),
    Quantity("commanded_curvature", "1/m", 1e-5, "curvature of the motion profile in force, left positive"),
    Quantity("commanded_throttle", "", 1e-4, "throttle share of the wrench efforts in force"),
    Quantity("commanded_brake", "", 1e-4, "brake share of the wrench efforts in force"),
    Quantity("commanded_steering", "", 1e-4, "steering share of the wrench efforts in force, left positive"),
    Quantity("reference_speed", "m/s", 0.01, "limited speed that the speed controller follows"),
    Quantity("measured_curvature", "1/m", 1e-5, "path curvature of the rear axle, left positive"),
    Quantity("grip_limited", "", 1.0, "1: the tyres give less curvature than the wheel asks for"),
    Quantity("throttle", "", 1e-4, "throttle in effect, share"),
    Quantity("brake", "", 1e-4, "brake effort in effect, share"),
    Quantity("steer", "rad", 1e-4, "road-wheel angle, left positive"),
    Quantity("control_mode", "", 1.0, "the profile's control mode code"),
    Quantity("ready_mode", "", 1.0, "the profile's ready mode code"),
    Quantity("safety_mode", "", 1.0, "the profile's safety mode code; names in safety_mode_names"),
    Quantity("longitudinal", "", 1.0, "who governs speed: actuation.Longitudinal"),
    Quantity("lateral", "", 1.0, "who governs steering: actuation.Lateral"),
    Quantity("safety_devices", "", 1.0, "safety device bits of Report Vehicle Mode"),
)
"""Columns that are null for a vehicle that is not bound."""


def quantise(values: FloatColumn | IntColumn, scale: float) -> IntColumn:
    """Return ``values / scale`` as whole numbers, ``NULL`` where a value is not finite.

    A value beyond 32 bits (21 000 km in centimetres) is held at the end of the range.
    """
    scaled = np.asarray(values, np.float64) / scale
    finite = np.isfinite(scaled)
    whole = np.clip(np.rint(np.where(finite, scaled, 0.0)), NULL + 1, LARGEST)
    return np.where(finite, whole, NULL).astype(np.int64)


def dequantise(numbers: IntColumn, scale: float) -> FloatColumn:
    """Return ``numbers * scale``, NaN where a number is ``NULL``."""
    # Dividing by the whole inverse gives the nearest double: 123 / 100 is 1.23, 123 * 0.01 is not.
    inverse = round(1.0 / scale)
    return np.where(numbers == NULL, np.nan, numbers / inverse)
