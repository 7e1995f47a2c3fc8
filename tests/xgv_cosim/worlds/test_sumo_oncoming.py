"""A body in the lane of oncoming traffic is seen there, wherever SUMO has the vehicle itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.contracts.world_contract import nobody, place
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from pathlib import Path

NODES = '<node id="a" x="0" y="0"/><node id="b" x="400" y="0"/>'
EDGES = "".join(
    f'<edge id="{name}" from="{ends[0]}" to="{ends[1]}" numLanes="2" speed="14"/>'
    for name, ends in (("there", "ab"), ("back", "ba"))
)
REAR_M = 200.0 - 4.4
INNER_LANE_Y_M = -1.6


@pytest.mark.parametrize("lateral_m", [1.5, 3.2])
def test_an_oncoming_driver_stops_before_a_car_that_reaches_into_his_lane(
    tmp_path: Path, lateral_m: float
) -> None:
    """A body over the middle line, and one wholly in the other lane, where SUMO has it on no lane."""
    ego = car("ego", 150, 0, kind="xgv", lane=1, route="there")
    others = car("oncoming", 30, 12, lane=1, route="back") + car("outer", 30, 12, route="back")
    net = plain_network(tmp_path, NODES, EDGES)
    world = SumoWorld.headless(write_config(tmp_path, ego + others, net), step_s=0.1, seed=1)
    try:
        world.start()
        world.step(nobody())
        world.bind("ego", CouplingKind.FREE)
        y_m = INNER_LANE_Y_M + lateral_m
        for _ in range(250):
            snapshot = world.step(place("ego", 200.0, y_m, 0.0, speed_mps=0.0, travelled_m=0.0))
            assert snapshot.collisions == ()
        row = snapshot.index_of["oncoming"]
        assert snapshot.speed_mps[row] == pytest.approx(0.0, abs=0.05)
        assert 1.0 < snapshot.front_x_m[row] - 200.0 < 3.0  # before the car's front, which faces him
        outer = snapshot.index_of["outer"]
        assert snapshot.front_x_m[outer] < REAR_M - 20.0  # drives by
        world.step(place("ego", 200.0, INNER_LANE_Y_M, 0.0, speed_mps=0.0, travelled_m=0.0))
        assert load_libsumo().vehicle.getIDCount() == 3
    finally:
        world.close()


def test_lanes_that_lead_back_between_the_same_junctions_are_oncoming(tmp_path: Path) -> None:
    twin = '<edge id="twin" from="a" to="b" numLanes="1" speed="14" shape="0,40 400,40"/>'
    net = plain_network(tmp_path, NODES, EDGES + twin)
    world = SumoWorld.headless(write_config(tmp_path, "", net), step_s=0.1, seed=1)
    try:
        world.start()
        road, number = world.road, world.road.index_of
        back = (number["back_1"],)
        assert [road.oncoming(number[name]) for name in ("there_0", "there_1", "twin_0")] == [back] * 3
        assert set(road.oncoming(number["back_0"])) == {number["there_1"], number["twin_0"]}
        inside = np.flatnonzero(road.inside_junction)
        assert all(road.oncoming(int(lane)) == () for lane in inside)
    finally:
        world.close()
