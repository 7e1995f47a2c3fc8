"""What happened, in words: mode changes, hand-overs, and what the world did."""

from __future__ import annotations

import numpy as np

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.columns import BoolColumn, UInt8Column
from xgv_cosim.simulation import commanding
from xgv_cosim.simulation.moding import AxisModes
from xgv_cosim.simulation.state import RunState
from xgv_cosim.snapshot import Snapshot


def _holder(code: int, free: int, driver: int) -> str:
    if code == driver:
        return "driver"
    return "nobody" if code == free else "computer"


def _note_axis(
    state: RunState, kind: str, before: UInt8Column, after: UInt8Column, free: int, driver: int
) -> None:
    for slot in np.flatnonzero(before != after).tolist():
        old, new = _holder(int(before[slot]), free, driver), _holder(int(after[slot]), free, driver)
        if old != new and state.fleet.ids[slot] is not None:
            state.note(str(state.fleet.ids[slot]), kind, old, new)


def note_modes(state: RunState, axes: AxisModes) -> None:
    """Enter what changes at this tick: safety modes with their reasons, hand-overs, axis holders."""
    fleet = state.fleet
    for slot in np.flatnonzero(axes.safety_mode != fleet.safety_mode).tolist():
        vehicle = state.vehicles[str(fleet.ids[slot])]
        name_of = vehicle.binding.profile.safety_mode_name
        before, after = name_of(int(fleet.safety_mode[slot])), name_of(int(axes.safety_mode[slot]))
        reasons = vehicle.endpoint.reasons(int(fleet.safety_devices[slot]))
        state.note(vehicle.vehicle_id, "safety_mode", before, after, reasons)
    for slot in np.flatnonzero(axes.handed_over & ~fleet.handed_over).tolist():
        state.note(str(fleet.ids[slot]), "handover", "world_driver", "computer")
    _note_axis(
        state, "speed_control", fleet.longitudinal, axes.longitudinal, Longitudinal.FREE, Longitudinal.DRIVER
    )
    _note_axis(state, "steering_control", fleet.lateral, axes.lateral, Lateral.FREE, Lateral.DRIVER)


def note_failed_references(state: RunState, failed: BoolColumn) -> None:
    """Put vehicles whose references could not be computed into the error state, each on its own."""
    for slot in np.flatnonzero(failed).tolist():
        if state.fleet.ids[slot] is None:
            continue
        vehicle = state.vehicles[str(state.fleet.ids[slot])]
        code = vehicle.binding.profile.controller_failure_code
        raised = vehicle.endpoint.raise_error(code, state.now_s)
        if raised:  # not again while the error stands
            reason = "its speed or curvature reference is not valid"
            state.note(vehicle.vehicle_id, "controller_failed", reasons=(reason,))
            commanding.handle(state, vehicle, raised)


def note_world(state: RunState, snapshot: Snapshot) -> None:
    """Enter what the world did in this step."""
    for vehicle_id, text in snapshot.notes:
        state.note(vehicle_id, "world_note", reasons=(text,))
    _note_road(state, snapshot)
    for vehicle_id in snapshot.teleported:
        state.note(vehicle_id, "teleport")
    contacts = {(collision.collider, collision.victim) for collision in snapshot.collisions}
    begun = [c for c in snapshot.collisions if (c.collider, c.victim) not in state.contacts]
    state.contacts = contacts
    for collision in begun:
        place = f"{collision.kind} on lane {collision.lane_id} at {collision.position_m:.1f} m"
        state.note(collision.collider, "collision", after=collision.victim, reasons=(place,))


def _note_road(state: RunState, snapshot: Snapshot) -> None:
    """Enter when a bound vehicle leaves the road, and when it is back."""
    rows = {vehicle.vehicle_id: snapshot.index_of.get(vehicle.vehicle_id) for vehicle in state.vehicles}
    off = {name for name, row in rows.items() if row is not None and snapshot.lane[row] < 0}
    for name in sorted(off - state.off_road):
        state.note(name, "road", "on_road", "off_road", ("its front is on no lane",))
    for name in sorted(state.off_road - off):
        state.note(name, "road", "off_road", "on_road")
    state.off_road = off
