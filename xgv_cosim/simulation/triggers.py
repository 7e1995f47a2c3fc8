"""Injections that wait for a condition: looked at after each world step, for each vehicle by itself.

What is met at the end of a step acts on the first tick of the next one. Each vehicle is met once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from xgv_cosim.columns import BoolColumn, IntColumn
from xgv_cosim.condition import Condition
from xgv_cosim.injection import Injection
from xgv_cosim.road import Road
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.simulation.exchange import rows_of
from xgv_cosim.simulation.state import RunState
from xgv_cosim.simulation.waiting import Waiting
from xgv_cosim.snapshot import Snapshot


def schedule(state: RunState, injection: Injection) -> None:
    """Let an injection act on its tick, or wait from then on for its condition."""
    if injection.condition is None:
        state.devices.add(injection)
    else:
        state.waiting.injections.append(injection)


def look(state: RunState, snapshot: Snapshot, road: Road) -> None:
    """Schedule what is met now for the coming tick, with an event for each vehicle."""
    tick, waiting = state.clock.tick, state.waiting
    for number, injection in enumerate(waiting.injections):
        condition = injection.condition
        if condition is None or tick < injection.tick or not _other_is_in_mode(state, condition):
            continue
        vehicles = [
            vehicle
            for vehicle in state.vehicles
            if (number, vehicle.vehicle_id) not in waiting.met and _chooses(injection, vehicle)
        ]
        for vehicle in _meeting(state, snapshot, road, condition, vehicles):
            name = vehicle.vehicle_id
            waiting.met.add((number, name))
            state.note(name, "condition_met", after=injection.kind.value, reasons=condition.words())
            state.devices.add(_from_now(injection, name, tick))


def _meeting(
    state: RunState,
    snapshot: Snapshot,
    road: Road,
    condition: Condition,
    vehicles: Sequence[BoundVehicle],
) -> list[BoundVehicle]:
    """Return which of the vehicles meet the condition."""
    rows = rows_of(snapshot, [vehicle.vehicle_id for vehicle in vehicles])
    here = [vehicle for vehicle, row in zip(vehicles, rows.tolist(), strict=True) if row >= 0]
    slots = np.array([vehicle.slot for vehicle in here], np.int64)
    met = _holds(state, snapshot, road, condition, slots, rows[rows >= 0])
    return [here[index] for index in np.flatnonzero(met).tolist()]


def _holds(
    state: RunState, snapshot: Snapshot, road: Road, condition: Condition, slots: IntColumn, rows: IntColumn
) -> BoolColumn:
    """Return for each vehicle whether what the condition says of it holds, shape ``(n,)``."""
    holds = np.ones(slots.size, np.bool_)
    speed_mps, lane = state.fleet.motion.speed_mps[slots], snapshot.lane[rows]
    if condition.speed_above_mps is not None:
        holds &= speed_mps > condition.speed_above_mps
    if condition.speed_below_mps is not None:
        holds &= speed_mps < condition.speed_below_mps
    if condition.gap_below_m is not None:
        holds &= (snapshot.leader[rows] >= 0) & (snapshot.leader_gap_m[rows] < condition.gap_below_m)
    if condition.lanes is not None:
        holds &= (lane >= 0) & _lanes_of(state.waiting, condition.lanes, road)[lane]
    if condition.position_above_m is not None:
        holds &= (lane >= 0) & (snapshot.lane_position_m[rows] > condition.position_above_m)
    if condition.near is not None:
        x_m, y_m, radius_m = condition.near
        holds &= np.hypot(snapshot.front_x_m[rows] - x_m, snapshot.front_y_m[rows] - y_m) <= radius_m
    return holds


def _lanes_of(waiting: Waiting, pattern: str, road: Road) -> BoolColumn:
    if pattern not in waiting.lanes:
        waiting.lanes[pattern] = np.array([fnmatchcase(name, pattern) for name in road.lane_ids], np.bool_)
    return waiting.lanes[pattern]


def _chooses(injection: Injection, vehicle: BoundVehicle) -> bool:
    name = vehicle.vehicle_id
    if name in injection.vehicle_ids:
        return True
    return injection.matches is not None and injection.matches(vehicle.traveller)


def _other_is_in_mode(state: RunState, condition: Condition) -> bool:
    if condition.other is None:
        return True
    name, mode = condition.other
    if name not in state.vehicles:
        return False
    other = state.vehicles[name]
    return other.binding.profile.safety_mode_name(int(state.fleet.safety_mode[other.slot])) == mode


def _from_now(injection: Injection, vehicle_id: str, tick: int) -> Injection:
    """Return the injection on one vehicle, from this tick on, without its condition."""
    end = None if injection.end_tick is None else tick + injection.end_tick - injection.tick
    return replace(
        injection, tick=tick, end_tick=end, vehicle_ids=(vehicle_id,), matches=None, condition=None
    )
