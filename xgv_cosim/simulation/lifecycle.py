"""Binding and releasing: a vehicle of the world gets a slot, an endpoint and a link, and loses them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from xgv_cosim.actuation import CouplingKind, Driver, Lateral, Longitudinal
from xgv_cosim.errors import ScenarioError
from xgv_cosim.fleet import Fleet
from xgv_cosim.plant.imperfections import draw_key
from xgv_cosim.simulation import commanding, drivetrain, grip, reporting, requests
from xgv_cosim.simulation.addresses import stack_address, subsystem_of
from xgv_cosim.simulation.binding import Binding, BoundVehicle, Selector, StartKind
from xgv_cosim.simulation.state import RunState
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.worlds.base import World

STANDSTILL_MPS = 0.1


def apply_couplings(state: RunState, world: World) -> None:
    """Write vehicles as operators asked for since the last step."""
    requested, state.couplings_requested = state.couplings_requested, []
    for vehicle_id, kind in requested:
        if vehicle_id not in state.vehicles:
            continue  # released since
        vehicle = state.vehicles[vehicle_id]
        before = vehicle.binding.coupling
        if kind is before:
            continue
        world.set_coupling(vehicle_id, kind)
        vehicle.binding = replace(vehicle.binding, coupling=kind)
        state.fleet.keeps_lane[vehicle.slot] = kind is CouplingKind.LANE
        state.note(vehicle_id, "coupling", before.value, kind.value)


def bind_new(state: RunState, world: World, selector: Selector, snapshot: Snapshot) -> bool:
    """Bind who is new and whom the selector names, and whose time has come; return whether there was any."""
    tick, before = state.clock.tick, len(state.fleet.bound_ids)
    due = [name for name, binding in state.expected.items() if binding.from_tick <= tick]
    for vehicle_id in dict.fromkeys((*due, *snapshot.departed)):
        expected = state.expected.pop(vehicle_id, None)
        row = snapshot.index_of.get(vehicle_id)
        if row is None and expected is not None and vehicle_id not in snapshot.arrived:
            state.expected[vehicle_id] = expected  # waits for a gap beside the road, or is in a teleport
        if row is None or vehicle_id in state.vehicles:
            continue
        binding = expected or selector(world.traveller(vehicle_id))
        if binding is None or (binding.until_tick is not None and binding.until_tick <= tick):
            continue
        if binding.from_tick > tick:
            state.expected[vehicle_id] = binding
        else:
            bind_or_unpark(state, world, snapshot, vehicle_id, binding)
    return len(state.fleet.bound_ids) > before


def release_due(state: RunState, world: World) -> None:
    """Give back the vehicles whose time as bound ones is over."""
    tick = state.clock.tick
    if tick < state.vehicles.first_until_tick:
        return
    for vehicle in list(state.vehicles):
        until_tick = vehicle.binding.until_tick
        if until_tick is not None and until_tick <= tick:
            give_back(state, world, vehicle.vehicle_id, "its time as a bound vehicle is over")


def give_back(state: RunState, world: World, vehicle_id: str, why: str) -> None:
    """Release a vehicle that drives on with the world's driver.

    Raises:
        UnknownVehicleError: No such vehicle is bound now.
    """
    release(state, vehicle_id, why)
    world.release(vehicle_id)


def bind_or_unpark(
    state: RunState, world: World, snapshot: Snapshot, vehicle_id: str, binding: Binding
) -> None:
    """Bind one vehicle of the snapshot; one that is parked beside the road as soon as it has left its place.

    With ``bind.start = cold`` it is bound where it stands: nobody drives it until it is powered up.

    Raises:
        ScenarioError: See ``bind``.
    """
    stops = world.stops_of(vehicle_id)
    if binding.start is StartKind.COLD or world.unpark(vehicle_id):
        bind(state, world, snapshot, vehicle_id, binding)
    else:
        state.expected[vehicle_id] = binding
    if stops:
        state.note(vehicle_id, "stops_ignored", reasons=stops)


def bind(state: RunState, world: World, snapshot: Snapshot, vehicle_id: str, binding: Binding) -> None:
    """Bind one vehicle of the snapshot: occupy a slot, fill its row, connect its stack.

    Raises:
        ScenarioError: ``bind.start = cold`` while the vehicle moves.
    """
    row = snapshot.index_of[vehicle_id]
    speed_mps = snapshot.value("speed_mps", row)
    if binding.start is StartKind.COLD and speed_mps > STANDSTILL_MPS:
        raise ScenarioError(
            f"vehicle {vehicle_id!r}: bind.start cold needs a vehicle at standstill, got {speed_mps:.1f} m/s "
            f"at {state.now_s:g} s; use start: handover, or let it depart with departSpeed 0"
        )
    world.bind(vehicle_id, binding.coupling)
    slot = state.fleet.occupy(vehicle_id)
    fill_row(state.fleet, slot, snapshot, row, binding)
    vehicle = BoundVehicle(
        traveller=world.traveller(vehicle_id),
        slot=slot,
        binding=binding,
        endpoint=binding.profile.new_endpoint(vehicle_id, state.now_s, subsystem_of(slot)),
        devices=binding.profile.new_devices(vehicle_id, state.now_s, state.transmitter(binding.transmitter)),
        link=binding.new_link(vehicle_id, stack_address(slot)) if binding.new_link else None,
    )
    state.fleet.draw_key[slot] = draw_key(vehicle_id, binding.profile.seed)
    vehicle.endpoint.partial_mode_entered(binding.partial_mode)
    state.vehicles.add(vehicle)
    state.alarms.touch(vehicle)
    words = (
        f"coupling {binding.coupling.value}",
        f"start {binding.start.value}",
        f"driver {Driver(binding.driver).name.lower()}",
    )
    state.note(vehicle_id, "bound", after=binding.profile.name, reasons=words)
    _note_tight_turns(state, world, vehicle)
    commanding.copy_endpoint(state, vehicle)
    requests.meet_injections(state, vehicle)


def _note_tight_turns(state: RunState, world: World, vehicle: BoundVehicle) -> None:
    """Enter where the vehicle is to turn more tightly than it can; it cannot keep to its lane there."""
    radius_m = 1.0 / vehicle.binding.parameters.max_curvature_per_m
    turns = world.tight_turns_of(vehicle.vehicle_id, radius_m)
    if turns:
        state.note(vehicle.vehicle_id, "turns_too_tight", "", f"{radius_m:.1f} m", turns)


def release_gone(state: RunState, world: World, snapshot: Snapshot) -> None:
    """Release the bound vehicles that the world no longer has."""
    gone = np.flatnonzero(state.rows < 0).tolist()
    for vehicle in [state.vehicles.in_slot_order[index] for index in gone]:
        why = "arrived" if vehicle.vehicle_id in snapshot.arrived else "left the world"
        give_back(state, world, vehicle.vehicle_id, why)


def release(state: RunState, vehicle_id: str, why: str) -> None:
    """Free the slot of a vehicle and end its link."""
    reporting.end_lasting(state, state.vehicle(vehicle_id))
    drivetrain.forget(state, vehicle_id)
    grip.forget(state, vehicle_id)
    vehicle = state.vehicles.remove(vehicle_id)
    state.alarms.forget(vehicle)
    if vehicle.link is not None:
        vehicle.link.close()
    state.fleet.vacate(vehicle_id)
    state.released.add(vehicle_id)
    state.note(vehicle_id, "released", before=vehicle.binding.profile.name, reasons=(why,))


def lose(state: RunState, vehicle_id: str, why: str) -> None:
    """Forget a vehicle that somebody else takes out of the world; another may have its id later."""
    if vehicle_id in state.vehicles:
        release(state, vehicle_id, why)
    state.expected.pop(vehicle_id, None)
    state.crashed.discard(vehicle_id)


def fill_row(fleet: Fleet, slot: int, snapshot: Snapshot, row: int, binding: Binding) -> None:
    """Write the first state of a slot: the vehicle as the world has it."""
    for column, name in zip(fleet.parameters, fleet.parameters._fields, strict=True):
        column[slot] = getattr(binding.parameters, name)
    heading = snapshot.value("heading_rad", row)
    reach = binding.parameters.wheelbase_m + binding.parameters.front_overhang_m
    fleet.motion.x_m[slot] = snapshot.value("front_x_m", row) - reach * math.cos(heading)
    fleet.motion.y_m[slot] = snapshot.value("front_y_m", row) - reach * math.sin(heading)
    fleet.motion.heading_rad[slot] = heading
    fleet.motion.speed_mps[slot] = fleet.reference.speed_mps[slot] = snapshot.value("speed_mps", row)
    fleet.motion.accel_mps2[slot] = snapshot.value("accel_mps2", row)
    fleet.safety_devices[slot] = binding.profile.base_device_bits
    fleet.partial_mode[slot] = binding.partial_mode
    fleet.driver[slot] = binding.driver
    fleet.keeps_lane[slot] = binding.coupling is CouplingKind.LANE
    fleet.driver_reaction_s[slot] = binding.driver_reaction_s
    fleet.driver_steered[slot] = True  # until now the world's driver has driven it
    cold = binding.start is StartKind.COLD
    fleet.handed_over[slot] = cold
    fleet.longitudinal[slot] = Longitudinal.HOLD if cold else Longitudinal.DRIVER
    fleet.lateral[slot] = Lateral.FREE if cold else Lateral.DRIVER
    stop = binding.profile.stop_settings
    fleet.stop_decel_mps2[slot] = stop.decel_mps2
    fleet.stop_hold_brake[slot] = stop.hold_brake
    share = binding.parameters.unassisted_brake_share if stop.brake_needs_engine else 1.0
    fleet.brake_share_without_engine[slot] = share
    fleet.centres_without_command[slot] = stop.centres_without_command
