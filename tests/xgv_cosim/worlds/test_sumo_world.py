"""SumoWorld against the contract of all worlds, and what only SUMO does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.contracts.world_contract import WorldContract, ahead, nobody, place, stay
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.neighbours import SIGHT_M
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from pathlib import Path

    from tests.xgv_cosim.worlds.conftest import NewWorld
    from xgv_cosim.snapshot import Snapshot

THREE_CARS = (car("front", 240, 10), car("ego", 200, 10, kind="xgv"), car("rear", 160, 10))


class TestSumoWorldContract(WorldContract):
    def new_world(self, folder: Path) -> SumoWorld:
        return SumoWorld.headless(
            write_config(folder, "".join(THREE_CARS), network("hello")), step_s=0.1, seed=1
        )


def column(snapshot: Snapshot, vehicle_id: str, name: str) -> float:
    return float(getattr(snapshot, name)[snapshot.index_of[vehicle_id]])


def brake(world: SumoWorld, snapshot: Snapshot, decel_mps2: float, vehicle_id: str = "ego") -> Snapshot:
    """Brake to standstill in the vehicle's direction; one step more at standstill."""
    speed_mps = column(snapshot, vehicle_id, "speed_mps")
    while speed_mps > 0.0:
        speed_mps = max(speed_mps - 0.1 * decel_mps2, 0.0)
        snapshot = world.step(ahead(snapshot, vehicle_id, speed_mps, 0.1))
        assert snapshot.collisions == ()
    return world.step(stay(snapshot, vehicle_id))


def test_a_follower_stops_behind_a_braking_bound_car(sumo: NewWorld) -> None:
    world = sumo(car("ego", 200, 12, kind="xgv"), car("rear", 155, 12))
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", CouplingKind.FREE)
    snapshot = brake(world, snapshot, 6.0)
    for _ in range(80):
        snapshot = world.step(stay(snapshot, "ego"))
        assert snapshot.collisions == ()
    assert column(snapshot, "rear", "speed_mps") < 0.05
    assert 1.0 < column(snapshot, "ego", "follower_gap_m") < 3.0  # its minimum gap is 1.5 m


def test_a_bound_car_that_drives_into_another_is_a_collision(sumo: NewWorld) -> None:
    world = sumo(car("front", 260, 8), car("ego", 200, 12, kind="xgv"))
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", CouplingKind.FREE)
    contacts = []
    for _ in range(60):
        snapshot = world.step(ahead(snapshot, "ego", 30.0, 0.1))
        contacts += snapshot.collisions
    assert {(contact.collider, contact.victim) for contact in contacts} == {("ego", "front")}
    assert contacts[0].lane_id == "road_0"
    assert 260.0 < contacts[0].position_m < 360.0
    world.close()  # SUMO writes its log out when it ends
    assert any("collision" in message for message in world.messages)


def test_a_car_that_stands_for_310_s_is_not_teleported(sumo: NewWorld) -> None:
    """SUMO's default beams whoever waits for 300 s, bound cars and those behind them too."""
    world = sumo(car("ego", 200, 12, kind="xgv"), car("rear", 155, 12))
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", CouplingKind.FREE)
    snapshot = brake(world, snapshot, 6.0)
    still = stay(snapshot, "ego")
    for _ in range(3100):
        snapshot = world.step(still)
        assert snapshot.teleported == ()
    assert set(snapshot.ids) == {"ego", "rear"}


@pytest.mark.parametrize("kind", list(CouplingKind))
def test_a_bound_car_arrives_at_the_end_of_its_route(sumo: NewWorld, kind: CouplingKind) -> None:
    world = sumo(car("ego", 1150, 12, kind="xgv"), car("rear", 100, 12))
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", kind)
    steps = 0
    while "ego" not in snapshot.arrived:
        steps += 1
        snapshot = world.step(ahead(snapshot, "ego", 12.0, 0.1))
        assert steps < 40
    assert 25 <= steps <= 32  # 35 m at 12 m/s
    assert snapshot.ids == ("rear",)
    world.release("ego")  # it is gone: nothing to do
    world.step(nobody())


def test_the_route_survives_weaving_over_edges_and_lanes(sumo: NewWorld) -> None:
    """A lateral swing of 0.5 m about the lane's centre over a junction, and a drive on the lane line."""
    route = "e0 e1 e2"
    world = sumo(car("ego", 1180, 25, lane=1, route=route, kind="xgv"), net="freeway_estop")
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", CouplingKind.FREE)
    libsumo = pytest.importorskip("libsumo")
    lanes = set()
    for step in range(100):
        row = np.array([snapshot.index_of["ego"]])
        centre = world.road.points_ahead(
            snapshot.lane[row], snapshot.lane_position_m[row] + 2.5, snapshot.next_lane[row]
        )
        heading = float(centre.heading_rad[0])
        swing_m = 0.5 * np.sin(0.4 * step) if step < 60 else 1.6
        sideways = np.array([-np.sin(heading), np.cos(heading)]) * swing_m
        snapshot = world.step(
            place(
                "ego",
                centre.x_m[0] + sideways[0],
                centre.y_m[0] + sideways[1],
                heading,
                speed_mps=25.0,
                travelled_m=2.5,
            )
        )
        assert libsumo.vehicle.getRoute("ego") == tuple(route.split())
        lanes.add(world.road.lane_ids[snapshot.lane[snapshot.index_of["ego"]]])
    assert {"e0_1", "e1_1"} <= lanes


def test_next_lane_follows_the_route_onto_the_junction_and_beyond(sumo: NewWorld) -> None:
    world = sumo(
        car("ego", 1276.5, 1, lane=2, route="e0 e1", kind="xgv"),
        car("last", 500, 1, lane=2, route="e1", kind="xgv"),
        net="freeway_estop",
    )
    world.start()
    world.step(nobody())
    world.bind("ego", CouplingKind.LANE)
    world.bind("last", CouplingKind.LANE)
    name = (*world.road.lane_ids, "none")
    seen = {}
    snapshot = world.step(nobody())
    for _ in range(60):
        snapshot = world.step(ahead(snapshot, "ego", 1.0, 0.1))
        row = snapshot.index_of["ego"]
        seen[name[snapshot.lane[row]]] = name[snapshot.next_lane[row]]
    assert seen == {"e0_2": ":n1_0_2", ":n1_0_2": "e1_2", "e1_2": "none"}


def test_gaps_count_the_minimum_gap_of_whoever_follows(sumo: NewWorld) -> None:
    """SUMO subtracts the follower's minimum gap: the ego's 2.5 m ahead, the rear car's 1.5 m behind."""
    world = sumo(*THREE_CARS)
    world.start()
    world.step(nobody())
    world.bind("ego", CouplingKind.LANE)
    snapshot = world.step(nobody())
    position = {name: column(snapshot, name, "lane_position_m") for name in ("front", "ego", "rear")}
    gap_ahead = position["front"] - 5.2 - position["ego"]
    gap_behind = position["ego"] - 4.4 - position["rear"]
    assert column(snapshot, "ego", "leader_gap_m") == pytest.approx(gap_ahead, abs=1e-9)
    assert column(snapshot, "ego", "follower_gap_m") == pytest.approx(gap_behind, abs=1e-9)


def test_whoever_is_out_of_sight_is_no_neighbour(sumo: NewWorld) -> None:
    world = sumo(car("front", 700, 10), car("ego", 300, 10, kind="xgv"), car("rear", 20, 10))
    world.start()
    world.step(nobody())
    world.bind("ego", CouplingKind.LANE)
    snapshot = world.step(nobody())
    assert column(snapshot, "ego", "lane_position_m") - column(snapshot, "rear", "lane_position_m") > SIGHT_M
    assert column(snapshot, "ego", "leader") == column(snapshot, "ego", "follower") == -1
    assert np.isinf(column(snapshot, "ego", "leader_gap_m"))
    assert np.isinf(column(snapshot, "ego", "follower_gap_m"))


def test_another_seed_gives_another_traffic(sumo: NewWorld) -> None:
    ends = []
    for seed in (1, 1, 2):
        world = sumo(
            car("a", 100, 10, kind="DEFAULT_VEHTYPE"), car("b", 60, 10, kind="DEFAULT_VEHTYPE"), seed=seed
        )
        world.start()
        for _ in range(100):
            snapshot = world.step(nobody())
        ends.append(snapshot.front_x_m.tolist())
        world.close()
    assert ends[0] == ends[1] != ends[2]
