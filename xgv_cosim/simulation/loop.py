"""The order of a step. Whole columns of ``Fleet`` are assigned here; single cells by its neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from xgv_cosim import kernel
from xgv_cosim.clock import Clock, time_of_tick_s
from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
from xgv_cosim.controllers.references import ReferenceGenerator
from xgv_cosim.errors import LinkError, ScenarioError, WorldError
from xgv_cosim.fleet import Fleet
from xgv_cosim.fleet_columns import Motion, Setpoints, copied_motion
from xgv_cosim.injection import Injection
from xgv_cosim.simulation import (
    commanding,
    crash,
    drivetrain,
    exchange,
    grip,
    lifecycle,
    moding,
    reporting,
    requests,
    safety,
    setpoints,
    shifting,
    triggers,
    views,
)
from xgv_cosim.simulation.binding import Binding, Selector
from xgv_cosim.simulation.crash import ContactRule
from xgv_cosim.simulation.devices import Devices
from xgv_cosim.simulation.journal import Journal, Observer
from xgv_cosim.simulation.state import RunState
from xgv_cosim.simulation.vehicle import VehicleHandle
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.worlds.base import World

if TYPE_CHECKING:
    from xgv_cosim.links.jaus_network import JausNetwork
    from xgv_cosim.simulation.wire import Announce, VehiclesOnTheWire


class Simulation:
    """Bound vehicles in a world, advanced step by step.

    Args:
        world: The traffic engine, not yet started.
        selector: Says how each vehicle of the world is bound, if at all.
        injections: What happens to whom, and when.
        step_s: World step.
        observers: Recorders and metrics.
        contact: What a contact with a bound vehicle does.
    """

    def __init__(
        self,
        world: World,
        selector: Selector,
        injections: Sequence[Injection] = (),
        *,
        step_s: float = 0.1,
        observers: Sequence[Observer] = (),
        contact: ContactRule = ContactRule.STAY,
    ) -> None:
        self.state = RunState(Clock(step_s), Journal(observers), Devices())
        for injection in injections:
            triggers.schedule(self.state, injection)
        self.world = world
        self._selector = selector
        self._contact = contact
        self._references = ReferenceGenerator()
        self._broken = False
        self._wire: VehiclesOnTheWire | None = None
        self._serves_in_steps = False
        self._ids_of_rows: tuple[str, ...] = ()
        self.snapshot: Snapshot = world.start()
        if lifecycle.bind_new(self.state, world, self._selector, self.snapshot):
            self._resolve_modes()

    @property
    def fleet(self) -> Fleet:
        """Columns of all bound vehicles."""
        return self.state.fleet

    @property
    def now_s(self) -> float:
        """Simulation time since the start of the run."""
        return self.state.now_s

    @property
    def vehicle_ids(self) -> tuple[str, ...]:
        """Ids of the vehicles bound now, in slot order."""
        return self.fleet.bound_ids

    @property
    def is_over(self) -> bool:
        """Return whether a step has failed, so that there can be no further one."""
        return self._broken

    @property
    def ended_by(self) -> str:
        """What ended the run early, empty while nothing has (``world.contact: end``)."""
        return self.state.ended_by

    def vehicle(self, vehicle_id: str) -> VehicleHandle:
        """Return the handle of a bound vehicle.

        Raises:
            UnknownVehicleError: No such vehicle is bound now.
        """
        return VehicleHandle(self.state, self.state.vehicle(vehicle_id).vehicle_id)

    def bind_vehicle(self, vehicle_id: str, binding: Binding) -> None:
        """Bind a vehicle that is in the world; it may move. The world's driver has it until the next step.

        One that is parked beside the road loses its stops, and is bound as soon as it is back on its lane.

        Raises:
            ScenarioError: It is not in the world, is bound already, or cannot start cold because it moves.
        """
        if vehicle_id in self.state.vehicles:
            raise ScenarioError(f"vehicle {vehicle_id!r} is bound already; release it first")
        if vehicle_id not in self.snapshot.index_of:
            raise ScenarioError(f"the world has no vehicle {vehicle_id!r} at {self.now_s:g} s; bind it later")
        lifecycle.bind_or_unpark(self.state, self.world, self.snapshot, vehicle_id, binding)
        self._resolve_modes()

    def release(self, vehicle_id: str) -> None:
        """Give a bound vehicle back to the world's driver, for good or until it is bound again.

        Raises:
            UnknownVehicleError: No such vehicle is bound now.
        """
        lifecycle.give_back(self.state, self.world, vehicle_id, "released from Python")

    def renew_motions(
        self, slots: IntColumn, speed_mps: FloatColumn, curvature_per_m: FloatColumn, lasts_s: float
    ) -> BoolColumn:
        """Give many cars new targets at once, see ``commanding.renew_motions``."""
        return commanding.renew_motions(self.state, slots, speed_mps, curvature_per_m, lasts_s)

    def connect(
        self, network: JausNetwork, announce: Announce | None = None, *, lockstep: bool = True
    ) -> VehiclesOnTheWire:
        """Put all bound vehicles, also those that are bound later, on a JAUS network; it is closed with us.

        Args:
            network: Its ports.
            announce: Told of each vehicle that comes onto it, see ``VehiclesOnTheWire``.
            lockstep: The network's time is the simulation's: clients are served before and after each step.
                Otherwise whoever keeps the time calls ``communicate``.

        Raises:
            LinkError: They are on a network already.
        """
        from xgv_cosim.simulation.wire import VehiclesOnTheWire  # noqa: PLC0415 - makes every message of JAUS

        if self._wire is not None:
            raise LinkError("connect: the vehicles are on a network already; open another simulation")
        self._wire = VehiclesOnTheWire(network, announce)
        self._wire.follow(self.state)
        self._serves_in_steps = lockstep
        return self._wire

    def communicate(self, now_s: float | None = None) -> None:
        """Serve the clients of the network now; what they command acts at the beginning of the next step.

        Args:
            now_s: The time on the network, None: that of the simulation.
        """
        if self._wire is not None:
            self._wire.exchange(self.state, self.now_s if now_s is None else now_s)
            self._resolve_modes()

    def step(self) -> Snapshot:
        """Advance by one world step and return the world after it.

        Raises:
            WorldError: The traffic engine failed, or an earlier step did; the run is over.
        """
        if self._broken:
            raise WorldError("an earlier step failed, so this simulation is over; open a new one")
        self._broken = True
        snapshot = self._step()
        self._broken = False
        return snapshot

    def _step(self) -> Snapshot:
        state, fleet, clock = self.state, self.fleet, self.state.clock
        tick, end = clock.tick, clock.tick + clock.ticks_per_step
        before = fleet.motion
        fleet.motion = copied_motion(before)
        fleet.motion.travelled_m[:] = 0.0
        requests.apply_requests(state)
        lifecycle.apply_couplings(state, self.world)
        crash.hold_released(state, self.world, self.snapshot)
        requests.apply_scheduled(state, self.world, tick)
        self._serve_in_step()
        commanding.receive(state)
        by_computer = exchange.nobody_yet(fleet)
        while tick < end:
            safety.meet_deadlines(state)
            commanding.meet_deadlines(state)
            self._resolve_modes()
            wanted = setpoints.setpoints_of(fleet)
            failed = self._references.look_ahead(fleet.reference, wanted)
            if reporting.note_failed_references(state, failed):
                self._resolve_modes()
                wanted = setpoints.setpoints_of(fleet)
                self._references.look_ahead(fleet.reference, wanted)
            by_computer = exchange.also_computers(fleet, by_computer)
            until = shifting.next_engagement(fleet, wanted, tick, requests.next_edge(state, tick, end))
            self._advance_motion(wanted, until)
            tick = until
            if tick < end:
                requests.apply_scheduled(state, self.world, tick)
        by_computer = crash.also_held(state, by_computer)
        before_step = self.snapshot
        self.snapshot = snapshot = self.world.step(exchange.placement_of(fleet, *by_computer))
        self._find_rows(before_step)
        self._adopt(snapshot, *by_computer, before)
        reporting.note_world(state, snapshot)
        reporting.note_teleports(state, self.world.road, before_step, snapshot)
        crash.note_contacts(state, self.world, snapshot, self._contact)
        lifecycle.release_gone(state, self.world, snapshot)
        lifecycle.release_due(state, self.world)
        if lifecycle.bind_new(state, self.world, self._selector, snapshot):
            self._resolve_modes()  # so that a new vehicle has its modes before anybody looks
        triggers.look(state, snapshot, self.world.road)
        self._serve_in_step()  # so that what stacks know from reports is of this step too
        views.send_observations(state, snapshot, self.world)
        state.journal.step_done(clock.tick, fleet, snapshot)
        return snapshot

    def _serve_in_step(self) -> None:
        if self._wire is not None and self._serves_in_steps:
            self._wire.exchange(self.state, self.now_s)

    def run_until(self, time_s: float) -> None:
        """Step until simulation time has reached ``time_s``."""
        while self.now_s < time_s - 1e-9:
            self.step()

    def close(self) -> None:
        """End all links and the world."""
        try:
            for vehicle in self.state.vehicles:
                if vehicle.link is not None:
                    vehicle.link.close()
            if self._wire is not None:
                self._wire.close()
        finally:
            self.world.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _find_rows(self, before: Snapshot) -> None:
        """Look up once a step where the bound vehicles stand in the snapshot."""
        state, ids = self.state, self.fleet.bound_ids
        if ids is not self._ids_of_rows or self.snapshot.ids != before.ids:
            state.rows, self._ids_of_rows = exchange.rows_of(self.snapshot, ids), ids

    def _resolve_modes(self) -> None:
        """Look the modes up, let drivers take what was released, start references where an axis changes.

        While nothing that this reads has changed since, the modes are what they were.
        """
        state, fleet = self.state, self.fleet
        if state.seen.shape[1] != fleet.num_slots:
            state.seen = np.full((2, fleet.num_slots), -1)
        if not (moding.has_changed(fleet, state.seen, self.now_s) or state.alarms.has_unseen):
            return
        answer = moding.resolve(fleet, self.state.vehicles.groups)
        axes = moding.take_axes(fleet, answer, self.now_s)
        reporting.note_modes(self.state, axes)
        fleet.reference = setpoints.seeded_references(
            fleet.reference,
            fleet.motion,
            fleet.parameters,
            axes.longitudinal != fleet.longitudinal,
            axes.lateral != fleet.lateral,
        )
        fleet.safety_mode, fleet.longitudinal, fleet.lateral = (
            axes.safety_mode,
            axes.longitudinal,
            axes.lateral,
        )
        fleet.speed_released_s, fleet.steering_released_s = axes.speed_released_s, axes.steering_released_s
        fleet.handed_over = axes.handed_over
        drivetrain.follow_axes(self.state, answer.pausing)
        reporting.note_stops_without_effect(self.state, answer.pausing)

    def _advance_motion(self, wanted: Setpoints, until: int) -> None:
        """Ruckig once for the segment, then controllers and plant over its ticks; the clock is at its end.

        A driver has put his gears in at its beginning; a shift of the computer ends where it ends (XGV-71).
        """
        fleet, clock = self.fleet, self.state.clock
        ticks = until - clock.tick
        limited = self._references.go_on(time_of_tick_s(ticks))
        before = fleet.motion
        motion, followed = kernel.advance(before, fleet.reference, wanted, fleet.parameters, ticks)
        motion = crash.held(self.state, before, motion)
        driven = kernel.settled(before, motion, followed, limited, wanted, fleet.gear_wanted, ticks)
        if driven.gears_changed:
            drivetrain.note_gears(self.state, before.gear, driven.gear_by_driver)
        fleet.motion, fleet.reference, fleet.gear_wanted = motion, driven.reference, driven.gear_wanted
        if driven.grip_changed:
            grip.note(self.state, ticks)
        clock.tick = until
        if driven.gears_changed:
            drivetrain.note_gears(self.state, driven.gear_by_driver, motion.gear)

    def _adopt(
        self,
        snapshot: Snapshot,
        computer_speed: BoolColumn,
        computer_steering: BoolColumn,
        before: Motion,
    ) -> None:
        """Take back what the world moved itself: the driver's axes, and positions of lane couplings."""
        fleet = self.fleet
        slots, rows = exchange.moved_by_world(fleet, self.state.rows, computer_speed, computer_steering)
        steered = ~computer_steering
        fleet.heading_ease_rad = exchange.heading_ease(
            fleet, snapshot, slots, rows, steered, self.state.clock.step_s
        )
        fleet.driver_steered = steered
        fleet.motion = exchange.adopt(fleet, snapshot, slots, rows, computer_speed, computer_steering, before)
