"""Observations to the stacks: perception joined with what each endpoint reports of itself."""

from __future__ import annotations

import numpy as np

from xgv_cosim.fleet_columns import Motion
from xgv_cosim.perception import ModeView, observe
from xgv_cosim.plant.imperfections import measured_speed_mps
from xgv_cosim.simulation import drivetrain, moding, reporting
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.simulation.state import RunState
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.worlds.base import World


def mode_view(state: RunState, vehicle: BoundVehicle) -> ModeView:
    """Return what a vehicle reports of its own modes and components.

    A controller that is frozen or not booted is silent: the last report stands (XGV-32, XGV-67). So does one
    from which nothing has changed (``note_changes``).
    """
    fleet, endpoint = state.fleet, vehicle.endpoint
    if vehicle.last_view is not None and (vehicle.is_viewed or not vehicle.is_computing):
        return vehicle.last_view
    vehicle.is_viewed = True
    vehicle.last_view = ModeView(
        safety_mode=vehicle.binding.profile.safety_mode_name(int(fleet.safety_mode[vehicle.slot])),
        reasons=reporting.reasons_of(state, vehicle),
        component_status=endpoint.component_status,
        component_controller=endpoint.component_controller,
        devices=drivetrain.reading_of(fleet, vehicle.slot),
    )
    return vehicle.last_view


def note_changes(state: RunState) -> None:
    """Have those report anew of whose modes, components and devices anything may have changed."""
    fleet = state.fleet
    if state.viewed.shape[1] != fleet.num_slots:
        state.viewed = np.full((2, fleet.num_slots), -1)
    before = state.viewed.copy()
    if moding.has_changed(fleet, state.viewed, state.now_s):
        for slot in np.flatnonzero((before != state.viewed).any(axis=0)).tolist():
            if fleet.ids[slot] is not None:
                state.vehicles[str(fleet.ids[slot])].is_viewed = False
    for vehicle in state.alarms.take_unviewed().values():
        vehicle.is_viewed = False


def measured_motion(state: RunState) -> Motion:
    """Return the fleet's motion as the vehicles measure and report it (``plant.imperfections``)."""
    fleet = state.fleet
    measured = measured_speed_mps(fleet.motion.speed_mps, fleet.parameters, fleet.draw_key, state.clock.tick)
    return fleet.motion._replace(speed_mps=measured)


def send_observations(state: RunState, snapshot: Snapshot, world: World) -> None:
    """Give each stack its view; it answers at the start of the next step. Who has none costs nothing.

    In every mode: what a human drives is measured and reported all the same (XGV-03). Beside the modes it has
    the status and the controller of both drivers, from which a client works the modes out itself (XGV-44).
    """
    listening = state.vehicles.linked
    if not listening:
        return
    note_changes(state)
    slots = np.array([vehicle.slot for vehicle, _ in listening], np.int64)
    names = [vehicle.vehicle_id for vehicle, _ in listening]
    seen = [mode_view(state, vehicle) for vehicle, _ in listening]
    around = world.surroundings(names)
    motion = measured_motion(state)
    observations = observe(snapshot, world.road, around, motion, slots, names, seen)
    for (_, link), observation in zip(listening, observations, strict=True):
        link.send(observation)
