"""Sparse work between links, endpoints and the fleet: messages in, cells and events out."""

from __future__ import annotations

import math

import numpy as np

from jaus.address import JausAddress
from xgv_cosim import kernel
from xgv_cosim.clock import tick_at_or_after
from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
from xgv_cosim.commands import CommandColumns, CommandKind, MotionProfile, WrenchEffort
from xgv_cosim.endpoint import (
    CommandAccepted,
    CommandDropped,
    ControlPreempted,
    DevicesCommanded,
    EndpointChanged,
    EndpointEvent,
    MessageRefused,
    StackMessage,
)
from xgv_cosim.plant.imperfections import delay_s
from xgv_cosim.simulation import drivetrain
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.simulation.state import RunState


def receive(state: RunState) -> None:
    """Take what links and operators have brought to the endpoints (cost follows messages)."""
    _deliver_posted(state)
    for vehicle, link in state.vehicles.linked:
        arrived = link.poll()
        for fault in link.take_faults():
            state.note(vehicle.vehicle_id, "stack_failed", reasons=(fault,))
        if not (arrived and vehicle.devices.hears_stack and vehicle.is_computing):
            continue  # what a lost link carried, or nobody read, is gone; it does not arrive late
        for sender, message in arrived:
            take_in(state, vehicle, sender, message)


def _deliver_posted(state: RunState) -> None:
    """Hand over what was sent from Python; it travels with what the stack sends, or is lost with it."""
    posted, state.posted = state.posted, []
    for vehicle_id, sender, message in posted:
        if vehicle_id not in state.vehicles:
            continue  # it has left the world since
        vehicle = state.vehicles[vehicle_id]
        if vehicle.devices.hears_stack and vehicle.is_computing:
            take_in(state, vehicle, sender, message)


def take_in(state: RunState, vehicle: BoundVehicle, sender: JausAddress, message: StackMessage) -> None:
    """Let a message that has arrived act, at once or when its latency is over; none overtakes another.

    Whoever calls has seen to it that the vehicle hears it: its stack is connected, and it computes.
    """
    limits, slot = state.fleet.parameters, vehicle.slot
    latency_s, jitter_s = float(limits.command_latency_s[slot]), float(limits.command_jitter_s[slot])
    if latency_s == jitter_s == 0.0:
        handle(state, vehicle, vehicle.endpoint.receive(message, sender, state.now_s))
        return
    waiting, tick = vehicle.on_the_way, state.clock.tick
    counter = (tick << 16) + len(waiting)
    later_s = delay_s(latency_s, jitter_s, int(state.fleet.draw_key[slot]), counter)
    acts = max(tick_at_or_after(state.now_s + later_s), waiting[-1][0] if waiting else tick)
    waiting.append((acts, sender, message))
    state.alarms.touch(vehicle)


def _deliver_due(state: RunState) -> None:
    """Hand over what was under way; who does not compute by then reads nothing (XGV-32, XGV-67)."""
    for vehicle in state.alarms.due(state.now_s):
        waiting = vehicle.on_the_way
        while waiting and waiting[0][0] <= state.clock.tick:
            _, sender, message = waiting.popleft()
            state.alarms.touch(vehicle)
            if vehicle.is_computing:
                handle(state, vehicle, vehicle.endpoint.receive(message, sender, state.now_s))


def meet_deadlines(state: RunState) -> None:
    """Let endpoints do what is due at this tick, and end commands that have expired (XGV-43)."""
    _deliver_due(state)
    fleet = state.fleet
    if next_expiry_s(state) <= state.now_s + 1e-9:
        due = (fleet.command.expires_s <= state.now_s + 1e-9) & ~fleet.frozen
        for slot in np.flatnonzero(due).tolist():
            vehicle = state.vehicles[str(fleet.ids[slot])]
            clear_command(fleet.command, slot)
            handle(state, vehicle, vehicle.endpoint.command_expired(state.now_s))
    for vehicle in state.alarms.due(state.now_s):
        if vehicle.is_computing and vehicle.endpoint.next_deadline_s <= state.now_s + 1e-9:
            handle(state, vehicle, vehicle.endpoint.handle_deadline(state.now_s))


def next_expiry_s(state: RunState) -> float:
    """Return when the next command expires; the clock of a frozen controller stands still (XGV-67)."""
    return kernel.next_expiry(state.fleet.command.expires_s, state.fleet.frozen)


def handle(state: RunState, vehicle: BoundVehicle, events: list[EndpointEvent]) -> None:
    """Turn an endpoint's events into cells and into rows of the journal."""
    fleet, slot, name = state.fleet, vehicle.slot, vehicle.vehicle_id
    state.alarms.touch(vehicle)
    for event in events:
        match event:
            case CommandAccepted():
                write_command(fleet.command, slot, event)
                accepted = name_of(event.command)
                vehicle.refusals = {said for said in vehicle.refusals if said[0] != accepted}
            case CommandDropped():
                if fleet.command.kind[slot] != CommandKind.NONE:
                    state.note(name, "command_dropped", reasons=(event.reason,))
                clear_command(fleet.command, slot)
            case DevicesCommanded():
                drivetrain.switch(state, vehicle, event)
            case MessageRefused():
                note_refusal(state, vehicle, name_of(event.message), event.reason)
            case EndpointChanged():
                state.note(name, event.kind, event.before, event.after, event.reasons)
            case ControlPreempted():
                state.note(name, "control_preempted", event.before, event.after, event.reasons)
                hold(state, vehicle, vehicle.devices.control_preempted())
    if events:
        follow_devices(state, vehicle)


def follow_devices(state: RunState, vehicle: BoundVehicle) -> None:
    """Let a stop in force keep the vehicle from being resumed (XGV-37), and write the mode inputs."""
    if vehicle.is_computing:
        why = vehicle.devices.follow_stops(vehicle.endpoint.device_bits)
        hold(state, vehicle, why)
    copy_endpoint(state, vehicle)


def hold(state: RunState, vehicle: BoundVehicle, why: str) -> None:
    """Refuse Resume as the devices say, and set the vehicle to standby if there is a reason (XGV-37)."""
    vehicle.endpoint.refuse_resume(vehicle.devices.resume_refusal)
    state.alarms.touch(vehicle)
    if why:
        handle(state, vehicle, vehicle.endpoint.stand_by(why, state.now_s))


def copy_endpoint(state: RunState, vehicle: BoundVehicle) -> None:
    """Write the inputs of the modes: control and ready mode, and the device word.

    A frozen controller computes neither mode; an inactive one has none, code 0 (XGV-32, XGV-67).
    """
    fleet, slot, endpoint, devices = state.fleet, vehicle.slot, vehicle.endpoint, vehicle.devices
    fleet.hears_stack[slot] = vehicle.is_computing and devices.hears_stack
    if not devices.is_frozen:
        fleet.control_mode[slot] = endpoint.control_mode if devices.is_active else 0
        fleet.ready_mode[slot] = endpoint.ready_mode if devices.is_active else 0
    bits = devices.bits | (endpoint.device_bits if devices.is_active else 0)
    fleet.lost_functions[slot] = endpoint.lost_functions if devices.is_active else 0
    if bits != fleet.safety_devices[slot]:
        fleet.safety_devices[slot] = bits
        if vehicle.is_computing:
            tell_devices(state, vehicle)


def tell_devices(state: RunState, vehicle: BoundVehicle) -> None:
    """Tell an endpoint the device word in force, from which its warnings follow (XGV-38)."""
    bits = vehicle.devices.bits | vehicle.endpoint.device_bits
    handle(state, vehicle, vehicle.endpoint.devices_changed(bits, state.now_s))


def renew_motions(
    state: RunState, slots: IntColumn, speed_mps: FloatColumn, curvature_per_m: FloatColumn, lasts_s: float
) -> BoolColumn:
    """Put new targets into motion profiles that are in force, and let them end ``lasts_s`` from now (XGV-43).

    Limits of acceleration and curvature rate stay. A slot without a motion profile in force is left alone:
    only a message can bring one into force. So is one whose controller does not hear its stack now, or does
    not compute (XGV-32, XGV-67). It is no message: for the watch over silent controllers nobody has spoken
    (XGV-65).

    Returns:
        Which slots were given their target.
    """
    command, hears = state.fleet.command, state.fleet.hears_stack[slots]
    renewed: BoolColumn = hears & (command.kind[slots] == CommandKind.MOTION_PROFILE)
    whom = slots[renewed]
    command.speed_mps[whom] = speed_mps[renewed]
    command.curvature_per_m[whom] = curvature_per_m[renewed]
    command.expires_s[whom] = state.now_s + lasts_s
    return renewed


def write_command(command: CommandColumns, slot: int, accepted: CommandAccepted) -> None:
    """Write an accepted command into the cells of its slot."""
    command.expires_s[slot] = accepted.expires_s
    match accepted.command:
        case MotionProfile() as motion:
            command.kind[slot] = CommandKind.MOTION_PROFILE
            command.speed_mps[slot] = motion.speed_mps
            command.max_accel_mps2[slot] = motion.max_accel_mps2
            command.curvature_per_m[slot] = motion.curvature_per_m
            command.max_curvature_rate_per_m_s[slot] = motion.max_curvature_rate_per_m_s
        case WrenchEffort() as wrench:
            command.kind[slot] = CommandKind.WRENCH_EFFORT
            command.throttle[slot] = wrench.throttle
            command.brake[slot] = wrench.brake
            command.steering[slot] = wrench.steering


def clear_command(command: CommandColumns, slot: int) -> None:
    """Leave a slot without a live command (XGV-70)."""
    command.kind[slot] = CommandKind.NONE
    command.expires_s[slot] = math.inf


def name_of(message: StackMessage) -> str:
    """Return what a message is called in the journal; efforts are efforts, with all their axes or without."""
    return WrenchEffort.__name__ if isinstance(message, WrenchEffort) else type(message).__name__


def note_refusal(state: RunState, vehicle: BoundVehicle, kind: str, reason: str) -> None:
    """Enter a refusal once for each reason and message type, until one of that type is accepted.

    Where there are too many, as of strangers on a network, not all of them are told.
    """
    said = kind, reason
    if said not in vehicle.refusals and vehicle.refusal_budget.take(state.now_s):
        vehicle.refusals.add(said)
        state.note(vehicle.vehicle_id, "command_refused", after=kind, reasons=(reason,))
