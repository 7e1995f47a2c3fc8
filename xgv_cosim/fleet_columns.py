"""What the fleet keeps of each vehicle: motion, reference, setpoints, as columns of shape ``(num_slots,)``.

Where compiled code takes a whole table, the columns are views of one; see ``MotionTable`` and its like.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from xgv_cosim.actuation import Gear, Lateral, Longitudinal
from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, UInt8Column, UInt8Matrix


class Motion(NamedTuple):
    """What the plant knows of each slot. Frame east-north-up, reference point at the rear axle."""

    x_m: FloatColumn
    y_m: FloatColumn
    heading_rad: FloatColumn
    """Counter-clockwise from east."""
    speed_mps: FloatColumn
    """Forward speed, negative in reverse."""
    accel_mps2: FloatColumn
    """Longitudinal acceleration."""
    curvature_per_m: FloatColumn
    """Path curvature of the rear axle, positive counter-clockwise."""
    steer_rad: FloatColumn
    """Road-wheel angle, positive counter-clockwise."""
    throttle: FloatColumn
    """Throttle in effect, share 0 to 1."""
    brake: FloatColumn
    """Brake effort in effect, share 0 to 1."""
    speed_error_integral_m: FloatColumn
    """Integrator of the speed controller."""
    travelled_m: FloatColumn
    """Signed distance of the rear axle since the start of the world step."""
    gear: UInt8Column
    """``actuation.Gear`` in effect (XGV-04)."""
    shift_s: FloatColumn
    """How long the car has stood, braked, while another gear is wanted: first the standstill, then the
    shift delay (XGV-70)."""
    grip_limited_s: FloatColumn
    """How long the last time lasted, or has lasted so far, in which the tyres gave less curvature than the
    wheel asks for; 0: there was none."""
    grip_free_s: FloatColumn
    """How long ago that ended, 0 while it lasts."""


_GEAR = Motion._fields.index("gear")


class MotionTable(Motion):
    """A motion whose columns of numbers are those of one table, which compiled code takes as a whole."""

    table: FloatMatrix | None = None
    """Shape ``(num_slots, 14)``: the columns of ``Motion`` in their order, without the gear."""


def motion_in(table: FloatMatrix, gear: UInt8Column) -> Motion:
    """Return the motion whose columns are those of a table, as views; see ``MotionTable.table``."""
    columns = table.T
    motion = MotionTable._make((*columns[:_GEAR], gear, *columns[_GEAR:]))
    motion.table = table
    return motion


def motion_table(motion: Motion) -> FloatMatrix:
    """Return the table of a motion, a new one if its columns are not those of a table."""
    if isinstance(motion, MotionTable) and motion.table is not None:
        return motion.table
    return _table_of(getattr(motion, name) for name in motion._fields if name != "gear")


def idle_motion(num_slots: int) -> Motion:
    """Return vehicles that stand at the origin in drive, heading east, everything released."""
    return motion_in(np.zeros((num_slots, len(Motion._fields) - 1)), np.full(num_slots, Gear.DRIVE, np.uint8))


def copied_motion(motion: Motion) -> Motion:
    """Return the same motion in columns of its own."""
    return motion_in(motion_table(motion).copy(), motion.gear.copy())


def is_limited_by_grip(motion: Motion) -> BoolColumn:
    """Return where the tyres give less curvature than the wheel asks for, at the end of the last tick."""
    limited: BoolColumn = (motion.grip_limited_s > 0.0) & (motion.grip_free_s == 0.0)
    return limited


class Reference(NamedTuple):
    """What ruckig lets the controllers follow, at the present tick."""

    speed_mps: FloatColumn
    accel_mps2: FloatColumn
    curvature_per_m: FloatColumn
    curvature_rate_per_m_s: FloatColumn


class ReferenceTable(Reference):
    """A reference whose columns are those of one table."""

    table: FloatMatrix | None = None
    """Shape ``(num_slots, 4)``: the columns of ``Reference`` in their order."""


def reference_in(table: FloatMatrix) -> Reference:
    """Return the reference whose columns are those of a table, as views."""
    reference = ReferenceTable(*table.T)
    reference.table = table
    return reference


def reference_table(reference: Reference) -> FloatMatrix:
    """Return the table of a reference, a new one if its columns are not those of a table."""
    if isinstance(reference, ReferenceTable) and reference.table is not None:
        return reference.table
    return _table_of(reference)


def _table_of(columns: Iterable[FloatColumn | UInt8Column]) -> FloatMatrix:
    return np.ascontiguousarray(np.array(tuple(columns), np.float64).T)


class HeldOutputs(NamedTuple):
    """What a frozen controller goes on putting out (XGV-67); read only where ``Fleet.frozen``."""

    safety_mode: UInt8Column
    """The mode in force when it froze."""
    governed: UInt8Column
    """``actuation.Longitudinal`` in force when it froze: what the held brake is for."""
    longitudinal: UInt8Column
    """``actuation.Longitudinal``: OPEN_LOOP with the efforts below, or an axis that was not its own."""
    lateral: UInt8Column
    """``actuation.Lateral``: OPEN_LOOP with the angle below, or an axis that was not its own."""
    throttle: FloatColumn
    """Throttle in effect when it froze, share 0 to 1."""
    brake: FloatColumn
    """Brake effort in effect when it froze, share 0 to 1."""
    steer_rad: FloatColumn
    """Road-wheel angle when it froze, positive counter-clockwise."""


def no_held_outputs(num_slots: int) -> HeldOutputs:
    """Return the columns of controllers that run."""
    return HeldOutputs(
        safety_mode=np.zeros(num_slots, np.uint8),
        governed=np.zeros(num_slots, np.uint8),
        longitudinal=np.zeros(num_slots, np.uint8),
        lateral=np.zeros(num_slots, np.uint8),
        throttle=np.zeros(num_slots),
        brake=np.zeros(num_slots),
        steer_rad=np.zeros(num_slots),
    )


class Setpoints(NamedTuple):
    """What each axis has to do until the next change: the modes' answer joined with the command."""

    longitudinal: UInt8Column
    """``actuation.Longitudinal``."""
    lateral: UInt8Column
    """``actuation.Lateral``."""
    target_speed_mps: FloatColumn
    """CLOSED_LOOP: commanded speed. CONTROLLED_STOP: 0."""
    accel_limit_mps2: FloatColumn
    """Greatest rise of speed, positive."""
    decel_limit_mps2: FloatColumn
    """Greatest fall of speed, positive."""
    jerk_limit_mps3: FloatColumn
    """``inf``: the acceleration may jump (XGV-36)."""
    target_curvature_per_m: FloatColumn
    curvature_rate_limit_per_m_s: FloatColumn
    curvature_jerk_limit_per_m_s2: FloatColumn
    throttle: FloatColumn
    """OPEN_LOOP: commanded throttle share."""
    brake: FloatColumn
    """OPEN_LOOP: commanded brake share. CONTROLLED_STOP and HOLD: the effort held at standstill."""
    steer_rad: FloatColumn
    """OPEN_LOOP: commanded road-wheel angle."""
    gear_wanted: UInt8Column
    """``actuation.Gear`` to which the selector is to go; it goes at standstill only (XGV-70)."""
    engine_on: BoolColumn
    """False: no drive force, no creep."""
    parking_brake: BoolColumn
    """True: it is set and acts against motion, whatever the brake effort (XGV-60)."""
    brake_authority: FloatColumn
    """Share of its deceleration that a brake effort still gives (XGV-31)."""
    lost_functions: UInt8Column
    """Bits of ``actuation.LostFunction`` (XGV-38)."""


class SetpointTables(Setpoints):
    """Setpoints whose columns are those of two tables."""

    numbers: FloatMatrix | None = None
    """Shape ``(num_slots, 11)``: the columns of numbers in their order."""
    codes: UInt8Matrix | None = None
    """Shape ``(num_slots, 6)``: the others, truth as 0 or 1."""


_CODES = ("longitudinal", "lateral", "gear_wanted", "engine_on", "parking_brake", "lost_functions")
_TRUTHS = ("engine_on", "parking_brake")
_NUMBERS = tuple(name for name in Setpoints._fields if name not in _CODES)


def setpoints_in(numbers: FloatMatrix, codes: UInt8Matrix) -> Setpoints:
    """Return the setpoints whose columns are those of two tables, as views."""
    columns: dict[str, Any] = dict(zip(_NUMBERS, numbers.T, strict=True))
    columns |= zip(_CODES, codes.T, strict=True)
    for name in _TRUTHS:
        columns[name] = columns[name].view(np.bool_)
    setpoints = SetpointTables(**columns)
    setpoints.numbers, setpoints.codes = numbers, codes
    return setpoints


def setpoint_tables(setpoints: Setpoints) -> tuple[FloatMatrix, UInt8Matrix]:
    """Return numbers and codes of setpoints, new tables if their columns are not those of tables."""
    if (
        isinstance(setpoints, SetpointTables)
        and setpoints.numbers is not None
        and setpoints.codes is not None
    ):
        return setpoints.numbers, setpoints.codes
    codes = np.array([getattr(setpoints, name) for name in _CODES], np.uint8)
    return _table_of(getattr(setpoints, name) for name in _NUMBERS), np.ascontiguousarray(codes.T)


def idle_setpoints(num_slots: int) -> Setpoints:
    """Return setpoints of vehicles that hold where they are, every effort and target 0."""
    kinds = {"longitudinal": Longitudinal.HOLD, "lateral": Lateral.LATCH_LAST, "gear_wanted": Gear.DRIVE}
    columns: dict[str, Any] = {name: np.zeros(num_slots) for name in Setpoints._fields}
    columns |= {name: np.full(num_slots, kind, np.uint8) for name, kind in kinds.items()}
    columns["brake_authority"] = np.ones(num_slots)
    columns["engine_on"] = np.ones(num_slots, np.bool_)
    columns["parking_brake"] = np.zeros(num_slots, np.bool_)
    columns["lost_functions"] = np.zeros(num_slots, np.uint8)
    return Setpoints(**columns)
