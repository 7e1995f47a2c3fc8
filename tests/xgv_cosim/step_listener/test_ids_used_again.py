"""An id that another car has after the first one: nothing of the first one is left."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import xgv_cosim
from tests.xgv_cosim.step_listener.conftest import Script
from tests.xgv_cosim.step_listener.scripts import command
from tests.xgv_cosim.step_listener.test_detach import steps
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.simulation.painting import mode_style

NODES = "".join(
    f'<node id="{name}" x="{x}" y="{y}"/>'
    for name, x, y in (("A", 0, 0), ("B", 120, 0), ("L", 220, 80), ("R", 220, -80))
)
EDGES = (
    '<edge id="in" from="A" to="B" numLanes="2" speed="13.9"><lane index="1" disallow="bus"/></edge>'
    '<edge id="left" from="B" to="L" numLanes="1" speed="13.9"/>'
    '<edge id="right" from="B" to="R" numLanes="1" speed="13.9"/>'
)
DEMAND = '<vType id="bus" vClass="bus" length="9"/><route id="to_right" edges="in right"/>'
ROAD = '<route id="road" edges="road"/>'
RED = (255, 0, 0, 255)


def attach_at_fork(script: Script, folder: Path, first: str) -> xgv_cosim.Plugin:
    """Attach where a road forks; ego, a car, is bound on the right lane before it."""
    script.start(command(write_config(folder, DEMAND + first, plain_network(folder, NODES, EDGES))))
    plugin = xgv_cosim.attach(script.module, colours=True)
    plugin.bind("ego")
    return plugin


def sees(plugin: xgv_cosim.Plugin) -> tuple[bool, bool]:
    """Return whether ego's stack sees that its route asks for another lane, and that there is one."""
    around = plugin._world.surroundings(("ego",))
    return bool(around.lane_changes[0]), not np.isnan(around.left.offset_m[0])


@pytest.mark.parametrize("how", ["removed", "arrived"])
def test_the_stack_of_another_car_drives_its_own_route(script: Script, tmp_path: Path, how: str) -> None:
    route, at_m = ("in left", 80) if how == "removed" else ("in", 114)
    with attach_at_fork(script, tmp_path, car("ego", at_m, 8, route=route)) as plugin:
        steps(script, 3)
        if how == "removed":
            assert sees(plugin) == (True, True)
            script.module.vehicle.remove("ego")
        else:
            assert sees(plugin)[1]
            while plugin.vehicle_ids:
                steps(script, 1)
            assert (plugin.events[-1].reasons, plugin.now_s < 0.9) == (("arrived",), True)
        script.module.vehicle.add("ego", "to_right", typeID="bus", departPos="80", departSpeed="8")
        steps(script, 2)
        assert plugin.vehicle_ids == ("ego",)
        assert sees(plugin) == (False, False)  # to the right, and the left lane is closed to it


def test_a_car_of_another_class_finds_other_lanes_within_a_second(script: Script, tmp_path: Path) -> None:
    with attach_at_fork(script, tmp_path, car("ego", 20, 5, route="in left")) as plugin:
        steps(script, 5)
        assert sees(plugin)[1]
        script.module.vehicle.setType("ego", "bus")
        steps(script, 10)
        assert not sees(plugin)[1]


def test_others_are_taken_to_go_where_a_car_of_that_id_goes(script: Script, tmp_path: Path) -> None:
    first = car("ego", 20, 5, route="in left") + car("other", 80, 5, route="in left")
    with attach_at_fork(script, tmp_path, first) as plugin:
        steps(script, 2)
        assert plugin._world._surroundings is not None
        routes, road = plugin._world._surroundings._routes, 0
        assert routes.edges("other", road, plugin.now_s) == ("left",)
        script.module.vehicle.remove("other")
        script.module.vehicle.add("other", "to_right", departPos="80")
        steps(script, 2)
        assert routes.edges("other", road, plugin.now_s) == ("right",)


def test_a_binding_that_waits_for_its_time_goes_with_its_car(script: Script, tmp_path: Path) -> None:
    demand = ROAD + car("ego", 100, 10, kind="xgv")
    script.start(command(write_config(tmp_path, demand, network("hello"))))
    with xgv_cosim.attach(script.module) as plugin:
        plugin.bind(type="xgv", from_s=2)
        steps(script, 5)
        script.module.vehicle.remove("ego")
        script.module.vehicle.add("ego", "road", typeID="car")  # whom no row means
        steps(script, 30)
        assert plugin.vehicle_ids == ()
        plugin.bind("ego")
        steps(script, 2)


def test_each_car_has_its_own_colour_back(script: Script, tmp_path: Path) -> None:
    script.start(command(write_config(tmp_path, ROAD + car("ego", 100, 10), network("hello"))))
    vehicle = script.module.vehicle
    with xgv_cosim.attach(script.module, colours=True) as plugin:
        plugin.bind("ego", stack="none", driver="world")
        steps(script, 20)
        painted = vehicle.getColor("ego")
        vehicle.remove("ego")
        vehicle.add("ego", "road", typeID="car")
        vehicle.setColor("ego", RED)
        steps(script, 20)
        assert vehicle.getColor("ego") == painted == (*mode_style(plugin.vehicle("ego").mode).rgb, 255)
        plugin.release("ego")
        steps(script, 2)
        assert vehicle.getColor("ego") == RED
