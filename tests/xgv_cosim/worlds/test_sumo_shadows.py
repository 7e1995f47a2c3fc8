"""SUMO keeps no placed vehicle in a lane that its body has left."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.worlds.sumo.couplings import KEEP_ROUTE_AND_POSE, MATCH_THRESHOLD_M
from xgv_cosim.worlds.sumo.road import SumoRoad
from xgv_cosim.worlds.sumo.session import Session
from xgv_cosim.worlds.sumo.shadows import Shadows

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

ARMS = {"w": (-400, 0), "e": (400, 0), "s": (0, -200), "n": (0, 200)}
NODES = '<node id="c" x="0" y="0"/>' + "".join(
    f'<node id="{name}" x="{x}" y="{y}"/>' for name, (x, y) in ARMS.items()
)
EDGES = "".join(
    f'<edge id="{ends[0]}{ends[1]}" from="{ends[0]}" to="{ends[1]}" numLanes="2" speed="14"/>'
    for name in ARMS
    for ends in (name + "c", "c" + name)
)
RIGHT_Y_M, LEFT_Y_M = -4.8, -1.6


def follow(
    tmp_path: Path, vehicles: str, path: Iterable[tuple[float, float]], *, behind_too: float = 0.0
) -> tuple[str, float]:
    """Place ``ego``, heading east, along a path, 0.1 s a point; return where ``behind`` is then.

    With ``behind_too`` he is placed as well, on the left lane, from there on.
    """
    config = write_config(tmp_path, vehicles, plain_network(tmp_path, NODES, EDGES))
    session = Session(config, step_s=0.1, seed=1)
    try:
        engine: Any = session.engine
        road = SumoRoad.read(engine)
        shadows, vehicle = Shadows(engine, road), engine.vehicle
        session.step()
        for name in ("ego", "behind"):
            vehicle.setLaneChangeMode(name, 0)
        vehicle.setSpeedMode("ego", 0)
        for number, (x_m, y_m) in enumerate(path):
            if behind_too:
                at_m = behind_too + 0.9 * number
                vehicle.moveToXY(
                    "behind", "", -1, at_m, LEFT_Y_M, 90.0, KEEP_ROUTE_AND_POSE, MATCH_THRESHOLD_M
                )
            shadows.clear(["ego"], [road.index_of[vehicle.getLaneID("ego")]])
            vehicle.moveToXY("ego", "", -1, x_m, y_m, 90.0, KEEP_ROUTE_AND_POSE, MATCH_THRESHOLD_M)
            session.step()
            assert vehicle.getPosition("ego") == (x_m, y_m)
        return vehicle.getLaneID("behind"), vehicle.getPosition("behind")[0]
    finally:
        session.close()


def test_who_is_behind_a_car_that_has_changed_lanes_drives_by(tmp_path: Path) -> None:
    """SUMO alone lets him follow at 5 m/s in the empty lane, beside the car."""
    cars = car("ego", 100, 5, kind="xgv", route="wc ce") + car("behind", 70, 5, route="wc ce")
    path = [(-299.0 + 0.5 * n, min(RIGHT_Y_M + 0.08 * n, LEFT_Y_M)) for n in range(200)]
    lane, x_m = follow(tmp_path, cars, path)
    assert lane == "wc_0"
    assert x_m > path[-1][0] + 20.0


def test_a_car_that_leaves_the_road_as_it_enters_a_junction_takes_all_of_it_along(tmp_path: Path) -> None:
    """SUMO alone crashes: the rear is still in two lanes of the edge before, the front in none."""
    cars = car("ego", 380, 5, kind="xgv", lane=1, route="wc ce") + car(
        "behind", 330, 9, lane=1, route="wc ce"
    )
    across = [LEFT_Y_M - 0.4 * n for n in range(20)]
    lane, _ = follow(tmp_path, cars, [(-8.0, y_m) for y_m in across], behind_too=-69.0)
    assert lane == "wc_1"
