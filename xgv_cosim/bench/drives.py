"""The three drives of the same traffic, timed in processor time; for few vehicles see ``_clock``.

*Plain*: SUMO alone. *Bound*: every car (or a share) bound and commanded anew in each step. *Floor*: what the
bound drive asked of SUMO, asked again with no model behind it.
"""

from __future__ import annotations

import gc
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter, thread_time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from jaus.address import JausAddress
from xgv_cosim.actuation import CouplingKind, Driver
from xgv_cosim.bench.calls import CallLog, TappedEngine
from xgv_cosim.bench.driving import CarMotion, Pursuit, Recording, Targets
from xgv_cosim.bench.extras import LASTS_S, Extra, motion_profile, session_messages, switched_on
from xgv_cosim.commands import CommandKind
from xgv_cosim.errors import ScenarioError
from xgv_cosim.parameters import load_preset
from xgv_cosim.simulation.binding import Binding
from xgv_cosim.simulation.exchange import front_distance_m
from xgv_cosim.simulation.loop import Simulation
from xgv_cosim.vehicles.xgv.profile import XgvProfile
from xgv_cosim.vehicles.xgv.settings import XgvSettings
from xgv_cosim.worlds.sumo.frames import headings_from_sumo
from xgv_cosim.worlds.sumo.session import Session
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager
    from pathlib import Path

    from xgv_cosim.bench.extras import SwitchedOn
    from xgv_cosim.bench.traffic import Traffic
    from xgv_cosim.columns import FloatMatrix, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.traveller import Traveller
    from xgv_cosim.worlds.base import Placement

STEP_S = 0.1
WARM_UP_STEPS = 150
"""Traffic settles; nothing of it counts."""
HAND_OVER_STEPS = 40
"""The cars are bound, get their first commands, and find to their ways; nothing of it counts."""
DRIVER_STEPS = 3
"""Of these, the first so many are the world's driver's, so that the plant has the curvature of the turn."""
MESSAGE_STEPS = 3
"""In so many after these, each car is sent messages; from then on its targets are written into columns."""
SIGHT_STEPS = 10
"""The recording goes on for so long after the last step."""
FEW_VEHICLES = 10
"""Up to so many vehicles steps are timed on the wall's clock."""
SENDER = JausAddress(100, 1, 2, 1)
PROFILE = XgvProfile(XgvSettings(controller_timeout_s=LASTS_S))
"""Targets that are written column by column are no traffic; so the watch on silence is on, but patient."""


class Setup(NamedTuple):
    """What all drives of a case share."""

    traffic: Traffic
    config: Path
    steps: int


def _clock(setup: Setup) -> Callable[[], float]:
    """Return the clock of a case: processor time, for a few vehicles wall time.

    To ask for processor time is a system call, which may take longer than a step with one vehicle
    (measured: up to 2.5 ms in a virtual machine); and a step that short is seldom interrupted.
    """
    return perf_counter if setup.traffic.num_vehicles <= FEW_VEHICLES else thread_time


class BoundSetup(NamedTuple):
    """How the cars of a bound drive are bound."""

    coupling: CouplingKind
    share: float = 1.0
    extras: frozenset[Extra] = frozenset()
    steady: bool = False
    """Targets stay as they are."""


@dataclass(slots=True)
class BoundDrive:
    """What a bound drive took and did, times in µs per world step."""

    step_us: float = 0.0
    emulator_us: float = 0.0
    """All but the world: messages, modes, references, controllers, plant, events."""
    ids: tuple[str, ...] = ()
    """Who was bound."""
    end_m: FloatMatrix = field(default_factory=lambda: np.zeros((0, 2)))
    """Where the front bumpers were at the end, shape ``(n, 2)``."""
    beside_m: float = 0.0
    """How far a car was from its recorded way at most."""
    in_lane_frame: float = 0.0
    """Share of cars and steps that were written as speed and lateral position in the lane."""


@contextmanager
def opened(setup: Setup) -> Iterator[Session]:
    """Yield SUMO with the traffic settled.

    Raises:
        ScenarioError: Not all vehicles found room.
    """
    session = Session(setup.config, step_s=STEP_S, seed=setup.traffic.seed)
    try:
        for _ in range(WARM_UP_STEPS):
            session.step()
        found = session.engine.vehicle.getIDCount()
        if found != setup.traffic.num_vehicles:
            raise ScenarioError(
                f"{setup.traffic.network}: {found} of {setup.traffic.num_vehicles} vehicles found room"
            )
        yield session
    finally:
        session.close()


def record_plain(setup: Setup) -> Recording:
    """Let SUMO's drivers drive, and return where they went."""
    rows: list[list[tuple[float, ...]]] = []
    with opened(setup) as session:
        vehicle = session.engine.vehicle
        ids = tuple(vehicle.getIDList())
        for _ in range(HAND_OVER_STEPS + setup.steps + SIGHT_STEPS):
            rows.append([(*vehicle.getPosition(n), vehicle.getAngle(n), vehicle.getSpeed(n)) for n in ids])
            session.step()
    x_m, y_m, angle_deg, speed_mps = np.array(rows).transpose(2, 0, 1)
    return Recording(ids, x_m, y_m, headings_from_sumo(angle_deg), speed_mps)


def time_plain(setup: Setup) -> float:
    """Return what a step of SUMO alone takes, in µs."""
    clock = _clock(setup)
    with opened(setup) as session:
        step = session.engine.simulationStep
        for _ in range(HAND_OVER_STEPS):
            step()
        with _settled_heap():
            began_s = clock()
            for _ in range(setup.steps):
                step()
            return 1e6 * (clock() - began_s) / setup.steps


def time_floor(setup: Setup, log: CallLog, whom: tuple[str, ...]) -> tuple[float, FloatMatrix]:
    """Return what a step with the calls of a bound drive takes, in µs, and where the cars are at the end."""
    clock = _clock(setup)
    with opened(setup) as session:
        engine = session.engine
        calls = log.replay(whom, HAND_OVER_STEPS)
        for asked in calls[:HAND_OVER_STEPS]:
            for function, given in asked:
                function(*given)
            engine.simulationStep()
        timed = calls[HAND_OVER_STEPS : HAND_OVER_STEPS + setup.steps]
        with _settled_heap():
            began_s = clock()
            for asked in timed:
                for function, given in asked:
                    function(*given)
                engine.simulationStep()
            spent_s = clock() - began_s
        return 1e6 * spent_s / setup.steps, np.array([engine.vehicle.getPosition(name) for name in whom])


@dataclass(slots=True)
class _WarmSession:
    """A settled simulation as a world takes hold of it."""

    session: Session
    engine: Any
    log: CallLog | None
    begin_s: float

    @property
    def is_open(self) -> bool:
        return self.session.is_open

    @property
    def goes_on(self) -> bool:
        return self.session.goes_on

    @property
    def messages(self) -> tuple[str, ...]:
        return self.session.messages

    def step(self) -> None:
        if self.log is not None:
            self.log.end_step()
        self.session.step()

    def failures(self) -> AbstractContextManager[None]:
        return self.session.failures()

    def close(self) -> None:
        self.session.close()


class TimedWorld(SumoWorld):
    """Counts the time that is spent in the world's step."""

    spent_s = 0.0
    clock: Callable[[], float] = staticmethod(thread_time)

    def step(self, placement: Placement) -> Snapshot:
        """Advance SUMO, see ``SumoWorld``."""
        began_s = self.clock()
        snapshot = super().step(placement)
        self.spent_s += self.clock() - began_s
        return snapshot


def drive_bound(
    setup: Setup, how: BoundSetup, recording: Recording, log: CallLog | None = None
) -> BoundDrive:
    """Drive with bound cars.

    Args:
        setup: The traffic.
        how: How it is bound.
        recording: What SUMO's drivers did in it.
        log: Where the commands to SUMO go; then no time is worth anything.

    Raises:
        WorldError: SUMO failed.
    """
    clock = _clock(setup)
    with handed_over(setup, how, recording, log) as fleet:
        drive = BoundDrive(ids=fleet.recording.ids)
        spent_s, mirrored = 0.0, 0
        with _settled_heap():
            fleet.world.spent_s, fleet.world.clock = 0.0, clock
            for step in range(HAND_OVER_STEPS, HAND_OVER_STEPS + setup.steps):
                wanted = fleet.targets(step)
                began_s = clock()
                fleet.advance(wanted)
                spent_s += clock() - began_s
                if log is not None:
                    drive.beside_m = max(drive.beside_m, float(np.abs(fleet.pursuit.beside_m).max()))
                    mirrored += int(np.count_nonzero(fleet.sim.snapshot.in_lane_frame))
        fleet.require_driving()
        drive.step_us = 1e6 * spent_s / setup.steps
        drive.emulator_us = 1e6 * (spent_s - fleet.world.spent_s) / setup.steps
        drive.in_lane_frame = mirrored / (setup.steps * len(drive.ids))
        drive.end_m = fleet.places()
    return drive


@contextmanager
def handed_over(
    setup: Setup, how: BoundSetup, recording: Recording, log: CallLog | None = None
) -> Iterator[Fleet]:
    """Yield bound cars that follow their commands, see ``drive_bound``."""
    every = round(1.0 / how.share)
    recording = recording.of(np.arange(0, len(recording.ids), every))
    with opened(setup) as session, switched_on(how.extras, PROFILE.safety_mode_name) as extras:
        engine = session.engine if log is None else TappedEngine(session.engine, log)
        begin_s = float(session.engine.simulation.getTime())
        world = TimedWorld(lambda: _WarmSession(session, engine, log, begin_s), STEP_S)
        with Simulation(world, _nobody, step_s=STEP_S, observers=extras.observers) as sim:
            if extras.use_road is not None:
                extras.use_road(world.road)
            fleet = Fleet(sim, world, recording, extras, steady=how.steady)
            fleet.bind(how.coupling)
            for step in range(HAND_OVER_STEPS):
                fleet.hand_over(step)
            fleet.require_driving()
            yield fleet


@dataclass(slots=True)
class Fleet:
    """The bound cars of a drive, and what they are told."""

    sim: Simulation
    world: TimedWorld
    recording: Recording
    extras: SwitchedOn
    steady: bool
    slots: IntColumn = field(default_factory=lambda: np.zeros(0, np.int64))
    pursuit: Pursuit = field(init=False)

    def bind(self, coupling: CouplingKind) -> None:
        """Bind all of them."""
        binding = Binding(PROFILE, load_preset(), coupling, driver=Driver.NONE, new_link=self.extras.new_link)
        for vehicle_id in self.recording.ids:
            self.sim.bind_vehicle(vehicle_id, binding)
        self.slots = np.array([self.sim.fleet.slot_of(name) for name in self.recording.ids])
        self.pursuit = Pursuit(self.recording, front_distance_m(self.sim.fleet.parameters)[self.slots])

    def targets(self, step: int) -> Targets:
        """Return what the cars are to be told before a step; their clients, if they have any, know it now."""
        whole = self.sim.fleet.motion
        motion = CarMotion(*(getattr(whole, name)[self.slots] for name in CarMotion._fields))
        wanted = self.pursuit.targets(step, motion)
        if self.extras.clients and not (self.steady and step >= HAND_OVER_STEPS):
            for name, *target in zip(self.recording.ids, *(c.tolist() for c in wanted), strict=True):
                client = self.extras.clients[name]
                client.speed_mps, client.curvature_per_m = target
        return wanted

    def advance(self, wanted: Targets) -> None:
        """Tell the cars their targets, column by column, unless somebody else does, and make a step."""
        if not (self.extras.drives_itself or self.extras.clients or self.steady):
            self.sim.renew_motions(self.slots, *wanted, LASTS_S)
        self.sim.step()

    def hand_over(self, step: int) -> None:
        """Make one of the steps of the hand-over."""
        wanted = self.targets(step)
        if step < DRIVER_STEPS or self.extras.drives_itself or self.extras.clients:
            self.sim.step()
        elif step < DRIVER_STEPS + MESSAGE_STEPS:
            self._send(wanted, first=step == DRIVER_STEPS)
            self.sim.step()
        else:
            self.sim.renew_motions(self.slots, *wanted, LASTS_S)
            self.sim.step()

    def _send(self, wanted: Targets, *, first: bool) -> None:
        """Command every car by a message of its own, the first time with control and readiness before it."""
        for name, speed_mps, curvature_per_m in zip(
            self.recording.ids, *(column.tolist() for column in wanted), strict=True
        ):
            car = self.sim.vehicle(name)
            for message in session_messages() if first else ():
                car.send(message, SENDER)
            car.send(motion_profile(speed_mps, curvature_per_m), SENDER)

    def require_driving(self) -> None:
        """Make sure that what is measured are cars that follow their commands.

        Raises:
            ScenarioError: One of them does not.
        """
        following = self.sim.fleet.command.kind[self.slots] == CommandKind.MOTION_PROFILE
        if not following.all():
            idle = [self.recording.ids[i] for i in np.flatnonzero(~following)[:3].tolist()]
            raise ScenarioError(f"bench: cars without a command in force: {', '.join(idle)}, ...")

    def places(self) -> FloatMatrix:
        """Return where the world has the front bumpers."""
        now = self.sim.snapshot
        rows = [now.index_of[name] for name in self.recording.ids]
        return np.column_stack([now.front_x_m[rows], now.front_y_m[rows]])


def _nobody(_: Traveller) -> None:
    return None


@contextmanager
def _settled_heap() -> Iterator[None]:
    """Keep what is there already out of the garbage collector's rounds."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
