"""A column of cars, each with an event of its own, and what is seen of them from world step to world step."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import xgv_cosim
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.columns import BoolColumn, FloatColumn
from xgv_cosim.scenario.building import ScenarioSimulation
from xgv_cosim.worlds.sumo.libraries import load_libsumo

STEP_S = 0.1
LIMIT_MPS = 30.0
RADIUS_M = 400.0
GAP_M = 70.0
BACK_AFTER_S = 6.0
WATCHED_S = 11.0


def _straight() -> str:
    """Return 5 km straight on."""
    return "0,0 5000,0"


def _curve() -> str:
    """Return 200 m straight on and then round and round the same centre, a chord for every 4 m."""
    turns = np.arange(0.0, 1.5 * math.pi, 4.0 / RADIUS_M)
    points = ((200 + RADIUS_M * math.sin(t), RADIUS_M * (1.0 - math.cos(t))) for t in turns)
    return "0,0 " + " ".join(f"{x:.4f},{y:.4f}" for x, y in points)


ROADS = {"straight": _straight, "curve": _curve}


class Event(NamedTuple):
    """What happens to one car, and ``BACK_AFTER_S`` later."""

    begin: Callable[[ScenarioSimulation, str], Any]
    end: Callable[[ScenarioSimulation, str], Any] = lambda _run, _name: None


def _partial(mode: Any) -> Event:
    return Event(
        lambda run, name: run.vehicle(name).set_partial_mode(mode),
        lambda run, name: run.vehicle(name).set_partial_mode("full"),
    )


def _disable_becomes_override(run: ScenarioSimulation, name: str) -> None:
    run.vehicle(name).estop("run")
    run.vehicle(name).override()


EVENTS = {
    "bind": Event(lambda run, name: run.bind(name), lambda run, name: run.release(name)),
    "release": Event(lambda run, name: run.release(name), lambda run, name: run.bind(name)),
    "override": Event(
        lambda run, name: run.vehicle(name).override(),
        lambda run, name: run.vehicle(name).override(engaged=False),
    ),
    "manual_steering": _partial("manual_steering"),
    "manual_speed": _partial("manual_speed"),
    "cmd_loss": Event(
        lambda run, name: run.vehicle(name).inject("cmd_loss"),
        lambda run, name: run.vehicle(name).inject("cmd_loss", begins=False),
    ),
    "disable": Event(lambda run, name: run.vehicle(name).estop("stop"), _disable_becomes_override),
}
"""From the front of the column to its back: who brakes is followed by nobody."""


class Track(NamedTuple):
    """One car: after each world step, shape ``(n + 1,)``, or in each step, shape ``(n,)``."""

    along_m: FloatColumn
    """Moved along its lane in each step; NaN off the road."""
    sideways_m: FloatColumn
    """Moved across it in each step."""
    speed_mps: FloatColumn
    yaw_rad: FloatColumn
    """Heading against the lane's direction."""
    driver_drives: BoolColumn
    driver_steers: BoolColumn


@contextmanager
def column(
    folder: Path, road: str, coupling: str, *, speed_factor: float, v0_mps: float
) -> Iterator[ScenarioSimulation]:
    """Open a run with one car for each event; the car ``bind`` is not bound yet.

    Args:
        folder: For its files.
        road: One of ``ROADS``, with two lanes.
        coupling: Of all cars.
        speed_factor: What SUMO's drivers want, of the limit; the reference stack drives at the limit.
        v0_mps: At which they depart.
    """
    shape = f'spreadType="center" shape="{ROADS[road]()}"'
    net = plain_network(
        folder,
        '<node id="a" x="0" y="0"/><node id="b" x="5000" y="0"/>',
        f'<edge id="e" from="a" to="b" numLanes="2" speed="{LIMIT_MPS}" {shape}/>',
    )
    cars = "".join(
        f'<vehicle id="{name}" type="xgv" depart="0" departLane="0" departSpeed="{v0_mps}" '
        f'departPos="{10 + GAP_M * (len(EVENTS) - number)}"><route edges="e"/></vehicle>'
        for number, name in enumerate(EVENTS)
    )
    (folder / "c.rou.xml").write_text(
        f'<routes><vType id="xgv" length="4.43" width="1.8" speedDev="0" speedFactor="{speed_factor}" '
        f'lcKeepRight="0" lcSpeedGain="0"/>{cars}</routes>'
    )
    (folder / "c.sumocfg").write_text(
        f'<configuration><net-file value="{net}"/><route-files value="c.rou.xml"/></configuration>'
    )
    names = ", ".join(name for name in EVENTS if name != "bind")
    (folder / "c.yaml").write_text(
        "schema: xgv-cosim/scenario/1\nname: c\nduration_s: 100\nworld: {sumo: {config: c.sumocfg}}\n"
        f"bind: [{{vehicles: [{names}], coupling: {coupling}}}]\n"
    )
    with xgv_cosim.simulate(str(folder / "c.yaml")) as run:
        yield run


def displace(run: ScenarioSimulation, left_m: float, yaw_rad: float = 0.0) -> None:
    """Put all bound cars beside their path; they begin to steer back."""
    motion = run.fleet.motion
    slots = [run.fleet.slot_of(name) for name in run.vehicle_ids]
    heading_rad = motion.heading_rad[slots]
    motion.x_m[slots] -= np.sin(heading_rad) * left_m
    motion.y_m[slots] += np.cos(heading_rad) * left_m
    motion.heading_rad[slots] += yaw_rad


def watch(run: ScenarioSimulation, *, changing: bool = False) -> dict[str, Track]:
    """Let the events happen and end again, and return what is seen.

    Args:
        run: The column, as it is when the events begin.
        changing: SUMO's drivers are changing lanes when the computer takes over again.
    """
    rows: dict[str, list[tuple[float, ...]]] = {name: [_seen(run, name)] for name in EVENTS}
    for step in range(round(WATCHED_S / STEP_S)):
        for name, event in EVENTS.items():
            if step == 0:
                event.begin(run, name)
            if step == round(BACK_AFTER_S / STEP_S):
                event.end(run, name)
            if changing and step == round((BACK_AFTER_S - 1.0) / STEP_S) and name in {"release", "override"}:
                load_libsumo().vehicle.changeLane(name, 1, 0.1)
        run.step()
        for name, seen in rows.items():
            seen.append(_seen(run, name))
    return {name: _track(np.array(seen)) for name, seen in rows.items()}


def _seen(run: ScenarioSimulation, name: str) -> tuple[float, ...]:
    snapshot, row = run.snapshot, run.snapshot.index_of[name]
    at = run.world.road.points_ahead(
        snapshot.lane[[row]], snapshot.lane_position_m[[row]], snapshot.next_lane[[row]]
    )
    drives = steers = True
    if name in run.vehicle_ids:
        slot = run.fleet.slot_of(name)
        drives = bool(run.fleet.longitudinal[slot] == Longitudinal.DRIVER)
        steers = bool(run.fleet.lateral[slot] == Lateral.DRIVER)
    return (
        float(snapshot.front_x_m[row]),
        float(snapshot.front_y_m[row]),
        float(snapshot.speed_mps[row]),
        float(snapshot.heading_rad[row]),
        float(at.heading_rad[0]) if snapshot.lane[row] >= 0 else math.nan,
        float(drives),
        float(steers),
    )


def _track(seen: FloatColumn) -> Track:
    x_m, y_m, speed_mps, heading_rad, lane_rad, drives, steers = seen.T
    east, north = np.diff(x_m), np.diff(y_m)
    way = lane_rad[:-1] + 0.5 * _wrapped(np.diff(lane_rad))
    return Track(
        east * np.cos(way) + north * np.sin(way),
        north * np.cos(way) - east * np.sin(way),
        speed_mps,
        _wrapped(heading_rad - lane_rad),
        drives > 0.0,
        steers > 0.0,
    )


def _wrapped(angle_rad: FloatColumn) -> FloatColumn:
    wrapped: FloatColumn = np.remainder(angle_rad + np.pi, 2.0 * np.pi) - np.pi
    return wrapped
