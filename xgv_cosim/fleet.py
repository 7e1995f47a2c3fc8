"""The fleet: the state of all bound vehicles as columns, one row ("slot") per vehicle.

Stage functions take columns and return new ones. Only the package ``simulation`` writes into ``Fleet``:
whole columns in its loop, single cells where something sparse happens (a message, an edge, a binding).
A free slot holds a valid, idle vehicle at standstill, so that no stage needs to skip it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple, TypeVar

import numpy as np

from xgv_cosim.actuation import Driver, Gear, Lateral, Longitudinal
from xgv_cosim.columns import (
    BoolColumn,
    FloatColumn,
    FloatMatrix,
    IntColumn,
    UInt8Column,
    UInt8Matrix,
    UInt16Column,
    UInt64Column,
)
from xgv_cosim.commands import CommandColumns, empty_commands
from xgv_cosim.errors import ScenarioError, UnknownVehicleError
from xgv_cosim.parameters import (
    ParameterColumns,
    VehicleParameters,
    parameter_columns,
    parameter_table,
    parameters_in,
)

FIRST_CAPACITY = 4
"""Slots of a new fleet; the capacity doubles when they are used up."""

Columns = TypeVar("Columns", "Motion", "Reference", "HeldOutputs", CommandColumns, ParameterColumns)


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


def _grown(columns: Columns, fresh: Columns) -> Columns:
    """Return ``columns`` followed by ``fresh``, column by column."""
    before: list[Any] = list(columns)
    added: list[Any] = list(fresh)
    joined: list[Any] = [np.concatenate(pair) for pair in zip(before, added, strict=True)]
    return type(columns)(*joined)


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


@dataclass(slots=True)
class Fleet:
    """State of all bound vehicles; every column has shape ``(num_slots,)``."""

    ids: list[str | None] = field(default_factory=lambda: [None] * FIRST_CAPACITY)
    """Vehicle id of each slot, None where it is free."""
    motion: Motion = field(default_factory=lambda: idle_motion(FIRST_CAPACITY))
    reference: Reference = field(
        default_factory=lambda: reference_in(np.zeros((FIRST_CAPACITY, len(Reference._fields))))
    )
    held: HeldOutputs = field(default_factory=lambda: no_held_outputs(FIRST_CAPACITY))
    command: CommandColumns = field(default_factory=lambda: empty_commands(FIRST_CAPACITY))
    parameters: ParameterColumns = field(
        default_factory=lambda: parameter_columns(VehicleParameters(), FIRST_CAPACITY)
    )
    control_mode: UInt8Column = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.uint8))
    """The profile's control mode code, 0 unknown (XGV-48)."""
    ready_mode: UInt8Column = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.uint8))
    """The profile's ready mode code, 0 unknown (XGV-49)."""
    safety_mode: UInt8Column = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.uint8))
    """The profile's safety mode code, 0 unknown (XGV-50)."""
    safety_devices: UInt16Column = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.uint16))
    """Bits of Report Vehicle Mode, field 6 (XGV-52)."""
    partial_mode: UInt8Column = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.uint8))
    """Bit 0 manual steering, bit 1 manual speed (XGV-51)."""
    longitudinal: UInt8Column = field(
        default_factory=lambda: np.full(FIRST_CAPACITY, Longitudinal.HOLD, np.uint8)
    )
    """``actuation.Longitudinal`` in force."""
    lateral: UInt8Column = field(default_factory=lambda: np.full(FIRST_CAPACITY, Lateral.FREE, np.uint8))
    """``actuation.Lateral`` in force."""
    driver: UInt8Column = field(default_factory=lambda: np.full(FIRST_CAPACITY, Driver.NONE, np.uint8))
    """``actuation.Driver`` aboard (XGV-64)."""
    driver_reaction_s: FloatColumn = field(default_factory=lambda: np.ones(FIRST_CAPACITY))
    """Time in which the rider takes an axis that was released without his doing (XGV-64)."""
    speed_released_s: FloatColumn = field(default_factory=lambda: np.full(FIRST_CAPACITY, np.inf))
    """Since when speed is released, ``inf`` while it is not."""
    steering_released_s: FloatColumn = field(default_factory=lambda: np.full(FIRST_CAPACITY, np.inf))
    """Since when steering is released, ``inf`` while it is not."""
    driver_steered: BoolColumn = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.bool_))
    """The world's driver had the steering throughout the last world step."""
    heading_ease_rad: FloatColumn = field(default_factory=lambda: np.zeros(FIRST_CAPACITY))
    """What is left of the step in heading at his taking over: world's heading + this = the vehicle's."""
    stop_decel_mps2: FloatColumn = field(default_factory=lambda: np.full(FIRST_CAPACITY, 2.5))
    """Deceleration of a controlled stop, positive; set by the user (XGV-36)."""
    stop_hold_brake: FloatColumn = field(default_factory=lambda: np.full(FIRST_CAPACITY, 0.5))
    """Brake effort held after a controlled stop, share 0 to 1 (XGV-33)."""
    centres_without_command: BoolColumn = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.bool_))
    """Closed-loop steering without a live command goes to 0 instead of staying (XGV-35)."""
    gear_wanted: UInt8Column = field(default_factory=lambda: np.full(FIRST_CAPACITY, Gear.DRIVE, np.uint8))
    """``actuation.Gear`` last commanded in wrench-efforts mode; closed-loop control chooses by the sign of
    the commanded speed."""
    engine_on: BoolColumn = field(default_factory=lambda: np.ones(FIRST_CAPACITY, np.bool_))
    """False: no drive force."""
    parking_brake: BoolColumn = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.bool_))
    """True: the parking brake is set (XGV-60)."""
    brake_share_without_engine: FloatColumn = field(default_factory=lambda: np.ones(FIRST_CAPACITY))
    """Share of its deceleration that a brake effort gives with the engine off (XGV-31)."""
    lost_functions: UInt8Column = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.uint8))
    """Bits of ``actuation.LostFunction``: what errors have taken away (XGV-38)."""
    frozen: BoolColumn = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.bool_))
    """The controller is frozen: outputs held, modes not computed, endpoint silent (XGV-67)."""
    hears_stack: BoolColumn = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.bool_))
    """The controller computes, and what its stack sends arrives (XGV-32, XGV-67)."""
    draw_key: UInt64Column = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.uint64))
    """What a vehicle's own draws follow from: its id and the seed (``plant.imperfections``)."""
    handed_over: BoolColumn = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.bool_))
    """False while the world's driver still keeps both axes after binding (``bind.start``)."""
    keeps_lane: BoolColumn = field(default_factory=lambda: np.zeros(FIRST_CAPACITY, np.bool_))
    """The vehicle uses the lane coupling, so that the world decides its position."""
    _slots: dict[str, int] = field(default_factory=dict)
    """Slot of each bound vehicle."""
    _bound: tuple[IntColumn, tuple[str, ...]] | None = None
    """(slots in use, their vehicle ids) as last asked for; None after a change."""

    @property
    def num_slots(self) -> int:
        """Capacity, free slots included."""
        return len(self.ids)

    @property
    def bound(self) -> IntColumn:
        """Slots in use, ascending."""
        return self._in_use()[0]

    @property
    def bound_ids(self) -> tuple[str, ...]:
        """Vehicle ids in slot order."""
        return self._in_use()[1]

    def _in_use(self) -> tuple[IntColumn, tuple[str, ...]]:
        if self._bound is None:
            slots = sorted(self._slots.values())
            self._bound = np.array(slots, np.int64), tuple(str(self.ids[slot]) for slot in slots)
        return self._bound

    def __iter__(self) -> Iterator[tuple[int, str]]:
        slots, names = self._in_use()
        return zip(slots.tolist(), names, strict=True)

    def slot_of(self, vehicle_id: str) -> int:
        """Return the slot of a bound vehicle.

        Raises:
            UnknownVehicleError: No such vehicle is bound.
        """
        if vehicle_id not in self._slots:
            raise UnknownVehicleError(vehicle_id, self.bound_ids)
        return self._slots[vehicle_id]

    def occupy(self, vehicle_id: str) -> int:
        """Return a slot that now belongs to ``vehicle_id``; the capacity doubles if none is free.

        Raises:
            ScenarioError: The vehicle is bound already.
        """
        if vehicle_id in self._slots:
            raise ScenarioError(f"vehicle {vehicle_id!r} is bound already; release it first")
        if len(self._slots) == self.num_slots:
            self._double()
        slot = self.ids.index(None)
        self._make_idle(slot)  # so that nothing depends on how long the slot was free
        self.ids[slot] = vehicle_id
        self._slots[vehicle_id], self._bound = slot, None
        return slot

    def vacate(self, vehicle_id: str) -> int:
        """Free the slot of ``vehicle_id``, put an idle vehicle into it, and return it."""
        slot = self.slot_of(vehicle_id)
        self._make_idle(slot)
        self.ids[slot] = None
        del self._slots[vehicle_id]
        self._bound = None
        return slot

    def _make_idle(self, slot: int) -> None:
        idle = _idle()
        for name in ("motion", "reference", "held", "command", "parameters"):
            for column, fresh in zip(getattr(self, name), getattr(idle, name), strict=True):
                column[slot] = fresh[0]
        for name in _SINGLE_COLUMNS:
            getattr(self, name)[slot] = getattr(idle, name)[0]

    def _double(self) -> None:
        fresh = Fleet()
        while fresh.num_slots < self.num_slots:
            fresh._double()
        self.motion = copied_motion(_grown(self.motion, fresh.motion))
        self.reference = reference_in(reference_table(_grown(self.reference, fresh.reference)))
        self.held = _grown(self.held, fresh.held)
        self.command = _grown(self.command, fresh.command)
        self.parameters = parameters_in(parameter_table(_grown(self.parameters, fresh.parameters)))
        for name in _SINGLE_COLUMNS:
            setattr(self, name, np.concatenate([getattr(self, name), getattr(fresh, name)]))
        self.ids.extend(fresh.ids)


@cache
def _idle() -> Fleet:
    """Return a fleet of idle vehicles to copy from."""
    return Fleet()


_SINGLE_COLUMNS = (
    "control_mode",
    "ready_mode",
    "safety_mode",
    "safety_devices",
    "partial_mode",
    "longitudinal",
    "lateral",
    "driver",
    "driver_reaction_s",
    "speed_released_s",
    "steering_released_s",
    "driver_steered",
    "heading_ease_rad",
    "stop_decel_mps2",
    "stop_hold_brake",
    "centres_without_command",
    "gear_wanted",
    "engine_on",
    "parking_brake",
    "brake_share_without_engine",
    "lost_functions",
    "frozen",
    "hears_stack",
    "draw_key",
    "handed_over",
    "keeps_lane",
)
