"""Edges of safety devices, errors and links: scheduled injections and operators' requests."""

from __future__ import annotations

import math
from difflib import get_close_matches

from xgv_cosim.clock import tick_at_or_after
from xgv_cosim.injection import InjectionKind
from xgv_cosim.simulation import commanding, moding, safety
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.simulation.devices import OPERATOR, Edge
from xgv_cosim.simulation.state import RunState
from xgv_cosim.worlds.base import World


def apply_requests(state: RunState) -> None:
    """Apply what operators asked for since the last step, but of vehicles that are gone since."""
    requested, state.requested = state.requested, []
    for request in requested:
        edges = state.devices.change(
            OPERATOR, request.vehicle_id, request.kind, request.code, begins=request.begins
        )
        apply_edges(state, edges)
    operated, state.operated = state.operated, []
    for vehicle_id, action in operated:
        if vehicle_id in state.vehicles:
            safety.operate(state, state.vehicles[vehicle_id], action)
    to_clear, state.errors_to_clear = state.errors_to_clear, []
    for vehicle_id in filter(state.vehicles.__contains__, to_clear):
        vehicle = state.vehicles[vehicle_id]
        if vehicle.is_computing:
            commanding.handle(state, vehicle, vehicle.endpoint.clear_errors(state.now_s))
        else:  # nobody answers him at the display (XGV-32, XGV-67)
            why = ("the controller does not compute",)
            state.note(vehicle_id, "operator_refused", after="clear_errors", reasons=why)
    partial_requested, state.partial_requested = state.partial_requested, []
    for vehicle_id, bits in partial_requested:
        if vehicle_id not in state.vehicles:
            continue
        vehicle = state.vehicles[vehicle_id]
        slot = vehicle.slot
        before = int(state.fleet.partial_mode[slot])
        state.fleet.partial_mode[slot] = bits
        vehicle.endpoint.partial_mode_entered(bits)
        if bits != before:
            state.note(vehicle_id, "partial_mode", PARTIAL_NAMES[before], PARTIAL_NAMES[bits])


PARTIAL_NAMES = ("full", "manual_steering", "manual_speed", "both_manual")
"""Names of the partial mode bits (XGV-51)."""


def apply_scheduled(state: RunState, world: World, tick: int) -> None:
    """Apply the injections whose edge lies on ``tick`` (XGV-71).

    One that names a vehicle of which the world has not heard is told like one whose pattern matches nobody;
    it acts on the vehicle if that is bound while it lasts.
    """
    if not state.devices.ticks_between(tick, tick + 1):
        return
    bound = [vehicle.traveller for vehicle in state.vehicles]
    edges = state.devices.due(tick, bound)
    for injection in state.devices.chose_nobody(tick):
        whom = f"its selector {injection.selector}" if injection.selector else "its selector"
        reason = f"{whom} matches no vehicle that is bound now"
        state.note("", "injection_without_vehicle", after=injection.kind.value, reasons=(reason,))
    apply_edges(state, edges, world)


def next_edge(state: RunState, tick: int, end: int) -> int:
    """Return the next tick after ``tick`` on which something acts, at most ``end``."""
    ticks = state.devices.ticks_between(tick + 1, end)
    for deadline_s in (
        commanding.next_expiry_s(state),
        state.alarms.next_s,
        moding.next_take_over_s(state.fleet),
    ):
        if math.isfinite(deadline_s):
            ticks.append(max(tick + 1, tick_at_or_after(deadline_s)))
    return min([end, *ticks])


def apply_edges(state: RunState, edges: list[Edge], world: World | None = None) -> None:
    """Let each edge act on its vehicle, and enter it into the journal.

    Args:
        state: The run.
        edges: What begins and ends.
        world: Asked whether it knows a vehicle that is not bound; None where every one is.
    """
    for edge in edges:
        name = edge.kind.value
        if edge.transmitter:
            _use_transmitter(state, edge)
            continue
        if edge.vehicle_id not in state.vehicles:
            _let_go(state, edge)
            if edge.begins:
                reasons = _why_nobody(state, edge.vehicle_id, world)
                state.note(edge.vehicle_id, "injection_without_vehicle", after=name, reasons=reasons)
            continue
        vehicle = state.vehicles[edge.vehicle_id]
        if edge.kind not in vehicle.binding.profile.effects:
            reason = f"profile {vehicle.binding.profile.name} has no {name}"
            state.note(edge.vehicle_id, "injection_unsupported", after=name, reasons=(reason,))
            continue
        before, after = ("", name) if edge.begins else (name, "")
        code = () if edge.code is None else (f"code {edge.code}",)
        state.note(edge.vehicle_id, "injection", before, after, code)
        if edge.kind in _PRESSES and vehicle.binding.transmitter:
            others = [other for other in _served(state, vehicle.binding.transmitter) if other is not vehicle]
            words = f"transmitter {vehicle.binding.transmitter}, used for {edge.vehicle_id}"
            _note_served(state, others, before, after, words)
        safety.apply(state, vehicle, edge.kind, edge.code, begins=edge.begins)
        if edge.kind in _PRESSES:
            _touch_served(state, vehicle.binding.transmitter)


def _why_nobody(state: RunState, name: str, world: World | None) -> tuple[str, ...]:
    """Return why a vehicle that an injection names does not meet it now."""
    if world is None or name in state.released or world.knows(name):
        return ("the vehicle is not bound now; if it is bound while this lasts, it meets it then",)
    near = get_close_matches(name, state.fleet.bound_ids, 1)
    guess = (f"did you mean {near[0]!r}?",) if near else ()
    return ("the world knows no vehicle of this name now", *guess)


_PRESSES = (InjectionKind.ESTOP_PAUSE, InjectionKind.ESTOP_DISABLE)
"""What is done at a transmitter also when it is injected into one vehicle: all that share it hear it."""


def _use_transmitter(state: RunState, edge: Edge) -> None:
    """Press or release a shared transmitter, or take its radio away; its receivers find out by themselves."""
    transmitter = state.transmitter(edge.transmitter)
    if transmitter is None:
        raise ValueError("an edge at a transmitter without a name")
    transmitter.use(edge.kind, "", state.now_s, begins=edge.begins)
    served = _touch_served(state, edge.transmitter)
    before, after = ("", edge.kind.value) if edge.begins else (edge.kind.value, "")
    _note_served(state, served, before, after, f"transmitter {edge.transmitter}")
    if edge.begins and not served:
        reason = f"transmitter {edge.transmitter} serves no vehicle now; one that is bound later meets it"
        state.note("", "injection_without_vehicle", after=edge.kind.value, reasons=(reason,))


def _let_go(state: RunState, edge: Edge) -> None:
    """End what a vehicle that has left held at a transmitter: the car is gone, the radio is not."""
    if edge.kind in _PRESSES and not edge.begins:
        for name, transmitter in state.transmitters.items():
            transmitter.use(edge.kind, edge.vehicle_id, state.now_s, begins=False)
            _touch_served(state, name)


def _served(state: RunState, transmitter: str) -> list[BoundVehicle]:
    """Return who hears a transmitter that vehicles share; nobody without its name."""
    return [
        vehicle for vehicle in state.vehicles if transmitter and vehicle.binding.transmitter == transmitter
    ]


def _touch_served(state: RunState, transmitter: str) -> list[BoundVehicle]:
    """Let everybody who hears a transmitter look anew at when something of it arrives; return them."""
    served = _served(state, transmitter)
    for vehicle in served:
        state.alarms.touch(vehicle)
    return served


def _note_served(state: RunState, served: list[BoundVehicle], before: str, after: str, words: str) -> None:
    for vehicle in served:
        state.note(vehicle.vehicle_id, "injection", before, after, (words,))


def meet_injections(state: RunState, vehicle: BoundVehicle) -> None:
    """Let a vehicle that was just bound meet the injections that act already."""
    if transmitter := vehicle.binding.transmitter:
        for kind in state.devices.acting_at(transmitter):
            _note_served(state, [vehicle], "", kind.value, f"transmitter {transmitter}")
    for kind, code in state.devices.acting_on(vehicle.vehicle_id):
        apply_edges(state, [Edge(vehicle.vehicle_id, kind, code, begins=True)])
