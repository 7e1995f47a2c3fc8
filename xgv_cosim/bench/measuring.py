"""Three drives of the same traffic in one process, one after the other, in processor time of this thread.

*Plain*: SUMO alone. *Bound*: every car (or a share) bound and commanded anew in each step. *Floor*: the
poses of the bound drive written into SUMO by the same two calls per car, with no model behind them.
"""

from __future__ import annotations

import tempfile
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import thread_time
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from jaus.address import ComponentId, JausAddress
from jaus.component import StatusCommand
from xgv_cosim.actuation import CouplingKind, Driver
from xgv_cosim.bench.driving import Recording, targets
from xgv_cosim.commands import CommandKind, MotionProfile
from xgv_cosim.endpoint import CommandStatus, RequestControl
from xgv_cosim.kernel import warm_up
from xgv_cosim.parameters import load_preset
from xgv_cosim.simulation.binding import Binding
from xgv_cosim.simulation.exchange import front_distance_m
from xgv_cosim.simulation.loop import Simulation
from xgv_cosim.vehicles.xgv.profile import XgvProfile
from xgv_cosim.worlds.sumo.couplings import KEEP_ROUTE_AND_POSE, MATCH_THRESHOLD_M
from xgv_cosim.worlds.sumo.frames import angle_to_sumo
from xgv_cosim.worlds.sumo.session import Session
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

    from xgv_cosim.bench.traffic import Traffic
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.traveller import Traveller
    from xgv_cosim.worlds.base import Placement

STEP_S = 0.1
WARM_UP_STEPS = 150
"""Traffic settles; nothing of it counts."""
HAND_OVER_STEPS = 10
"""The cars are bound and get their first commands; nothing of it counts."""
SENDER = JausAddress(100, 1, 2, 1)
LIMITS = {"max_accel_mps2": 4.0, "max_curvature_rate_per_m_s": 0.3}
LASTS_S = 60.0


@dataclass(frozen=True, slots=True)
class Case:
    """What is measured."""

    traffic: Traffic
    coupling: CouplingKind
    share: float = 1.0
    """How many of the vehicles are bound."""
    steps: int = 100


@dataclass(frozen=True, slots=True)
class Cost:
    """Processor time per world step, in microseconds."""

    case: Case
    plain_us: float
    bound_us: float
    floor_us: float
    emulator_us: float
    """Of ``bound_us``, all but the world: messages, modes, references, controllers, plant, events."""
    num_bound: int

    @property
    def ratio_to_plain(self) -> float:
        """Return how much dearer a step is than SUMO alone."""
        return self.bound_us / self.plain_us

    @property
    def ratio_to_floor(self) -> float:
        """Return how much dearer a step is than the same poses without a model."""
        return self.bound_us / self.floor_us

    @property
    def emulator_us_per_vehicle(self) -> float:
        """Return the emulator's share for one bound vehicle and one world step."""
        return self.emulator_us / self.num_bound


class Written(NamedTuple):
    """What one step wrote, for the replay."""

    placement: Placement
    in_lane_frame: frozenset[str]


def measure(case: Case) -> Cost:
    """Make the three drives and return what they cost.

    Raises:
        ScenarioError: The network has no room for so many vehicles.
        WorldError: SUMO failed, or a simulation is open in this process.
    """
    warm_up()
    with tempfile.TemporaryDirectory(prefix="xgv-cosim-bench-") as folder:
        config = case.traffic.write(Path(folder))
        plain_us, recording = _plain(case, config)
        bound = _bound(case, config, recording)
        floor_us = _floor(case, config, bound.written)
    return Cost(
        case, plain_us, bound.step_us, floor_us, bound.emulator_us, len(bound.written[0].placement.ids)
    )


@contextmanager
def _session(case: Case, config: Path) -> Iterator[ModuleType]:
    session = Session(config, step_s=STEP_S, seed=case.traffic.seed)
    try:
        yield session.engine
    finally:
        session.close()


def _plain(case: Case, config: Path) -> tuple[float, Recording]:
    spent_s = 0.0
    places: list[list[tuple[float, ...]]] = []
    with _session(case, config) as engine:
        for _ in range(WARM_UP_STEPS):
            engine.simulationStep()
        ids = tuple(engine.vehicle.getIDList())
        vehicle = engine.vehicle
        for _ in range(HAND_OVER_STEPS + case.steps + 1):
            places.append([(*vehicle.getPosition(name), vehicle.getSpeed(name)) for name in ids])
            began_s = thread_time()
            engine.simulationStep()
            if len(places) > HAND_OVER_STEPS + 1:
                spent_s += thread_time() - began_s
    columns = np.array(places).transpose(2, 0, 1)
    return 1e6 * spent_s / case.steps, Recording(ids, *columns)


@dataclass(slots=True)
class _Bound:
    step_us: float = 0.0
    emulator_us: float = 0.0
    written: list[Written] = field(default_factory=list)


class _TimedWorld(SumoWorld):
    """Counts the time that is spent in the world's step, and keeps what was placed."""

    spent_s = 0.0
    placement: Placement

    def step(self, placement: Placement) -> Snapshot:
        began_s = thread_time()
        snapshot = super().step(placement)
        self.spent_s += thread_time() - began_s
        self.placement = placement
        return snapshot


def _nobody(_: Traveller) -> None:
    return None


def _bound(case: Case, config: Path, recording: Recording) -> _Bound:
    world = _TimedWorld.headless(config, step_s=STEP_S, seed=case.traffic.seed)
    binding = Binding(XgvProfile(), load_preset(), case.coupling, driver=Driver.NONE)
    found = _Bound()
    with Simulation(world, _nobody, step_s=STEP_S) as sim:
        sim.run_until(WARM_UP_STEPS * STEP_S)
        every = max(1, round(1.0 / case.share))
        chosen = np.arange(0, len(recording.ids), every)
        recording = Recording(
            tuple(recording.ids[i] for i in chosen.tolist()), *(m[:, chosen] for m in recording[1:])
        )
        for vehicle_id in recording.ids:
            sim.bind_vehicle(vehicle_id, binding)
        slots = np.array([sim.fleet.slot_of(name) for name in recording.ids])
        for step in range(HAND_OVER_STEPS):
            _send(sim, recording, step, slots, first=step == 0)
            sim.step()
        kinds = sim.fleet.command.kind[slots]
        if not (kinds == CommandKind.MOTION_PROFILE).all():
            raise AssertionError("not every car of the benchmark follows its command")
        world.spent_s, spent_s = 0.0, 0.0
        for step in range(case.steps):
            wanted = _targets(sim, recording, HAND_OVER_STEPS + step, slots)
            began_s = thread_time()
            sim.renew_motions(slots, *wanted, LASTS_S)
            sim.step()
            spent_s += thread_time() - began_s
            found.written.append(Written(world.placement, world.in_lane_frame))
        found.step_us = 1e6 * spent_s / case.steps
        found.emulator_us = 1e6 * (spent_s - world.spent_s) / case.steps
    return found


def _targets(sim: Simulation, recording: Recording, step: int, slots: np.ndarray) -> tuple:
    motion = type(sim.fleet.motion)(*(column[slots] for column in sim.fleet.motion))
    return targets(recording, step, motion, front_distance_m(sim.fleet.parameters)[slots])


def _send(sim: Simulation, recording: Recording, step: int, slots: np.ndarray, *, first: bool) -> None:
    """Command every car by a message of its own, the first time with control and readiness before it."""
    for vehicle_id, speed, curvature in zip(
        recording.ids, *_targets(sim, recording, step, slots), strict=True
    ):
        car = sim.vehicle(vehicle_id)
        if first:
            car.send(RequestControl(ComponentId.MOTION_PROFILE_DRIVER), SENDER)
            for component in (ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER):
                car.send(CommandStatus(component, StatusCommand.RESUME), SENDER)
        car.send(
            MotionProfile(float(speed), curvature_per_m=float(curvature), duration_s=LASTS_S, **LIMITS),
            SENDER,
        )


def _floor(case: Case, config: Path, written: list[Written]) -> float:
    spent_s = 0.0
    with _session(case, config) as engine:
        vehicle = engine.vehicle
        for _ in range(WARM_UP_STEPS + HAND_OVER_STEPS):
            engine.simulationStep()
        for name in written[0].placement.ids:
            vehicle.setSpeedMode(name, 0)
            vehicle.setLaneChangeMode(name, 0)
        for done in written:
            placement = done.placement
            rows = [
                (name, name in done.in_lane_frame, *row)
                for name, *row in zip(
                    placement.ids,
                    placement.front_x_m.tolist(),
                    placement.front_y_m.tolist(),
                    [angle_to_sumo(h) for h in placement.heading_rad.tolist()],
                    np.maximum(placement.speed_mps, 0.0).tolist(),
                    (np.maximum(placement.travelled_m, 0.0) / STEP_S).tolist(),
                    strict=True,
                )
            ]
            began_s = thread_time()
            for name, in_lane, x_m, y_m, angle, speed_mps, mean_mps in rows:
                if in_lane:
                    vehicle.setSpeed(name, mean_mps)
                    vehicle.setLateralLanePosition(name, 0.0)
                else:
                    vehicle.setSpeed(name, speed_mps)
                    vehicle.moveToXY(name, "", -1, x_m, y_m, angle, KEEP_ROUTE_AND_POSE, MATCH_THRESHOLD_M)
            engine.simulationStep()
            spent_s += thread_time() - began_s
    return 1e6 * spent_s / len(written)
