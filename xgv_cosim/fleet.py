"""The fleet: the state of all bound vehicles as columns, one row ("slot") per vehicle.

Stage functions take columns and return new ones. Only the package ``simulation`` writes into ``Fleet``:
whole columns in its loop, single cells where something sparse happens (a message, an edge, a binding).
A free slot holds a valid, idle vehicle at standstill, so that no stage needs to skip it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Any, TypeVar

import numpy as np

from xgv_cosim.actuation import Driver, Gear, Lateral, Longitudinal
from xgv_cosim.columns import (
    BoolColumn,
    FloatColumn,
    IntColumn,
    UInt8Column,
    UInt16Column,
    UInt64Column,
)
from xgv_cosim.commands import CommandColumns, empty_commands
from xgv_cosim.errors import ScenarioError, UnknownVehicleError
from xgv_cosim.fleet_columns import (
    HeldOutputs,
    Motion,
    Reference,
    copied_motion,
    idle_motion,
    no_held_outputs,
    reference_in,
    reference_table,
)
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


def _grown(columns: Columns, fresh: Columns) -> Columns:
    """Return ``columns`` followed by ``fresh``, column by column."""
    before: list[Any] = list(columns)
    added: list[Any] = list(fresh)
    joined: list[Any] = [np.concatenate(pair) for pair in zip(before, added, strict=True)]
    return type(columns)(*joined)


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
