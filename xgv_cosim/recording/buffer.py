"""The trajectories of a run while it goes on: whole numbers in growing columns, nothing per vehicle."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
from xgv_cosim.commands import CommandKind
from xgv_cosim.fleet import Fleet
from xgv_cosim.fleet_columns import is_limited_by_grip
from xgv_cosim.recording.quantities import BOUND_VEHICLES, EVERY_VEHICLE, quantise
from xgv_cosim.snapshot import Snapshot

Int32Matrix = npt.NDArray[np.int32]


class GrowingRows:
    """Rows of 32-bit whole numbers, kept column by column; the capacity doubles when it is used up."""

    def __init__(self, num_columns: int, capacity: int = 4096) -> None:
        self._columns: Int32Matrix = np.empty((num_columns, capacity), np.int32)
        self.num_rows = 0

    def append(self, columns: list[IntColumn]) -> None:
        """Append rows given as one array per column."""
        end = self.num_rows + len(columns[0])
        if end > self._columns.shape[1]:
            grown = np.empty((len(self._columns), max(end, 2 * self._columns.shape[1])), np.int32)
            grown[:, : self.num_rows] = self._columns[:, : self.num_rows]
            self._columns = grown
        for row, column in zip(self._columns, columns, strict=True):
            row[self.num_rows : end] = column
        self.num_rows = end

    @property
    def columns(self) -> Int32Matrix:
        """Return the rows so far, shape ``(num_columns, num_rows)``."""
        return self._columns[:, : self.num_rows]


class Numbering:
    """Numbers names in the order in which they come up first."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}
        self._last_names: tuple[str, ...] = ()
        self._last_numbers = np.zeros(0, np.int64)

    def of(self, names: tuple[str, ...]) -> IntColumn:
        """Return the number of each name."""
        if names != self._last_names:  # most steps have the vehicles of the step before
            numbers = self._numbers
            self._last_names = names
            self._last_numbers = np.array(
                [numbers.setdefault(name, len(numbers)) for name in names], np.int64
            )
        return self._last_numbers

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names by number."""
        return tuple(self._numbers)


class TrajectoryBuffer:
    """All vehicles of every recorded step.

    Attributes:
        every: Rows (vehicle number, type number, lane number, then ``EVERY_VEHICLE``), all vehicles.
        bound: Rows (row number in ``every``, then ``BOUND_VEHICLES``), bound vehicles only.
    """

    def __init__(self) -> None:
        self.vehicles = Numbering()
        self.types = Numbering()
        self.every = GrowingRows(3 + len(EVERY_VEHICLE))
        self.bound = GrowingRows(1 + len(BOUND_VEHICLES))

    def append(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
        """Append the state at the end of control tick ``tick``.

        A bound vehicle's measured speed and acceleration are the plant's while the plant moves it, and
        the world's while the world's own driver does; a bound vehicle that left the world is left out.
        """
        if not snapshot.ids:
            return
        slots, rows = _bound_rows(fleet, snapshot)
        values = _every_vehicle(tick, fleet, snapshot, slots, rows)
        first_row = self.every.num_rows
        numbers = [self.vehicles.of(snapshot.ids), self.types.of(snapshot.type_ids), snapshot.lane]
        self.every.append(numbers + [quantise(values[q.name], q.scale) for q in EVERY_VEHICLE])
        if len(slots):
            values = _bound_vehicles(fleet, slots)
            self.bound.append(
                [first_row + rows, *(quantise(values[q.name], q.scale) for q in BOUND_VEHICLES)]
            )


def _bound_rows(fleet: Fleet, snapshot: Snapshot) -> tuple[IntColumn, IntColumn]:
    """Return the slots of the bound vehicles that the world has, and their indices in the snapshot."""
    rows = snapshot.rows_of(fleet.bound_ids)
    return fleet.bound[rows >= 0], rows[rows >= 0]


def _every_vehicle(
    tick: int, fleet: Fleet, snapshot: Snapshot, slots: IntColumn, rows: IntColumn
) -> dict[str, FloatColumn]:
    speed_mps, accel_mps2 = snapshot.speed_mps.copy(), snapshot.accel_mps2.copy()
    by_plant = fleet.longitudinal[slots] != Longitudinal.DRIVER
    speed_mps[rows[by_plant]] = fleet.motion.speed_mps[slots[by_plant]]
    accel_mps2[rows[by_plant]] = fleet.motion.accel_mps2[slots[by_plant]]
    return {
        "tick": np.full(len(snapshot.ids), tick * CONTROL_TICK_S),
        "lane_position": snapshot.lane_position_m,
        "x": snapshot.front_x_m,
        "y": snapshot.front_y_m,
        "heading": snapshot.heading_rad,
        "measured_speed": speed_mps,
        "measured_accel": accel_mps2,
        "length": snapshot.length_m,
        "width": snapshot.width_m,
        "leader_gap": snapshot.leader_gap_m,
    }


def _bound_vehicles(fleet: Fleet, slots: IntColumn) -> dict[str, FloatColumn]:
    command, motion = fleet.command, fleet.motion
    kind = command.kind[slots]
    profile, wrench = kind == CommandKind.MOTION_PROFILE, kind == CommandKind.WRENCH_EFFORT
    return {
        "command_kind": kind.astype(np.float64),
        "commanded_speed": _where(profile, command.speed_mps[slots]),
        "commanded_accel_limit": _where(profile, command.max_accel_mps2[slots]),
        "commanded_curvature": _where(profile, command.curvature_per_m[slots]),
        "commanded_throttle": _where(wrench, command.throttle[slots]),
        "commanded_brake": _where(wrench, command.brake[slots]),
        "commanded_steering": _where(wrench, command.steering[slots]),
        "reference_speed": fleet.reference.speed_mps[slots],
        "measured_curvature": motion.curvature_per_m[slots],
        "grip_limited": is_limited_by_grip(motion)[slots].astype(np.float64),
        "throttle": motion.throttle[slots],
        "brake": motion.brake[slots],
        "steer": motion.steer_rad[slots],
        **{
            name: getattr(fleet, name)[slots].astype(np.float64)
            for name in (
                "control_mode",
                "ready_mode",
                "safety_mode",
                "longitudinal",
                "lateral",
                "safety_devices",
            )
        },
    }


def _where(mask: BoolColumn, values: FloatColumn) -> FloatColumn:
    return np.where(mask, values, np.nan)
