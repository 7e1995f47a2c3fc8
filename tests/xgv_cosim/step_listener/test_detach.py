"""What the plugin leaves in a script's simulation: nothing, whatever its vehicles were doing."""

from __future__ import annotations

import subprocess
import sys
import warnings
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import xgv_cosim
from tests.xgv_cosim.step_listener.conftest import Script
from tests.xgv_cosim.step_listener.scripts import LIKE_OURS, command
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.errors import WorldError
from xgv_cosim.script_warnings import SumoOptionsWarning
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
    steps(script, 30)
    assert vehicle.getLateralLanePosition("ego") == pytest.approx(0.0, abs=1e-6)
    steps(script, 90)
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
    steps(script, 30)  # as long as a car is on its way to the centre, the script sees none
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
@pytest.mark.parametrize("released_first", [False, True])
def test_who_is_given_back_beside_the_centre_of_the_lane_does_not_jump(
    script: Script, tmp_path: Path, duration_s: int, released_first: bool
) -> None:
    """Point 3.3, in a session of the script's own too: lateral steps below 0.15 m, speed steps 0.2 m/s."""
    plugin = beside_the_centre(script, tmp_path, duration_s=duration_s)
    vehicle = script.module.vehicle
    seen = [(vehicle.getLateralLanePosition("ego"), vehicle.getSpeed("ego"))]
    assert seen[0][0] > 0.9
    if released_first:
        plugin.release("ego")
        seen += rows(script, 5)
    plugin.detach()
    seen += rows(script, 40)
    lateral_m, speed_mps = (np.abs(np.diff(column)) for column in zip(*seen, strict=True))
    assert lateral_m.max() < 0.15
    assert speed_mps[:10].max() < 0.2  # then he accelerates with the 2.6 m/s² of his type
    assert seen[-1][0] == pytest.approx(0.0, abs=1e-6)


def beside_the_centre(script: Script, folder: Path, duration_s: int = 3) -> xgv_cosim.Plugin:
    """Attach, and have the bound ``ego`` 1.2 m left of the centre of its lane."""
    options = [option for option in LIKE_OURS if "duration" not in option]
    config = write_config(folder, car("ego", 400, 10, kind="xgv"), network("hello"))
    script.start(command(config, options=[*options, f"--lanechange.duration={duration_s}"]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SumoOptionsWarning)
        plugin = xgv_cosim.attach(script.module)
        plugin.bind("ego")
        steps(script, 10)
    shift_left(plugin, 1.2)
    steps(script, 2)
    return plugin


def rows(script: Script, number: int) -> list[tuple[float, float]]:
    """Step, and return lateral position and speed of ``ego`` after each step."""
    vehicle, found = script.module.vehicle, []
    for _ in range(number):
        steps(script, 1)
        found.append((vehicle.getLateralLanePosition("ego"), vehicle.getSpeed("ego")))
    return found


def test_a_car_faster_than_its_driver_wants_is_not_braked_hard_after_detach(
    script: Script, tmp_path: Path
) -> None:
    plugin = attach_to(script, tmp_path, car("ego", 400, 10, kind="xgv"))
    vehicle = script.module.vehicle
    steps(script, 10)
    own = vehicle.getMaxSpeed("ego"), vehicle.getTypeID("ego")
    vehicle.setSpeedFactor("ego", 0.4)
    seen = [(0.0, vehicle.getSpeed("ego"))]
    plugin.detach()
    seen += rows(script, 150)
    assert np.abs(np.diff([speed_mps for _, speed_mps in seen])).max() < 0.2
    assert (vehicle.getMaxSpeed("ego"), vehicle.getTypeID("ego")) == own
    assert vehicle.getSpeedFactor("ego") == pytest.approx(0.4)
    assert seen[-1][1] == pytest.approx(vehicle.getAllowedSpeed("ego"), abs=0.05)


def test_a_plugin_that_leaves_with_an_error_takes_everything_back_at_once(
    script: Script, tmp_path: Path
) -> None:
    """The figures of docs/limits.md."""
    plugin = attach_to(script, tmp_path, car("ego", 400, 10, kind="xgv"))
    vehicle = script.module.vehicle
    steps(script, 10)
    shift_left(plugin, 0.7)
    steps(script, 2)
    vehicle.setMaxSpeed("ego", 5.0)  # so its driver finds the car too fast
    lateral_m, speed_mps = vehicle.getLateralLanePosition("ego"), vehicle.getSpeed("ego")
    assert lateral_m > 0.4
    with pytest.raises(KeyError), plugin:
        raise KeyError
    steps(script, 1)
    assert vehicle.getLateralLanePosition("ego") == pytest.approx(0.0, abs=1e-6)
    assert speed_mps - vehicle.getSpeed("ego") == pytest.approx(0.9, abs=0.01)


def test_after_the_last_hand_over_nothing_is_left_of_the_plugin(libsumo: ModuleType, tmp_path: Path) -> None:
    before = dict(vars(libsumo.simulation)), dict(vars(libsumo._libsumo))
    script = Script(libsumo)
    plugin = beside_the_centre(script, tmp_path)
    plugin.detach()
    plugin.detach()  # does nothing more
    with pytest.raises(WorldError, match="no simulation"):
        plugin.vehicle("ego")
    assert (dict(vars(libsumo.simulation)), dict(vars(libsumo._libsumo))) != before
    libsumo.simulationStep(10.0)
    assert libsumo.simulation.getTime() == pytest.approx(10.0)
    assert libsumo.vehicle.getLateralLanePosition("ego") == pytest.approx(0.0, abs=1e-6)
    libsumo.simulationStep()
    assert libsumo.simulation.getTime() == pytest.approx(10.1)
    assert (dict(vars(libsumo.simulation)), dict(vars(libsumo._libsumo))) == before


def test_the_next_plugin_need_not_wait(script: Script, tmp_path: Path) -> None:
    """What is under way is taken back at once then: the next one may bind the same car."""
    beside_the_centre(script, tmp_path).detach()
    steps(script, 3)
    assert script.module.vehicle.getLateralLanePosition("ego") > 0.5
    with xgv_cosim.attach(script.module) as again:
        again.bind("ego")
        assert script.module.vehicle.getLateralLanePosition("ego") == pytest.approx(0.0, abs=1e-6)
        steps(script, 5)
        assert again.vehicle_ids == ("ego",)


@pytest.mark.parametrize("how", ["close", "load", "remove", "carry on"])
def test_what_the_script_does_after_detach_is_its_own(script: Script, tmp_path: Path, how: str) -> None:
    plugin = beside_the_centre(script, tmp_path)
    plugin.detach()
    steps(script, 2)
    if how == "close":
        script.module.close()
        script.start(command(tmp_path / "t.sumocfg"), label="again")
    elif how == "load":
        script.module.load(command(tmp_path / "t.sumocfg")[1:])
    elif how == "remove":
        script.module.vehicle.remove("ego")
    steps(script, 50)
    assert ("ego" in script.module.vehicle.getIDList()) is (how != "remove")
    assert script.module.simulation.getTime() == pytest.approx(6.4 if how in {"remove", "carry on"} else 5.0)


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


ANEW = """
from itertools import product
from pathlib import Path
import sys
import libsumo
from tests.xgv_cosim.step_listener.conftest import Script
from tests.xgv_cosim.step_listener.scripts import command
from tests.xgv_cosim.step_listener.test_detach import attach_to, shift_left, steps
from tests.xgv_cosim.worlds.sumo_traffic import car

folder, script = Path(sys.argv[1]), Script(libsumo)
for how, released_before in product(["close", "detach", "load", "error"], [False, True]):
    plugin = attach_to(script, folder, car("ego", 400, 10, kind="xgv"))
    steps(script, 10)
    shift_left(plugin, -8.0)
    steps(script, 2)
    if released_before:
        plugin.release("ego")
        steps(script, 5)
    if how == "error":
        plugin.__exit__(ValueError, ValueError(), None)
    elif how != "close":
        plugin.detach()
    again = command(folder / "t.sumocfg")
    if how == "load":
        libsumo.load(again[1:])
    else:
        libsumo.close()
        libsumo.start(again)
    if how == "close":
        plugin.detach()
    steps(script, 2)
    place = libsumo.vehicle.getLaneID("ego"), round(libsumo.vehicle.getPosition("ego")[0])
    print(how, released_before, *place)
    libsumo.close()
"""


def test_who_was_off_the_road_in_one_simulation_moves_nobody_in_the_next(tmp_path: Path) -> None:
    """libsumo keeps a move that no step follows, and makes it in the next simulation of its process."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", ANEW, str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[3],
    )
    told = [line for line in done.stdout.splitlines() if "road_0" in line]
    assert told == [
        f"{how} {released_before} road_0 401"
        for how in ("close", "detach", "load", "error")
        for released_before in (False, True)
    ], done.stderr
