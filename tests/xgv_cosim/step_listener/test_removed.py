"""A script takes vehicles out of SUMO, bound or not, or commands them: the plugin goes on with the others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import xgv_cosim
from tests.xgv_cosim.step_listener.conftest import Script
from tests.xgv_cosim.step_listener.scripts import LIKE_OURS, command
from tests.xgv_cosim.step_listener.test_detach import ghosts_of, shift_left, steps
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.script_warnings import SumoOptionsWarning

ROUTE = '<route id="road" edges="road"/>'
CARS = (
    car("ego", 400, 10, kind="xgv"),
    car("other", 300, 10, kind="xgv"),
    car("left", 398, 10, lane=1),
    car("back", 250, 10),
)


@pytest.fixture
def plugin(script: Script, tmp_path: Path) -> Iterator[xgv_cosim.Plugin]:
    script.start(command(write_config(tmp_path, ROUTE + "".join(CARS), network("hello"))))
    with xgv_cosim.attach(script.module, colours=True) as plugin:
        yield plugin


@pytest.mark.parametrize("row", [{}, {"coupling": "free"}, {"driver": "world", "stack": "none"}])
def test_a_bound_car_that_the_script_removes_is_released_and_all_else_goes_on(
    script: Script, plugin: xgv_cosim.Plugin, row: dict[str, str]
) -> None:
    plugin.bind(["ego", "other", "later"], **row)
    steps(script, 10)
    slot = plugin._opened().fleet.slot_of("ego")
    script.module.vehicle.remove("ego")
    (released,) = (event for event in plugin.events if event.kind == "released")
    assert (released.t_s, released.vehicle) == (1.0, "ego")
    assert released.reasons == ("the script removed it from SUMO",)
    plugin.snapshot.read_all()  # also of who is gone
    assert plugin.vehicle_ids == ("other",)
    script.module.vehicle.add("later", "road", typeID="xgv")
    steps(script, 20)
    assert plugin._opened().fleet.slot_of("later") == slot
    assert plugin.vehicle("other").speed_mps > 5.0


def refused(script: Script, *vehicles: str) -> None:
    """Try to remove vehicles with a reason that SUMO does not know."""
    for name in vehicles:
        with pytest.raises(script.module.TraCIException):
            script.module.vehicle.remove(name, 9)


def test_a_removal_that_sumo_refuses_changes_nothing(script: Script, plugin: xgv_cosim.Plugin) -> None:
    plugin.bind("ego")
    plugin.bind("back", from_s=3)
    steps(script, 10)
    endpoint = plugin._opened().state.vehicle("ego").endpoint
    refused(script, "ego", "back", "nobody")
    assert plugin.vehicle_ids == ("ego",)
    assert plugin.snapshot.index_of.keys() == {"ego", "other", "left", "back"}
    steps(script, 25)
    assert [event.vehicle for event in plugin.events if event.kind == "bound"] == ["ego", "back"]
    assert not [event for event in plugin.events if event.kind == "released"]
    assert plugin._opened().state.vehicle("ego").endpoint is endpoint


def test_a_refused_removal_leaves_a_hand_over_after_detach_its_end(
    script: Script, plugin: xgv_cosim.Plugin
) -> None:
    plugin.bind("ego")
    steps(script, 10)
    fleet, own = plugin._opened().fleet, script.module.vehicle.getSpeedFactor("ego")
    fleet.motion.speed_mps[fleet.slot_of("ego")] = 1.2 * script.module.lane.getMaxSpeed("road_0")
    steps(script, 1)
    plugin.detach()
    steps(script, 2)
    assert script.module.vehicle.getSpeedFactor("ego") > own  # until its driver has slowed down
    refused(script, "ego")
    steps(script, 80)
    assert script.module.vehicle.getSpeedFactor("ego") == own


def test_its_ghost_goes_with_it(script: Script, plugin: xgv_cosim.Plugin) -> None:
    plugin.bind("ego")
    steps(script, 3)
    shift_left(plugin, 1.2)
    steps(script, 1)
    script.module.vehicle.remove("left")  # whom the plugin does not drive, and contacts look at
    steps(script, 2)
    assert len(ghosts_of(script, plugin)) == 1
    script.module.vehicle.remove(vehID="ego")
    steps(script, 3)
    assert ghosts_of(script, plugin) == []


def test_another_car_may_have_its_id_at_once(script: Script, plugin: xgv_cosim.Plugin) -> None:
    plugin.bind("ego")
    steps(script, 10)
    script.module.vehicle.remove("ego")
    script.module.vehicle.add("ego", "road", typeID="car")
    steps(script, 20)
    assert [event.kind for event in plugin.events if event.kind in {"bound", "released"}] == [
        "bound",
        "released",
        "bound",
    ]
    row = plugin.snapshot.index_of["ego"]
    assert (plugin.snapshot.type_ids[row], plugin.snapshot.length_m[row]) == ("car", 5.2)
    assert plugin.snapshot.front_x_m[row] < 60.0


def test_wrecks_are_towed_away(script: Script, plugin: xgv_cosim.Plugin) -> None:
    plugin.bind("ego")
    steps(script, 10)
    shift_left(plugin, 2.0)
    steps(script, 10)
    assert {event.vehicle for event in plugin.events if event.kind == "crashed"} == {"ego", "left"}
    script.module.vehicle.remove("left")
    script.module.vehicle.remove("ego")
    script.module.vehicle.add("left", "road", typeID="car", departLane="1")
    steps(script, 50)
    assert script.module.vehicle.getSpeed("left") > 3.0


@pytest.mark.parametrize("then", ["close", "detach", "bind those who are there"])
def test_what_follows_a_removal(script: Script, plugin: xgv_cosim.Plugin, then: str) -> None:
    plugin.bind("ego")
    steps(script, 10)
    script.module.vehicle.remove("ego")
    script.module.vehicle.remove("left")
    if then == "close":
        script.module.close()
        return
    plugin.detach() if then == "detach" else plugin.bind(type="*")
    steps(script, 10)
    assert set(script.module.vehicle.getIDList()) == {"other", "back"}
    assert set(plugin.vehicle_ids) == (set() if then == "detach" else {"other", "back"})


@pytest.mark.parametrize("by", ["release", "detach"])
def test_a_car_that_is_eased_to_its_driver_may_be_removed(
    script: Script, plugin: xgv_cosim.Plugin, by: str
) -> None:
    plugin.bind("ego")
    steps(script, 10)
    fleet = plugin._opened().fleet
    fleet.motion.speed_mps[fleet.slot_of("ego")] = 40.0  # faster than its driver wants
    shift_left(plugin, 0.7)
    steps(script, 3)
    plugin.release("ego") if by == "release" else plugin.detach()
    steps(script, 2)
    script.module.vehicle.remove("ego")
    steps(script, 10)
    assert "ego" not in script.module.vehicle.getIDList()


COMMANDS: dict[str, Callable[[Any], None]] = {
    "onto another lane": lambda vehicle: vehicle.moveTo("ego", "road_1", 450.0),
    "off the road": lambda vehicle: vehicle.moveToXY("ego", "", -1, 500.0, 20.0, 90.0, 2),
    "a new route": lambda vehicle: vehicle.setRoute("ego", ["road"]),
    "a new type": lambda vehicle: vehicle.setType("ego", "car"),
    "a speed": lambda vehicle: vehicle.setSpeed("ego", 3.0),
    "a lane change": lambda vehicle: vehicle.changeLane("ego", 1, 2.0),
}


@pytest.mark.parametrize("what", list(COMMANDS))
def test_commands_of_the_script_to_a_bound_car_end_nothing(
    script: Script, plugin: xgv_cosim.Plugin, what: str
) -> None:
    plugin.bind("ego")
    steps(script, 10)
    COMMANDS[what](script.module.vehicle)
    steps(script, 10)
    assert plugin.vehicle_ids == ("ego",)
    assert plugin.snapshot.placement_error_m.max() < 0.05 + 1e-9


def test_a_bound_car_stands_longer_than_the_scripts_time_to_teleport(script: Script, tmp_path: Path) -> None:
    options = ["--time-to-teleport=2" if "teleport" in option else option for option in LIKE_OURS]
    config = write_config(tmp_path, car("ego", 400, 0, kind="xgv"), network("hello"))
    script.start(command(config, options=options))
    with xgv_cosim.attach(script.module) as plugin:
        plugin.bind("ego", start="cold", stack="none", driver="none")
        with pytest.warns(SumoOptionsWarning, match="time-to-teleport"):
            steps(script, 1)
        steps(script, 60)
        assert plugin.vehicle_ids == ("ego",)
        assert not [event for event in plugin.events if event.kind == "teleport"]
