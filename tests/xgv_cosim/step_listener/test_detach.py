"""What the plugin leaves in a script's simulation: nothing, whatever its vehicles were doing."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import xgv_cosim
from tests.xgv_cosim.step_listener.conftest import Script
from tests.xgv_cosim.step_listener.scripts import LIKE_OURS, command
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.step_listener import SumoOptionsWarning
from xgv_cosim.worlds.sumo.ghosts import GHOST_PREFIX


def shift_left(plugin: xgv_cosim.Plugin, by_m: float) -> None:
    """Move the bound ``ego`` sideways."""
    assert plugin._simulation is not None
    fleet = plugin._simulation.fleet
    slot = fleet.slot_of("ego")
    heading = fleet.motion.heading_rad[slot]
    fleet.motion.x_m[slot] -= np.sin(heading) * by_m
    fleet.motion.y_m[slot] += np.cos(heading) * by_m


def attach_to(script: Script, folder: Path, *vehicles: str) -> xgv_cosim.Plugin:
    script.start(command(write_config(folder, "".join(vehicles), network("hello"))))
    plugin = xgv_cosim.attach(script.module)
    plugin.bind("ego")
    return plugin


def steps(script: Script, number: int) -> None:
    for _ in range(number):
        script.module.simulationStep()


def ghosts_of(script: Script, plugin: xgv_cosim.Plugin | None = None) -> list[str]:
    """Return the ghosts in SUMO as the script sees it, or as a plugin does that is attached."""
    engine = script.module if plugin is None else plugin._hold.engine
    return [name for name in engine.vehicle.getIDList() if name.startswith(GHOST_PREFIX)]


def test_detached_while_straddling_no_ghost_stays_and_another_plugin_can_follow(
    script: Script, tmp_path: Path
) -> None:
    plugin = attach_to(script, tmp_path, car("ego", 400, 0, kind="xgv"), car("left", 330, 12, lane=1))
    vehicle = script.module.vehicle
    steps(script, 3)
    shift_left(plugin, 1.2)
    steps(script, 3)
    assert len(ghosts_of(script, plugin)) == 1
    plugin.detach()
    steps(script, 1)
    assert ghosts_of(script) == []
    assert vehicle.getLateralLanePosition("ego") == pytest.approx(0.0, abs=1e-6)
    steps(script, 120)
    assert vehicle.getLanePosition("left") > 430.0  # nothing stands in its way
    assert vehicle.getSpeed("ego") > 10.0
    again = xgv_cosim.attach(script.module)
    again.bind("ego")
    steps(script, 3)
    shift_left(again, 1.2)
    steps(script, 3)
    assert len(ghosts_of(script, again)) == 1
    again.detach()


def test_ghosts_that_somebody_has_left_are_no_obstacle_to_new_ones(script: Script, tmp_path: Path) -> None:
    """A script that loads a saved state has the ghosts of the time of saving, their types and routes."""
    plugin = attach_to(script, tmp_path, car("ego", 400, 0, kind="xgv"))
    module = script.module
    module.route.add(f"{GHOST_PREFIX}road", ["road"])
    module.vehicletype.copy("xgv", f"{GHOST_PREFIX}xgv")
    module.vehicle.add(f"{GHOST_PREFIX}1:ego", f"{GHOST_PREFIX}road", typeID=f"{GHOST_PREFIX}xgv")
    steps(script, 3)
    shift_left(plugin, 1.2)
    steps(script, 3)
    assert sorted(ghosts_of(script, plugin)) == [f"{GHOST_PREFIX}1:ego", f"{GHOST_PREFIX}2:ego"]
    plugin.detach()
    steps(script, 1)
    assert ghosts_of(script) == [f"{GHOST_PREFIX}1:ego"]


def test_detached_after_a_crash_both_drive_on(script: Script, tmp_path: Path) -> None:
    vehicles = (car("ego", 400, 10, kind="xgv"), car("left", 398, 10, lane=1), car("back", 300, 10, lane=1))
    plugin = attach_to(script, tmp_path, *vehicles)
    vehicle = script.module.vehicle
    steps(script, 10)
    shift_left(plugin, 2.0)
    steps(script, 10)
    assert {event.vehicle for event in plugin.events if event.kind == "crashed"} == {"ego", "left"}
    assert vehicle.getSpeedMode("left") == 0
    plugin.detach()
    assert [(vehicle.getSpeedMode(name), vehicle.getLaneChangeMode(name)) for name in ("ego", "left")] == [
        (31, 1621)
    ] * 2
    steps(script, 200)
    assert ghosts_of(script) == []
    for name in ("ego", "left", "back"):
        assert vehicle.getSpeed(name) > 10.0, name


@pytest.mark.parametrize("duration_s", [0, 3])
def test_released_first_nothing_jumps_and_detach_finds_nothing_to_take_back(
    script: Script, tmp_path: Path, duration_s: int
) -> None:
    """Point 3.3, in a session of the script's own too; ``detach`` alone jumps, as docs/limits.md says."""
    options = [option for option in LIKE_OURS if "duration" not in option]
    config = write_config(tmp_path, car("ego", 400, 10, kind="xgv"), network("hello"))
    script.start(command(config, options=[*options, f"--lanechange.duration={duration_s}"]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SumoOptionsWarning)
        plugin = xgv_cosim.attach(script.module)
        plugin.bind("ego")
        steps(script, 10)
    vehicle = script.module.vehicle
    shift_left(plugin, 1.2)
    steps(script, 2)
    seen = [(vehicle.getLateralLanePosition("ego"), vehicle.getSpeed("ego"))]
    assert seen[0][0] > 0.9
    plugin.release("ego")
    for step in range(40):
        if step == 30:
            plugin.detach()
        steps(script, 1)
        seen.append((vehicle.getLateralLanePosition("ego"), vehicle.getSpeed("ego")))
    lateral_m, speed_mps = (np.abs(np.diff(column)) for column in zip(*seen, strict=True))
    assert lateral_m.max() < 0.15
    assert speed_mps[:10].max() < 0.2  # then he accelerates with the 2.6 m/s² of his type
    assert speed_mps[30:].max() < 0.27
    assert seen[-1][0] == pytest.approx(0.0, abs=1e-6)


def test_detach_alone_takes_back_at_once_what_it_eases(script: Script, tmp_path: Path) -> None:
    """The figures of docs/limits.md."""
    plugin = attach_to(script, tmp_path, car("ego", 400, 10, kind="xgv"))
    vehicle = script.module.vehicle
    steps(script, 10)
    shift_left(plugin, 0.7)
    steps(script, 2)
    vehicle.setMaxSpeed("ego", 5.0)  # so its driver finds the car too fast
    lateral_m, speed_mps = vehicle.getLateralLanePosition("ego"), vehicle.getSpeed("ego")
    assert lateral_m > 0.4
    plugin.detach()
    steps(script, 1)
    assert vehicle.getLateralLanePosition("ego") == pytest.approx(0.0, abs=1e-6)
    assert speed_mps - vehicle.getSpeed("ego") == pytest.approx(0.9, abs=0.01)


@pytest.mark.parametrize("released_before", [False, True])
def test_detached_off_the_road_sumo_drives_on_from_the_nearest_lane(
    script: Script, tmp_path: Path, released_before: bool
) -> None:
    plugin = attach_to(script, tmp_path, car("ego", 400, 10, kind="xgv"))
    vehicle = script.module.vehicle
    steps(script, 10)
    shift_left(plugin, -8.0)
    steps(script, 2)
    assert vehicle.getLaneID("ego") == ""
    if released_before:
        plugin.release("ego")
        steps(script, 5)
    at_m = vehicle.getPosition("ego")
    plugin.detach()
    steps(script, 1)
    assert vehicle.getLaneID("ego") == "road_0"
    assert np.hypot(*np.subtract(vehicle.getPosition("ego"), at_m)) < 10.0
    assert vehicle.getLateralLanePosition("ego") == pytest.approx(0.0, abs=1e-6)
    steps(script, 100)
    assert vehicle.getSpeed("ego") > 10.0
    assert script.module.vehicle.getTeleportingIDList() == ()
