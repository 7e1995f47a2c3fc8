"""Keeps safety devices, endpoint and columns of a vehicle in step: errors, freezing, booting, standby."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.endpoint import EndpointChanged
from xgv_cosim.injection import InjectionKind, OperatorAction
from xgv_cosim.simulation import commanding
from xgv_cosim.simulation.addresses import subsystem_of
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.simulation.state import RunState


def apply(
    state: RunState, vehicle: BoundVehicle, kind: InjectionKind, code: int | None, *, begins: bool
) -> None:
    """Let an injection that the vehicle's profile supports begin or end."""
    was_active = vehicle.devices.is_active
    _take(state, vehicle, vehicle.devices.apply(kind, code, state.now_s, begins=begins), was_active)


def operate(state: RunState, vehicle: BoundVehicle, action: OperatorAction) -> None:
    """Let the operator do something at the vehicle."""
    _take(state, vehicle, vehicle.devices.operate(action, state.now_s), vehicle.devices.is_active)


def meet_deadlines(state: RunState) -> None:
    """Let devices do what is due at this tick (XGV-71)."""
    for vehicle in state.alarms.due(state.now_s):
        devices = vehicle.devices
        if devices.next_deadline_s <= state.now_s + 1e-9:
            _take(state, vehicle, devices.handle_deadline(state.now_s), devices.is_active)


def _take(
    state: RunState, vehicle: BoundVehicle, events: Sequence[EndpointChanged], was_active: bool
) -> None:
    """Draw the consequences of a change of devices, in the order controller, errors, modes."""
    state.alarms.touch(vehicle)
    for event in events:
        state.note(vehicle.vehicle_id, event.kind, event.before, event.after, event.reasons)
    is_active = vehicle.devices.is_active
    if was_active and not is_active:
        _shut_down(state, vehicle)
    elif is_active and not was_active:
        _boot(state, vehicle)
    _follow_freeze(state, vehicle)
    if vehicle.is_computing:
        _follow_errors(state, vehicle)
    commanding.follow_devices(state, vehicle)


def _follow_errors(state: RunState, vehicle: BoundVehicle) -> None:
    """Tell the endpoint which errors have begun or gone; a controller that computes finds them (XGV-38)."""
    before, vehicle.raised = vehicle.raised, vehicle.devices.errors
    for code in sorted(before - vehicle.raised):
        commanding.handle(state, vehicle, vehicle.endpoint.clear_error(code, state.now_s))
    for code in sorted(vehicle.raised - before):
        commanding.handle(state, vehicle, vehicle.endpoint.raise_error(code, state.now_s))


def _follow_freeze(state: RunState, vehicle: BoundVehicle) -> None:
    """Let a controller that freezes hold what it puts out; an axis that it had released stays so (XGV-67).

    Its clock stands still as well: when it goes on, commands and time-outs have as long to run as before.
    """
    fleet, slot, frozen = state.fleet, vehicle.slot, vehicle.devices.is_frozen
    if frozen and not fleet.frozen[slot]:
        held, motion = fleet.held, fleet.motion
        longitudinal, lateral = int(fleet.longitudinal[slot]), int(fleet.lateral[slot])
        released_speed = longitudinal in {Longitudinal.FREE, Longitudinal.DRIVER}
        released_steering = lateral in {Lateral.FREE, Lateral.DRIVER}
        held.safety_mode[slot] = fleet.safety_mode[slot]
        held.governed[slot] = longitudinal
        held.longitudinal[slot] = longitudinal if released_speed else Longitudinal.OPEN_LOOP
        held.lateral[slot] = lateral if released_steering else Lateral.OPEN_LOOP
        held.throttle[slot] = motion.throttle[slot]
        held.brake[slot] = motion.brake[slot]
        held.steer_rad[slot] = motion.steer_rad[slot]
        vehicle.frozen_since_s = state.now_s
    elif not frozen and fleet.frozen[slot]:
        stopped_s = state.now_s - vehicle.frozen_since_s
        fleet.command.expires_s[slot] += stopped_s
        vehicle.endpoint.delay(stopped_s)
        fleet.frozen[slot] = False
        if vehicle.is_computing:
            _catch_up(state, vehicle)
    fleet.frozen[slot] = frozen


def _catch_up(state: RunState, vehicle: BoundVehicle) -> None:
    """Tell a controller that computes again what it has not noticed: devices, and a hardware override."""
    fleet, slot = state.fleet, vehicle.slot
    mode = int(fleet.safety_mode[slot])
    if mode != fleet.held.safety_mode[slot]:
        commanding.handle(state, vehicle, vehicle.endpoint.safety_mode_entered(mode, state.now_s))
    commanding.tell_devices(state, vehicle)


def _shut_down(state: RunState, vehicle: BoundVehicle) -> None:
    """Leave a system that is not booted without command and modes: a stock car (XGV-01, XGV-32)."""
    commanding.clear_command(state.fleet.command, vehicle.slot)
    for kind, mode in _modes_of(vehicle):
        state.note(vehicle.vehicle_id, kind, mode, "unknown", ("system not active",))


def _boot(state: RunState, vehicle: BoundVehicle) -> None:
    """Power the system up: it knows nothing of who controlled it, and finds its errors anew."""
    subsystem = subsystem_of(vehicle.slot)
    vehicle.endpoint = vehicle.binding.profile.new_endpoint(vehicle.vehicle_id, state.now_s, subsystem)
    vehicle.endpoint.partial_mode_entered(int(state.fleet.partial_mode[vehicle.slot]))
    vehicle.raised, vehicle.drags = frozenset(), False
    for kind, mode in _modes_of(vehicle):
        state.note(vehicle.vehicle_id, kind, "unknown", mode, ("system powered up",))
    if vehicle.is_computing:
        commanding.tell_devices(state, vehicle)


def _modes_of(vehicle: BoundVehicle) -> list[tuple[str, str]]:
    """Return control and ready mode by name; a profile whose codes have no names shows the codes."""
    modes = (("control_mode", vehicle.endpoint.control_mode), ("ready_mode", vehicle.endpoint.ready_mode))
    return [(kind, mode.name.lower() if isinstance(mode, Enum) else str(mode)) for kind, mode in modes]
