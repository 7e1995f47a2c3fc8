"""What goes into the world and what comes back: placements out, poses that the world moved in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
from xgv_cosim.fleet import Fleet, Motion, copied_motion
from xgv_cosim.parameters import ParameterColumns
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.worlds.base import Placement

HEADING_EASE_S = 0.5
"""Time in which the step in heading at a hand-over falls to 1/e."""
_SHORTEST_ARC_M = 0.2
"""Below this the change of heading of one step says nothing about curvature."""


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
    speed, steering = so_far
    return (
        speed | (fleet.longitudinal != Longitudinal.DRIVER),
        steering | (fleet.lateral != Lateral.DRIVER),
    )


def placement_of(fleet: Fleet, computer_speed: BoolColumn, computer_steering: BoolColumn) -> Placement:
    """Return where the plant puts the bound vehicles; the axis owners are those of the step."""
    slots, motion, reach = fleet.bound, fleet.motion, front_distance_m(fleet.parameters)
    return Placement(
        ids=fleet.bound_ids,
        front_x_m=(motion.x_m + reach * np.cos(motion.heading_rad))[slots],
        front_y_m=(motion.y_m + reach * np.sin(motion.heading_rad))[slots],
        heading_rad=motion.heading_rad[slots],
        speed_mps=motion.speed_mps[slots],
        travelled_m=motion.travelled_m[slots],
        computer_speed=computer_speed[slots],
        computer_steering=computer_steering[slots],
    )


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
    motion = copied_motion(fleet.motion)
    drives, steers = ~computer_speed[slots], ~computer_steering[slots]
    by_speed, by_steering = slots[drives], slots[steers]
    motion.heading_rad[by_steering] = (
        snapshot.of("heading_rad", rows[steers]) + fleet.heading_ease_rad[by_steering]
    )
    motion.speed_mps[by_speed] = snapshot.of("speed_mps", rows[drives])
    motion.accel_mps2[by_speed] = snapshot.of("accel_mps2", rows[drives])
    motion.speed_error_integral_m[by_speed] = 0.0
    reach = front_distance_m(fleet.parameters)[slots]
    motion.x_m[slots] = snapshot.of("front_x_m", rows) - reach * np.cos(motion.heading_rad[slots])
    motion.y_m[slots] = snapshot.of("front_y_m", rows) - reach * np.sin(motion.heading_rad[slots])
    east, north = motion.x_m - before.x_m, motion.y_m - before.y_m
    forward = east * np.cos(motion.heading_rad) + north * np.sin(motion.heading_rad)
    motion.travelled_m[by_speed] = forward[by_speed]
    curvature = _driven_curvature(motion, before.heading_rad)[by_steering]
    motion.curvature_per_m[by_steering] = curvature
    speed = motion.speed_mps[by_steering]
    understeer = fleet.parameters.understeer_rad_s2_per_m[by_steering] * speed * speed
    # The angle that the plant's steady state gives this curvature, as closed loop will take it over.
    motion.steer_rad[by_steering] = np.arctan(
        curvature * (fleet.parameters.wheelbase_m[by_steering] + understeer)
    )
    return motion


def _driven_curvature(motion: Motion, heading_before_rad: FloatColumn) -> FloatColumn:
    """Return the mean curvature of the step from its change of heading; 0 where the car hardly moved."""
    turned = np.remainder(motion.heading_rad - heading_before_rad + np.pi, 2.0 * np.pi) - np.pi
    moved = np.abs(motion.travelled_m) > _SHORTEST_ARC_M
    return np.where(moved, turned / np.where(moved, motion.travelled_m, 1.0), 0.0)


def rows_of(snapshot: Snapshot, vehicle_ids: Sequence[str]) -> IntColumn:
    """Return the row of each vehicle in the snapshot, -1 where it is not there."""
    return np.array([snapshot.index_of.get(vehicle_id, -1) for vehicle_id in vehicle_ids], np.int64)
