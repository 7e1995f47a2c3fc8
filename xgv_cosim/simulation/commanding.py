"""Sparse work between links, endpoints and the fleet: messages in, cells and events out."""

from __future__ import annotations

import math

import numpy as np

from xgv_cosim.commands import CommandColumns, CommandKind, MotionProfile, WrenchEffort
from xgv_cosim.endpoint import (
    CommandAccepted,
    CommandDropped,
    EndpointChanged,
    EndpointEvent,
    MessageRefused,
)
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.simulation.state import RunState


def receive(state: RunState) -> None:
    """Take what the links have brought to the endpoints (cost follows messages, not fleet size)."""
    for vehicle in state.vehicles:
        if vehicle.link is None:
            continue
        arrived = vehicle.link.poll()
        for fault in vehicle.link.take_faults():
            state.note(vehicle.vehicle_id, "stack_failed", reasons=(fault,))
        if vehicle.link_blocked:
            continue  # what a lost link carried is gone, it does not arrive late
        for sender, message in arrived:
            handle(state, vehicle, vehicle.endpoint.receive(message, sender, state.now_s))


def meet_deadlines(state: RunState) -> None:
    """Let endpoints do what is due at this tick, and end commands that have expired (XGV-43)."""
    fleet = state.fleet
    for slot in np.flatnonzero(fleet.command.expires_s <= state.now_s + 1e-9).tolist():
        vehicle = state.vehicles[str(fleet.ids[slot])]
        clear_command(fleet.command, slot)
        handle(state, vehicle, vehicle.endpoint.command_expired(state.now_s))
    for vehicle in state.vehicles:
        if vehicle.endpoint.next_deadline_s <= state.now_s + 1e-9:
            handle(state, vehicle, vehicle.endpoint.handle_deadline(state.now_s))


def next_deadline_s(state: RunState) -> float:
    """Return when the next command expires or the next endpoint wants to act."""
    expiry = float(state.fleet.command.expires_s.min())
    return min([expiry, *(vehicle.endpoint.next_deadline_s for vehicle in state.vehicles)])


def handle(state: RunState, vehicle: BoundVehicle, events: list[EndpointEvent]) -> None:
    """Turn an endpoint's events into cells and into rows of the journal."""
    fleet, slot, name = state.fleet, vehicle.slot, vehicle.vehicle_id
    for event in events:
        match event:
            case CommandAccepted():
                write_command(fleet.command, slot, event)
                vehicle.refusals.clear()
            case CommandDropped():
                if fleet.command.kind[slot] != CommandKind.NONE:
                    state.note(name, "command_dropped", reasons=(event.reason,))
                clear_command(fleet.command, slot)
            case MessageRefused():
                _note_refusal(state, vehicle, event)
            case EndpointChanged():
                state.note(name, event.kind, event.before, event.after, event.reasons)
    if events:
        copy_endpoint(state, vehicle)


def copy_endpoint(state: RunState, vehicle: BoundVehicle) -> None:
    """Write what the endpoint contributes to the columns: control and ready mode, its device bits."""
    fleet, slot, endpoint = state.fleet, vehicle.slot, vehicle.endpoint
    fleet.control_mode[slot] = endpoint.control_mode
    fleet.ready_mode[slot] = endpoint.ready_mode
    bits = vehicle.binding.profile.base_device_bits | endpoint.device_bits
    for kind, _code in state.devices.acting_on(vehicle.vehicle_id):
        effect = vehicle.binding.profile.effects.get(kind)
        bits |= effect.device_bits if effect is not None else 0
    fleet.safety_devices[slot] = bits


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


def _note_refusal(state: RunState, vehicle: BoundVehicle, refusal: MessageRefused) -> None:
    """Enter a refusal once for each reason and message type, until a command is accepted."""
    said = (type(refusal.message).__name__, refusal.reason)
    if said not in vehicle.refusals:
        vehicle.refusals.add(said)
        state.note(vehicle.vehicle_id, "command_refused", after=said[0], reasons=(refusal.reason,))
