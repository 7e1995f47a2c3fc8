"""What goes into the world and what comes back: placements out, poses that the world moved in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xgv_cosim import kernel
from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
from xgv_cosim.fleet import Fleet
from xgv_cosim.fleet_columns import Motion, copied_motion, motion_table
from xgv_cosim.parameters import ParameterColumns, parameter_table
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.worlds.base import Placement

HEADING_EASE_S = 0.5
"""Time in which the step in heading at a hand-over falls to 1/e."""


def front_distance_m(parameters: ParameterColumns) -> FloatColumn:
    """Return the distance from the rear axle to the front bumper."""
    return parameters.wheelbase_m + parameters.front_overhang_m


def nobody_yet(fleet: Fleet) -> tuple[BoolColumn, BoolColumn]:
    """Return owners of (speed, steering) for the begin of a step: the computer has neither yet."""
    return np.zeros(fleet.num_slots, np.bool_), np.zeros(fleet.num_slots, np.bool_)


def also_computers(fleet: Fleet, so_far: tuple[BoolColumn, BoolColumn]) -> tuple[BoolColumn, BoolColumn]:
    """Return which slots' (speed, steering) the plant governs in this world step.

    An axis that is the computer's in any part of the step is placed by the plant, so that an edge
    inside the step acts on its own tick (XGV-71); the world's driver has only what is his throughout.
    """
    kernel.own(*so_far, fleet.longitudinal, fleet.lateral)
    return so_far


def placement_of(fleet: Fleet, computer_speed: BoolColumn, computer_steering: BoolColumn) -> Placement:
    """Return where the plant puts the bound vehicles; the axis owners are those of the step."""
    slots = fleet.bound
    placed, owned = np.empty((5, slots.size)), np.empty((2, slots.size), np.bool_)
    kernel.place(
        placed,
        owned,
        slots,
        motion_table(fleet.motion),
        parameter_table(fleet.parameters),
        computer_speed,
        computer_steering,
    )
    return Placement(fleet.bound_ids, *placed, *owned)


def moved_by_world(
    fleet: Fleet, rows: IntColumn, computer_speed: BoolColumn, computer_steering: BoolColumn
) -> tuple[IntColumn, IntColumn]:
    """Return slots and rows of those whose position the world decides: a driver's axis, or lane coupling.

    Args:
        fleet: The fleet.
        rows: Row of each bound vehicle in the snapshot, -1 where it is not there.
        computer_speed: Over all slots, as placed.
        computer_steering: Over all slots, as placed.
    """
    slots = fleet.bound
    moved = (~computer_speed | ~computer_steering | fleet.keeps_lane)[slots] & (rows >= 0)
    return slots[moved], rows[moved]


def heading_ease(
    fleet: Fleet, snapshot: Snapshot, slots: IntColumn, rows: IntColumn, steered: BoolColumn, step_s: float
) -> FloatColumn:
    """Return what stays of the step in heading where the world's driver has taken the wheel.

    The world turns a car to its lane at once; a car cannot. So the difference to where the plant was
    going is kept at the hand-over and fades with ``HEADING_EASE_S``.

    Args:
        fleet: The fleet after the plant.
        snapshot: The world after the step.
        slots: Slots that take something back, shape ``(n,)``.
        rows: Their rows in the snapshot, shape ``(n,)``.
        steered: Over all slots: the world's driver had the steering throughout the step.
        step_s: World step.
    """
    if not steered.any():
        return np.zeros(fleet.num_slots)
    ease = np.where(steered, fleet.heading_ease_rad * np.exp(-step_s / HEADING_EASE_S), 0.0)
    taken = steered[slots] & ~fleet.driver_steered[slots]
    turned = fleet.motion.heading_rad[slots] - snapshot.of("heading_rad", rows)
    ease[slots] = np.where(taken, np.remainder(turned + np.pi, 2.0 * np.pi) - np.pi, ease[slots])
    return ease


def adopt(
    fleet: Fleet,
    snapshot: Snapshot,
    slots: IntColumn,
    rows: IntColumn,
    computer_speed: BoolColumn,
    computer_steering: BoolColumn,
    before: Motion,
) -> Motion:
    """Return the motion with what the world moved itself.

    The world's driver's axes are read back: speed where he drives, heading where he steers, and the
    position in either case. Where the plant governs both, its motion stands.

    Args:
        fleet: The fleet after the plant.
        snapshot: The world after the step.
        slots: Slots that take something back, shape ``(n,)``.
        rows: Their rows in the snapshot, shape ``(n,)``.
        computer_speed: Over all slots, as placed.
        computer_steering: Over all slots, as placed.
        before: The motion at the start of the step.
    """
    seen = np.zeros((5, slots.size))
    seen[0], seen[1] = snapshot.of("front_x_m", rows), snapshot.of("front_y_m", rows)
    drives, steers = ~computer_speed[slots], ~computer_steering[slots]
    if steers.any():
        seen[2, steers] = snapshot.of("heading_rad", rows[steers]) + fleet.heading_ease_rad[slots[steers]]
    if drives.any():
        seen[3, drives] = snapshot.of("speed_mps", rows[drives])
        seen[4, drives] = snapshot.of("accel_mps2", rows[drives])
    motion = copied_motion(fleet.motion)
    kernel.adopt(
        motion_table(motion),
        motion_table(before),
        parameter_table(fleet.parameters),
        slots,
        computer_speed,
        computer_steering,
        seen,
    )
    return motion


def rows_of(snapshot: Snapshot, vehicle_ids: Sequence[str]) -> IntColumn:
    """Return the row of each vehicle in the snapshot, -1 where it is not there."""
    return np.array([snapshot.index_of.get(vehicle_id, -1) for vehicle_id in vehicle_ids], np.int64)
