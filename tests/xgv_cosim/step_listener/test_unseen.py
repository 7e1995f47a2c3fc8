"""Point 3.2 under ``attach``: a script reads its own vehicles from SUMO, and no ghosts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from traci import constants

import xgv_cosim
from tests.xgv_cosim.step_listener.conftest import Script
from tests.xgv_cosim.step_listener.scripts import command
from tests.xgv_cosim.step_listener.test_detach import ghosts_of, shift_left, steps
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.worlds.sumo.ghosts import GHOST_PREFIX, is_ghost, owner_in
from xgv_cosim.worlds.sumo.unseen import NOBODY, READINGS

CARS = {"ego", "left", "beside"}
DETECTORS = """<additional>
<inductionLoop id="loop" lane="road_1" pos="400.09" period="100" file="NUL"/>
<laneAreaDetector id="area" lane="road_1" pos="350" endPos="500" period="100" file="NUL"/>
</additional>"""
LISTS: dict[tuple[str, str], tuple[str, ...]] = {
    ("vehicle", "getIDList"): (),
    ("vehicle", "getLoadedIDList"): (),
    ("vehicletype", "getIDList"): (),
    ("route", "getIDList"): (),
    ("simulation", "getDepartedIDList"): (),
    ("lane", "getLastStepVehicleIDs"): ("road_1",),
    ("edge", "getLastStepVehicleIDs"): ("road",),
    ("lanearea", "getLastStepVehicleIDs"): ("area",),
    ("inductionloop", "getLastStepVehicleIDs"): ("loop",),
    ("vehicle", "getContextSubscriptionResults"): ("left",),
}
"""Where a ghost is to be found, if nothing hides it."""
ON_LANE_1 = {"left", "beside"}


@pytest.fixture
def straddling(script: Script, tmp_path: Path) -> Iterator[xgv_cosim.Plugin]:
    plugin = straddle(script, tmp_path)
    yield plugin
    plugin.detach()


def straddle(script: Script, folder: Path) -> xgv_cosim.Plugin:
    """Start SUMO with ``ego`` at 400 m across the line to the left lane, and ``left`` behind it there."""
    (folder / "t.add.xml").write_text(DETECTORS.replace("NUL", str(folder / "loop.xml")))
    cars = car("ego", 400, 0, kind="xgv"), car("left", 370, 0, lane=1), car("beside", 460, 0, lane=1)
    config = write_config(folder, "".join(cars), network("hello"))
    script.start([*command(config), f"--additional-files={folder / 't.add.xml'}"])
    plugin = xgv_cosim.attach(script.module)
    plugin.bind("ego")
    steps(script, 1)
    script.module.simulation.subscribe(
        [constants.VAR_LOADED_VEHICLES_IDS, constants.VAR_DEPARTED_VEHICLES_IDS]
    )
    script.module.vehicle.subscribeContext("left", constants.CMD_GET_VEHICLE_VARIABLE, 90.0)
    script.module.vehicle.setSpeed("beside", 0.0)
    steps(script, 1)
    shift_left(plugin, 1.2)
    return plugin


def test_a_ghost_is_in_no_list_and_no_count(script: Script, straddling: xgv_cosim.Plugin) -> None:
    plugin = straddling
    sumo = script.module
    own = plugin._hold.engine
    assert own is not None
    hidden = set()
    for step in range(12):
        if step == 6:
            shift_left(plugin, -1.2)
        steps(script, 1)
        hidden |= {
            one for one in LISTS if any(map(is_ghost, getattr(getattr(own, one[0]), one[1])(*LISTS[one])))
        }
        assert ghosts_of(script) == []
        for domain in ("vehicle", "vehicletype", "route"):
            ids = getattr(sumo, domain).getIDList()
            assert not any(map(is_ghost, ids))
            assert getattr(sumo, domain).getIDCount() == len(ids)
        assert set(sumo.vehicle.getIDList()) == set(sumo.vehicle.getLoadedIDList()) == CARS
        assert sumo.simulation.getMinExpectedNumber() == 3
        for domain, getter in READINGS:
            if domain == "simulation" and getter.endswith("IDList"):
                ids = getattr(sumo.simulation, getter)()
                assert not any(map(is_ghost, ids)), getter
                assert getattr(sumo.simulation, getter.replace("IDList", "Number"))() == len(ids)
        assert all(not value for value in sumo.simulation.getSubscriptionResults().values())
        around = sumo.vehicle.getContextSubscriptionResults("left")
        assert set(around) <= CARS
        assert sumo.vehicle.getAllContextSubscriptionResults() == {"left": around}
        assert sumo.simulation.getCollisions() == ()
        for domain, name, there in (
            ("lane", "road_1", ON_LANE_1),
            ("edge", "road", CARS),
            ("lanearea", "area", {"left", "beside"}),
            ("inductionloop", "loop", set()),
        ):
            reading = getattr(sumo, domain)
            assert set(reading.getLastStepVehicleIDs(name)) <= there, domain
            assert reading.getLastStepVehicleNumber(name) == len(reading.getLastStepVehicleIDs(name)), domain
        speeds = [sumo.vehicle.getSpeed(name) for name in ON_LANE_1]
        assert sumo.lane.getLastStepHaltingNumber("road_1") == sum(speed < 0.1 for speed in speeds)
    # of contexts the plugin's own connection has none
    assert hidden == {one for one in LISTS if not (script.is_over_socket and "Context" in one[1])}
    assert ghosts_of(script, plugin) == []


def test_before_a_ghost_a_driver_has_its_owner_as_leader(
    script: Script, straddling: xgv_cosim.Plugin
) -> None:
    plugin = straddling
    steps(script, 3)
    vehicle, own = script.module.vehicle, plugin._hold.engine.vehicle
    assert is_ghost(own.getLeader("left", 100.0)[0])
    leader, gap_m = vehicle.getLeader("left", 100.0)
    assert (leader, gap_m) == ("ego", own.getLeader("left", 100.0)[1])
    if script.is_over_socket:
        assert vehicle.getLeader(dist=100.0, vehID="left") == (leader, gap_m)
    assert vehicle.getFollower("beside", 100.0)[0] == "ego"
    assert [name for name, _ in vehicle.getLeftFollowers("ego")] == ["left"]
    ghost = own.getLeader("left", 100.0)[0]
    assert {name for name, _ in own.getLeftLeaders("ego")} <= {ghost, "beside"}
    assert "ego" not in {name for name, _ in vehicle.getLeftLeaders("ego")}


def test_nobody_is_his_own_neighbour() -> None:
    ghost, leader = f"{GHOST_PREFIX}7:flow:3.1", READINGS["vehicle", "getLeader"]
    assert owner_in(ghost) == "flow:3.1"
    engine: Any = None  # is not asked
    assert leader(engine, ("flow:3.1", 50.0), (ghost, 2.0)) == NOBODY
    assert leader(engine, ("a", 50.0), (ghost, 2.0)) == ("flow:3.1", 2.0)
    assert leader(engine, ("a", 50.0), None) is None
    assert READINGS["vehicle", "getNeighbors"](engine, ("flow:3.1", 0), ((ghost, 2.0), ("a", 1.0))) == (
        ("a", 1.0),
    )


def test_a_ghost_is_nobodys_foe_at_a_junction() -> None:
    """Its owner is."""
    engine: Any = None  # is not asked
    ghost, owner = (f"{GHOST_PREFIX}7:b", 5.0), ("b", 5.0)
    assert READINGS["vehicle", "getJunctionFoes"](engine, ("a", 50.0), (ghost, owner)) == (owner,)


def test_a_domain_kept_from_before_shows_none_and_after_detach_sumo_answers_itself(
    script: Script, tmp_path: Path
) -> None:
    kept = script.module.vehicle
    plugin = straddle(script, tmp_path)
    steps(script, 2)
    assert ghosts_of(script, plugin)
    assert set(kept.getIDList()) == CARS
    assert kept.getIDCount() == 3
    plugin.detach()
    steps(script, 40)  # it has left when the car is at the centre of its lane
    script.module.vehicle.add(f"{GHOST_PREFIX}9:mine", GHOST_PREFIX + "road")
    assert f"{GHOST_PREFIX}9:mine" in script.module.vehicle.getLoadedIDList()


def test_another_connection_reads_as_before(over_socket: Script, tmp_path: Path) -> None:
    """Only what the plugin holds is read without ghosts."""
    (tmp_path / "other").mkdir()
    config = write_config(tmp_path / "other", car("ego", 400, 0, kind="xgv"), network("hello"))
    over_socket.start(command(config), label="other")
    other = over_socket.module.getConnection("other")
    other.route.add(f"{GHOST_PREFIX}r", ["road"])
    other.vehicle.add(f"{GHOST_PREFIX}1:x", f"{GHOST_PREFIX}r", typeID="xgv")
    over_socket.start(command(config), label="ours")
    ours = over_socket.module.getConnection("ours")
    ours.route.add(f"{GHOST_PREFIX}r", ["road"])
    with xgv_cosim.attach(ours):
        assert ours.route.getIDCount() == len(ours.route.getIDList()) == 1  # that of ego
        assert f"{GHOST_PREFIX}r" in other.route.getIDList()
        assert f"{GHOST_PREFIX}1:x" in other.vehicle.getLoadedIDList()
    assert f"{GHOST_PREFIX}r" in ours.route.getIDList()


def test_every_reading_is_there_in_both_libraries(script: Script, libsumo: Any) -> None:
    """A name that SUMO does not have would silently filter nothing."""
    missing = [
        (domain, getter)
        for domain, getter in READINGS
        if not hasattr(getattr(script.module, domain, None), getter)
    ]
    assert missing == []


def test_an_observer_that_reads_sumo_itself_sees_none_within_the_step(script: Script, tmp_path: Path) -> None:
    seen: list[tuple[str, ...]] = []

    class Reading:
        def record_event(self, event: object) -> None:
            """Nothing to do."""

        def record_step(self, *_: object) -> None:
            seen.append(script.module.vehicle.getIDList())

    script.start(command(write_config(tmp_path, car("ego", 400, 0, kind="xgv"), network("hello"))))
    with xgv_cosim.attach(script.module, observers=[Reading()]) as plugin:
        plugin.bind("ego")
        steps(script, 3)
        shift_left(plugin, 1.2)
        steps(script, 3)
        assert len(ghosts_of(script, plugin)) == 1
    assert seen == [("ego",)] * 6
