"""Gear selector, engine and parking brake between commands and plant: what is switched, waits or drops."""

from __future__ import annotations

import numpy as np

from xgv_cosim.actuation import Gear, Longitudinal
from xgv_cosim.columns import BoolColumn, UInt8Column
from xgv_cosim.endpoint import DevicesCommanded
from xgv_cosim.fleet import Fleet
from xgv_cosim.observation import DeviceReading
from xgv_cosim.simulation import setpoints
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.simulation.state import RunState

_STATES = ("off", "on")
_WITHOUT_DRIVE = (
    "the computer has the speed, but nothing drives the car",
    "whoever controls it has to start the engine, in a pause anyone may",
)


def reading_of(fleet: Fleet, slot: int) -> DeviceReading:
    """Return what a vehicle reports of its discrete devices (XGV-57, XGV-60)."""
    return DeviceReading(
        gear=Gear(int(fleet.motion.gear[slot])),
        gear_wanted=Gear(int(fleet.gear_wanted[slot])),
        engine_on=bool(fleet.engine_on[slot]),
        parking_brake=bool(fleet.parking_brake[slot]),
    )


def switch(state: RunState, vehicle: BoundVehicle, commanded: DevicesCommanded) -> None:
    """Set gear selector, engine and parking brake; a mere repeat is no event (XGV-09, XGV-34, XGV-60)."""
    fleet, slot, name = state.fleet, vehicle.slot, vehicle.vehicle_id
    why = (commanded.reason,) if commanded.reason else ()
    if commanded.gear is not None and fleet.gear_wanted[slot] != commanded.gear:
        before = _word(fleet.gear_wanted[slot])
        fleet.gear_wanted[slot] = commanded.gear
        state.note(name, "gear", before, commanded.gear.name.lower(), why)
    for kind, column, wanted in (
        ("engine", fleet.engine_on, commanded.engine_on),
        ("parking_brake", fleet.parking_brake, commanded.parking_brake),
    ):
        if wanted is not None and column[slot] != wanted:
            column[slot] = wanted
            state.note(name, kind, _STATES[not wanted], _STATES[wanted], why)


def follow_axes(state: RunState, pausing: BoolColumn) -> None:
    """Draw what gear, engine and parking brake have to do with the axis modes now in force.

    A driver who takes the speed starts the engine and releases the parking brake. A commanded shift that
    has not come yet is dropped where the computer no longer shifts by command: in a pause, because a shift
    is motion-related (XGV-34), where a human has the speed, and where closed loop chooses the gear.

    Args:
        state: The run; its fleet has the modes of this tick.
        pausing: Where the mode is a pause.
    """
    fleet = state.fleet
    for slot in np.flatnonzero(setpoints.started_by_driver(fleet, fleet.longitudinal)).tolist():
        fleet.engine_on[slot] = True
        state.note(str(fleet.ids[slot]), "engine", "off", "on", ("started by the driver",))
    for slot in np.flatnonzero(setpoints.released_by_driver(fleet, fleet.longitudinal)).tolist():
        fleet.parking_brake[slot] = False
        state.note(str(fleet.ids[slot]), "parking_brake", "on", "off", ("released by the driver",))
    for slot in np.flatnonzero(setpoints.dropped_shifts(fleet, pausing)).tolist():
        name, wanted, kept = str(fleet.ids[slot]), _word(fleet.gear_wanted[slot]), fleet.motion.gear[slot]
        fleet.gear_wanted[slot] = kept
        state.waiting_shifts.pop(name, None)
        why = _why_dropped(state, state.vehicles[name], is_pausing=bool(pausing[slot]))
        state.note(name, "gear_shift_dropped", wanted, _word(kept), (why,))
    _note_waiting_shifts(state)
    _note_without_drive(state)


def note_gears(state: RunState, before: UInt8Column, after: UInt8Column) -> None:
    """Enter which gears have been engaged, and how long that had to wait (XGV-70)."""
    for slot in np.flatnonzero(before != after).tolist():
        name = str(state.fleet.ids[slot])
        waited = state.waiting_shifts.pop(name, None)
        why = () if waited is None else (f"waited {state.now_s - waited[1]:.2f} s",)
        state.note(name, "gear_engaged", _word(before[slot]), _word(after[slot]), why)


def forget(state: RunState, vehicle_id: str) -> None:
    """End what waits or stands, because the vehicle is released."""
    state.waiting_shifts.pop(vehicle_id, None)
    if vehicle_id in state.without_drive:
        _end_without_drive(state, vehicle_id)


def _note_waiting_shifts(state: RunState) -> None:
    """Enter, once each, commanded shifts that cannot begin yet, and what they wait for (XGV-70)."""
    fleet = state.fleet
    pending = ~fleet.frozen & (fleet.gear_wanted != fleet.motion.gear)
    for slot in np.flatnonzero(pending).tolist():
        name, wanted = fleet.ids[slot], int(fleet.gear_wanted[slot])
        announced = state.waiting_shifts.get(str(name))
        obstacles = _obstacles(fleet, slot)
        if name is None or not obstacles or (announced is not None and announced[0] == wanted):
            continue
        state.waiting_shifts[name] = wanted, state.now_s
        state.note(name, "gear_shift_waiting", _word(fleet.motion.gear[slot]), _word(wanted), obstacles)
    if state.waiting_shifts:  # a shift that was commanded back waits no more
        for name in [n for n in state.waiting_shifts if not pending[state.vehicles[n].slot]]:
            del state.waiting_shifts[name]


def _obstacles(fleet: Fleet, slot: int) -> tuple[str, ...]:
    """Return why a shift that is wanted cannot begin in this tick, nothing if it can."""
    if fleet.longitudinal[slot] != Longitudinal.OPEN_LOOP:
        return ("no wrench effort is in force",)
    limits, speed_mps = fleet.parameters, float(fleet.motion.speed_mps[slot])
    obstacles = []
    if abs(speed_mps) >= limits.shift_speed_mps[slot]:
        obstacles.append(f"the car moves at {speed_mps:.2f} m/s")
    if max(fleet.command.brake[slot], fleet.motion.brake[slot]) <= limits.shift_brake[slot]:
        obstacles.append("the brake is not pressed")
    if obstacles and setpoints.turns(fleet.motion.gear[slot], fleet.gear_wanted[slot]):
        obstacles.append("throttle is withheld until then")
    return tuple(obstacles)


def _why_dropped(state: RunState, vehicle: BoundVehicle, *, is_pausing: bool) -> str:
    fleet, slot = state.fleet, vehicle.slot
    mode = vehicle.binding.profile.safety_mode_name(int(fleet.safety_mode[slot])).replace("_", " ")
    if is_pausing:
        return f"{mode}: a gear shift is motion-related"
    if fleet.longitudinal[slot] == Longitudinal.CLOSED_LOOP:
        return "closed-loop control chooses the gear"
    return f"{mode}: the computer does not shift"


def _note_without_drive(state: RunState) -> None:
    """Enter where the computer is to drive with the engine off, when it begins and when it ends (XGV-31)."""
    fleet = state.fleet
    stands = np.flatnonzero(setpoints.without_drive(fleet)).tolist()
    if not stands and not state.without_drive:
        return
    names = {str(fleet.ids[slot]) for slot in stands if fleet.ids[slot] is not None}
    for name in [name for name in state.without_drive if name not in names]:
        _end_without_drive(state, name)
    for name in sorted(names - state.without_drive.keys()):
        state.without_drive[name] = state.now_s
        state.note(name, "without_drive", "", "engine off", _WITHOUT_DRIVE)


def _end_without_drive(state: RunState, name: str) -> None:
    lasted_s = state.now_s - state.without_drive.pop(name)
    state.note(name, "without_drive", "engine off", "", (f"lasted {lasted_s:.2f} s",))


def _word(gear: int | np.uint8) -> str:
    return Gear(int(gear)).name.lower()
