"""A world without traffic: cars on one endless straight lane to the east, for simulations at any speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from typing import get_type_hints

import numpy as np

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.columns import BoolColumn, IntColumn
from xgv_cosim.commands import MotionProfile
from xgv_cosim.endpoint import CommandStatus, RequestControl, StackMessage
from xgv_cosim.injection import Injection, InjectionKind
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.observation import Observation
from xgv_cosim.parameters import load_preset
from xgv_cosim.road import LanePoints
from xgv_cosim.simulation import Binding, Simulation
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.surroundings import Surroundings, plain_surroundings
from xgv_cosim.traveller import Traveller
from xgv_cosim.vehicles.xgv.profile import XgvProfile
from xgv_cosim.vehicles.xgv.settings import XgvSettings
from xgv_cosim.worlds.base import Placement

LANE_M = 1e6
DRIVERS = (ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER)


class StraightRoad:
    """One lane along y = 0."""

    lane_ids = ("lane",)

    def lane_length_m(self, lane: np.ndarray) -> np.ndarray:
        return np.full(lane.shape, LANE_M)

    def lane_width_m(self, lane: np.ndarray) -> np.ndarray:
        return np.full(lane.shape, 3.5)

    def lane_limit_mps(self, lane: np.ndarray) -> np.ndarray:
        return np.full(lane.shape, 60.0)

    def lane_shape_m(self, lane: int) -> np.ndarray:
        return np.array([[0.0, 0.0], [LANE_M, 0.0]]) + lane

    def points_ahead(self, lane: np.ndarray, position_m: np.ndarray, next_lane: np.ndarray) -> LanePoints:
        assert lane.shape == next_lane.shape
        return LanePoints(position_m, np.zeros(lane.shape), np.zeros(lane.shape))


@dataclass
class Car:
    """A car of the bare world; its own driver holds its speed."""

    speed_mps: float
    x_m: float = 0.0
    enters_s: float = 0.0
    leaves_s: float = math.inf
    heading_rad: float = 0.0
    y_m: float = 0.0


class BareWorld:
    """Implements ``worlds.base.World``; nobody sees anybody."""

    def __init__(self, cars: Mapping[str, Car], step_s: float = 0.1) -> None:
        self.road = StraightRoad()
        self.messages = ()
        self._cars = {name: replace(car) for name, car in cars.items()}
        self._step_s, self._steps = step_s, 0
        self._there: tuple[str, ...] = ()

    def knows(self, vehicle_id: str) -> bool:
        return vehicle_id in self._cars

    def traveller(self, vehicle_id: str) -> Traveller:
        return Traveller(vehicle_id, "xgv")

    def stops_of(self, vehicle_id: str) -> tuple[str, ...]:
        assert vehicle_id in self._there
        return ()

    def tight_turns_of(self, vehicle_id: str, radius_m: float) -> tuple[str, ...]:
        assert radius_m > 0.0
        return ()

    def unpark(self, vehicle_id: str) -> bool:
        return True

    def start(self) -> Snapshot:
        return self._snapshot()

    def bind(self, vehicle_id: str, coupling: CouplingKind) -> None:
        assert coupling is not CouplingKind.LANE
        assert vehicle_id in self._there

    def release(self, vehicle_id: str) -> None:
        assert vehicle_id in self._cars

    def set_coupling(self, vehicle_id: str, coupling: CouplingKind) -> None:
        raise AssertionError("no simulation over this world has reason to ask for it")

    def immobilise(self, vehicle_id: str) -> None:
        raise AssertionError("no simulation over this world has reason to ask for it")

    def step(self, placement: Placement) -> Snapshot:
        self._steps += 1
        placed = {name: row for row, name in enumerate(placement.ids)}
        for name in self._there:
            car, row = self._cars[name], placed.get(name)
            if row is None or not placement.computer_speed[row]:
                car.x_m += car.speed_mps * self._step_s
                continue
            car.x_m, car.y_m = float(placement.front_x_m[row]), float(placement.front_y_m[row])
            car.heading_rad, car.speed_mps = (
                float(placement.heading_rad[row]),
                float(placement.speed_mps[row]),
            )
        return self._snapshot()

    def surroundings(self, vehicle_ids: Sequence[str]) -> Surroundings:
        return plain_surroundings(self._last, self.road, vehicle_ids)

    def close(self) -> None:
        self._there = ()

    def _snapshot(self) -> Snapshot:
        now_s, before = self._steps * self._step_s, self._there
        self._there = tuple(
            name for name, car in self._cars.items() if car.enters_s - 1e-9 <= now_s < car.leaves_s - 1e-9
        )
        cars = [self._cars[name] for name in self._there]
        column = {
            key: np.array([getattr(car, key) for car in cars])
            for key in ("x_m", "y_m", "heading_rad", "speed_mps")
        }
        zeros, nobody = np.zeros(len(cars)), np.full(len(cars), -1)
        told = {
            "time_s": now_s,
            "ids": self._there,
            "type_ids": ("xgv",) * len(cars),
            "front_x_m": column["x_m"],
            "front_y_m": column["y_m"],
            "heading_rad": column["heading_rad"],
            "speed_mps": column["speed_mps"],
            "length_m": zeros + 4.4,
            "width_m": zeros + 1.8,
            "lane_position_m": column["x_m"],
            "next_lane": nobody,
            "leader": nobody,
            "leader_gap_m": zeros + np.inf,
            "follower": nobody,
            "follower_gap_m": zeros + np.inf,
            "departed": tuple(name for name in self._there if name not in before),
            "arrived": tuple(name for name in before if name not in self._there),
        }
        # What else a snapshot has is 0 here: the lane's number, accelerations, no error of placing.
        silent = {f.name for f in fields(Snapshot) if f.default is MISSING and f.default_factory is MISSING}
        types, kinds = get_type_hints(Snapshot), {IntColumn: np.int64, BoolColumn: np.bool_}
        rest = {name: zeros.astype(kinds.get(types[name], np.float64)) for name in silent - set(told)}
        self._last = Snapshot(**told, **rest)
        return self._last


class HoldsSpeed:
    """A stack that asks for control, resumes both drivers and commands one speed, straight on."""

    def __init__(self, address: JausAddress, speed_mps: float) -> None:
        self._address = address
        self._speed_mps = speed_mps

    def act(self, seen: Observation) -> list[StackMessage]:
        messages: list[StackMessage] = []
        if seen.component_controller[ComponentId.MOTION_PROFILE_DRIVER] != self._address:
            messages.append(RequestControl(ComponentId.MOTION_PROFILE_DRIVER, 6))
        messages += [
            CommandStatus(driver, StatusCommand.RESUME)
            for driver in DRIVERS
            if seen.component_status[driver] is ComponentStatus.STANDBY
        ]
        messages.append(MotionProfile(self._speed_mps, 2.0, 0.0, 0.1, 0.4))
        return messages


def injection(
    at_tick: int, kind: InjectionKind, *vehicles: str, end_tick: int | None = None, transmitter: str = ""
) -> Injection:
    """Return an injection on control ticks."""
    return Injection(at_tick, kind, vehicles, end_tick=end_tick, transmitter=transmitter)


def simulation(
    cars: Mapping[str, Car],
    injections: Sequence[Injection],
    settings: XgvSettings | None = None,
    transmitters: Mapping[str, str] | None = None,
    seed: int = 1,
    step_s: float = 0.1,
    **parameters: float,
) -> Simulation:
    """Return a simulation in which every car is bound and holds its speed."""
    profile, named = XgvProfile(settings, seed), transmitters or {}
    bindings = {
        name: Binding(
            profile,
            replace(load_preset("ford_escape_hybrid"), **parameters),
            coupling=CouplingKind.FREE,
            transmitter=named.get(name, ""),
            new_link=lambda _, address, speed=car.speed_mps: InProcessLink(
                HoldsSpeed(address, speed), address
            ),
        )
        for name, car in cars.items()
    }
    world = BareWorld(cars, step_s)
    return Simulation(world, lambda who: bindings[who.vehicle_id], injections, step_s=step_s)
