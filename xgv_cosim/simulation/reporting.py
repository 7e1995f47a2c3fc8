"""What happened, in words: mode changes, hand-overs, and what the world did."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from xgv_cosim.actuation import Driver, Lateral, Longitudinal, LostFunction
from xgv_cosim.columns import BoolColumn, IntColumn, UInt8Column
from xgv_cosim.road import Road
from xgv_cosim.simulation import braking, commanding, setpoints
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.simulation.moding import AxisModes
from xgv_cosim.simulation.state import RunState
from xgv_cosim.snapshot import Snapshot

_NOT_THE_COMPUTERS = (Longitudinal.FREE, Longitudinal.DRIVER)


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


def reasons_of(state: RunState, vehicle: BoundVehicle) -> tuple[str, ...]:
    """Return why the safety mode of a vehicle is what it is, strongest cause first."""
    computed = vehicle.endpoint.reasons(int(state.fleet.safety_devices[vehicle.slot]))
    return vehicle.devices.reasons(computed)


def note_modes(state: RunState, axes: AxisModes) -> None:
    """Enter what changes at this tick: safety modes with their reasons, hand-overs, axis holders."""
    fleet = state.fleet
    for slot in np.flatnonzero(axes.safety_mode != fleet.safety_mode).tolist():
        vehicle = state.vehicles[str(fleet.ids[slot])]
        name_of = vehicle.binding.profile.safety_mode_name
        before, after = name_of(int(fleet.safety_mode[slot])), name_of(int(axes.safety_mode[slot]))
        state.note(vehicle.vehicle_id, "safety_mode", before, after, reasons_of(state, vehicle))
        vehicle.refusals.clear()  # in another mode the same refusal is news
        if not fleet.frozen[slot]:  # a frozen controller does not notice what hardware does (XGV-67)
            entered = vehicle.endpoint.safety_mode_entered(int(axes.safety_mode[slot]), state.now_s)
            commanding.handle(state, vehicle, entered)
    for slot in np.flatnonzero(axes.handed_over & ~fleet.handed_over).tolist():
        state.note(str(fleet.ids[slot]), "handover", "world_driver", "computer")
    _note_axis(
        state, "speed_control", fleet.longitudinal, axes.longitudinal, Longitudinal.FREE, Longitudinal.DRIVER
    )
    _note_axis(state, "steering_control", fleet.lateral, axes.lateral, Lateral.FREE, Lateral.DRIVER)


def note_stops_without_effect(state: RunState, pausing: BoolColumn) -> None:
    """Enter stop demands that do not stop the car, when they begin and, with their duration, when they end.

    ``stop_masked``: a higher mode, a fault or a bypass stands before the demand (XGV-68).
    ``override_masked``: the manual override is engaged, and a frozen controller does not see it (XGV-13).
    ``pause_ineffective``, ``disable_ineffective``: the mode is a stop, and the computer does not brake, for
    the pedals are a human's or an error has taken the brake away (XGV-38, XGV-41).
    ``pause_weaker_than_set``: it brakes, but the road does not let it reach the set deceleration (XGV-36).
    ``disable_weaker_than_full``: likewise full brake, for want of the engine's assistance (XGV-31).

    ``no_command``: in drive-by-wire without a live command the car stops and holds (XGV-70).

    The endpoints are told here too where the computer drives against the parking brake (XGV-38).

    A stop that a frozen controller holds counts as the stop that it is; it may have frozen before the brake
    was there.
    """
    fleet, unseen = state.fleet, state.alarms.take_unseen()
    _tell_who_drags(state, unseen)
    unseen |= state.alarms.take_unseen()
    pausing = pausing | _held_pauses(state)
    governed = braking.governed_by(fleet)
    left_to_human = pausing & fleet.handed_over & np.isin(fleet.longitudinal, _NOT_THE_COMPUTERS)
    without_brake = (fleet.lost_functions & LostFunction.BRAKE != 0) & (
        (pausing & (governed == Longitudinal.CONTROLLED_STOP)) | braking.is_full_brake(governed)
    )
    without_command = (fleet.longitudinal == Longitudinal.CONTROLLED_STOP) & ~pausing
    reach = braking.reach_of(fleet)
    weaker = braking.is_weaker_than_set(fleet, reach) & ~without_brake
    weaker_than_full = braking.is_weaker_than_full(fleet, reach) & ~without_brake
    told = fleet.safety_mode.astype(np.int64)
    for flag in (left_to_human, without_brake, without_command, weaker, weaker_than_full, pausing):
        told = 2 * told + flag
    told = 2 * told + fleet.handed_over
    for vehicle in _changed(state, state.told, told, unseen):
        slot, mode = vehicle.slot, int(fleet.safety_mode[vehicle.slot])
        masked = vehicle.devices.masked_stops(mode, handed_over=bool(fleet.handed_over[slot]))
        now = {("stop_masked", what): why for what, why in masked.items()}
        if why := vehicle.devices.masked_override(mode):
            now["override_masked", "manual override"] = why
        if left_to_human[slot] or without_brake[slot]:
            kind = "pause_ineffective" if pausing[slot] else "disable_ineffective"
            name = vehicle.binding.profile.safety_mode_name(mode)
            now[kind, name] = _why_no_brake(state, vehicle, is_manual=bool(left_to_human[slot]))
        if weaker[slot]:
            name = vehicle.binding.profile.safety_mode_name(mode)
            now["pause_weaker_than_set", name] = braking.why_weaker(fleet, reach, slot)
        if weaker_than_full[slot]:
            name = vehicle.binding.profile.safety_mode_name(mode)
            now["disable_weaker_than_full", name] = braking.why_weaker_than_full(fleet, reach, slot)
        if without_command[slot]:
            now["no_command", "stop and hold"] = "no live command: the car stops and holds until one comes"
        for kind, what in [key for key in vehicle.lasting if key not in now]:
            _end(state, vehicle, kind, what)
        for (kind, what), why in now.items():
            if (kind, what) not in vehicle.lasting:
                vehicle.lasting[kind, what] = state.now_s
                state.note(vehicle.vehicle_id, kind, "", what, (why,))
    state.told = told


def _changed(
    state: RunState,
    before: IntColumn | BoolColumn,
    after: IntColumn | BoolColumn,
    unseen: Mapping[int, BoundVehicle],
) -> Iterator[BoundVehicle]:
    """Return in slot order the vehicles of which a column says something new, or that were touched."""
    slots = set(unseen)
    if before.shape == after.shape:
        slots.update(np.flatnonzero(before != after).tolist())
    else:
        slots.update(state.fleet.bound.tolist())
    names = (state.fleet.ids[slot] for slot in sorted(slots))
    return (state.vehicles[name] for name in names if name is not None)


def _tell_who_drags(state: RunState, unseen: Mapping[int, BoundVehicle]) -> None:
    """Let endpoints warn of a parking brake against which the computer drives, and no longer does."""
    drags, before = setpoints.drags_parking_brake(state.fleet), state.dragging
    state.dragging = drags
    for vehicle in _changed(state, before, drags, unseen):
        if vehicle.is_computing and vehicle.drags != drags[vehicle.slot]:
            vehicle.drags = bool(drags[vehicle.slot])
            told = vehicle.endpoint.parking_brake_drags(vehicle.drags, state.now_s)
            commanding.handle(state, vehicle, told)


def _held_pauses(state: RunState) -> BoolColumn:
    """Return where a frozen controller holds the outputs of a pause (XGV-67)."""
    fleet = state.fleet
    held = np.zeros(fleet.num_slots, np.bool_)
    for slot in np.flatnonzero(fleet.frozen & (fleet.safety_mode == fleet.held.safety_mode)).tolist():
        if fleet.ids[slot] is not None:
            vehicle = state.vehicles[str(fleet.ids[slot])]
            held[slot] = vehicle.binding.profile.is_pause(int(fleet.safety_mode[slot]))
    return held


def _why_no_brake(state: RunState, vehicle: BoundVehicle, *, is_manual: bool) -> str:
    fleet, slot = state.fleet, vehicle.slot
    if not is_manual:
        return f"no brake: {', '.join(vehicle.endpoint.errors_taking(LostFunction.BRAKE))}"
    if fleet.longitudinal[slot] == Longitudinal.FREE:
        return "manual speed, and nobody has the pedals"
    who = "rider" if fleet.driver[slot] == Driver.RIDER else "world's driver"
    return f"manual speed, and the {who} at the pedals drives on as in traffic"


def end_lasting(state: RunState, vehicle: BoundVehicle) -> None:
    """Enter the end of what lasts without effect, because the vehicle is released."""
    for kind, what in list(vehicle.lasting):
        _end(state, vehicle, kind, what)


def _end(state: RunState, vehicle: BoundVehicle, kind: str, what: str) -> None:
    lasted_s = state.now_s - vehicle.lasting.pop((kind, what))
    state.note(vehicle.vehicle_id, kind, what, "", (f"lasted {lasted_s:.2f} s",))


def note_failed_references(state: RunState, failed: BoolColumn) -> bool:
    """Put vehicles whose references cannot be computed into the error state, each on its own (XGV-38).

    Returns:
        Whether any was put there now: then the modes follow.
    """
    is_news = False
    for slot in np.flatnonzero(failed).tolist():
        if state.fleet.ids[slot] is None:
            continue
        vehicle = state.vehicles[str(state.fleet.ids[slot])]
        code = vehicle.binding.profile.controller_failure_code
        raised = vehicle.endpoint.raise_error(code, state.now_s)
        if raised:  # not again while the error stands
            is_news = True
            reason = "its speed or curvature reference is not valid"
            state.note(vehicle.vehicle_id, "controller_failed", reasons=(reason,))
            commanding.handle(state, vehicle, raised)
    return is_news


def note_world(state: RunState, snapshot: Snapshot) -> None:
    """Enter what the world did in this step."""
    for vehicle_id, text in snapshot.notes:
        state.note(vehicle_id, "world_note", reasons=(text,))
    _note_road(state, snapshot)
    contacts = {(collision.collider, collision.victim) for collision in snapshot.collisions}
    begun = [c for c in snapshot.collisions if (c.collider, c.victim) not in state.contacts]
    state.contacts = contacts
    for collision in begun:
        place = f"{collision.kind} on lane {collision.lane_id} at {collision.position_m:.1f} m"
        state.note(collision.collider, "collision", after=collision.victim, reasons=(place,))


def note_teleports(state: RunState, road: Road, before: Snapshot, snapshot: Snapshot) -> None:
    """Enter whom the world took off the road, whether bound, and from where.

    Where others than bound vehicles were in the step before is read only if somebody looks; so of them the
    edge is told, whoever looks.
    """
    edges = snapshot.teleported_from or ("",) * len(snapshot.teleported)
    for vehicle_id, edge in zip(snapshot.teleported, edges, strict=True):
        row, is_bound = before.index_of.get(vehicle_id), vehicle_id in state.vehicles
        place = f"edge {edge}" if edge else "the last edge of its route"
        if is_bound and row is not None:
            place = _place(road, before, row)
        state.note(vehicle_id, "teleport", "bound" if is_bound else "", "", (place,))


def _place(road: Road, snapshot: Snapshot, row: int) -> str:
    """Return in words where a bound vehicle was."""
    lane = int(snapshot.value("lane", row))
    where = f"lane {road.lane_ids[lane]} at {snapshot.value('lane_position_m', row):.1f} m"
    return f"{where if lane >= 0 else 'off the road'}, {snapshot.value('speed_mps', row):.1f} m/s"


def _note_road(state: RunState, snapshot: Snapshot) -> None:
    """Enter when a bound vehicle leaves the road, and when it is back; a released one is not back."""
    is_there = state.rows >= 0
    is_off = is_there.copy()
    is_off[is_there] = snapshot.of("lane", state.rows[is_there]) < 0
    if not state.off_road and not is_off.any():
        return
    names = state.fleet.bound_ids
    off = {names[index] for index in np.flatnonzero(is_off).tolist()}
    for name in sorted(off - state.off_road):
        state.note(name, "road", "on_road", "off_road", ("its front is on no lane",))
    nowhere = {names[index] for index in np.flatnonzero(~is_there).tolist()} & state.off_road
    for name in sorted((state.off_road & set(names)) - off - nowhere):
        state.note(name, "road", "off_road", "on_road")
    state.off_road = off | nowhere
