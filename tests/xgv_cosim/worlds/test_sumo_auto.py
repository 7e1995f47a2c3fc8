"""Coupling auto: mirrored where that is exact, free elsewhere; and right of way in every coupling."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.contracts.world_contract import ahead, nobody, place, stay
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.placing import SETTLING_STEPS, TOLERANCE_M, TOLERANCE_RAD
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.xgv_cosim.worlds.conftest import NewWorld
    from xgv_cosim.snapshot import Snapshot

STEP_S = 0.1
EGO = car("ego", 200, 10, lane=1, kind="xgv")


class Drive:
    """A bound car at 10 m/s along ``road``; lateral position and yaw as asked."""

    def __init__(self, world: SumoWorld) -> None:
        self.world = world
        world.start()
        self.snapshot = world.step(nobody())
        world.bind("ego", CouplingKind.AUTO)

    def step(self, lateral_m: float = 0.0, yaw_rad: float = 0.0, speed_mps: float = 10.0) -> bool:
        """Go on ``lateral_m`` left of the centre of lane ``road_1``; return whether that was mirrored."""
        row, road = self.snapshot.index_of["ego"], self.world.road
        lane = np.array([road.index_of["road_1"]])
        position_m = np.array([self.snapshot.lane_position_m[row] + speed_mps * STEP_S])
        at = road.points_ahead(lane, position_m, np.array([-1]))
        heading = float(at.heading_rad[0])
        x_m, y_m = at.x_m[0] - np.sin(heading) * lateral_m, at.y_m[0] + np.cos(heading) * lateral_m
        self.snapshot = self.world.step(
            place(
                "ego",
                float(x_m),
                float(y_m),
                heading + yaw_rad,
                speed_mps=speed_mps,
                travelled_m=speed_mps * STEP_S,
            )
        )
        row = self.snapshot.index_of["ego"]
        assert self.snapshot.placement_error_m[row] <= TOLERANCE_M
        assert self.snapshot.placement_error_rad[row] <= TOLERANCE_RAD
        return bool(self.snapshot.in_lane_frame[row])


def test_it_is_mirrored_when_it_has_settled_and_placed_freely_at_once_when_it_turns(sumo: NewWorld) -> None:
    drive = Drive(sumo(EGO))
    assert [drive.step(0.3) for _ in range(SETTLING_STEPS + 1)] == [False] * (SETTLING_STEPS - 1) + [True] * 2
    assert drive.step(0.4, yaw_rad=0.015)
    assert not drive.step(0.5, yaw_rad=0.02)  # more than one degree
    assert not any(drive.step(0.5) for _ in range(SETTLING_STEPS - 1))
    assert drive.step(0.5)


def test_half_in_the_next_lane_it_is_placed_freely(sumo: NewWorld) -> None:
    drive = Drive(sumo(EGO))
    for _ in range(SETTLING_STEPS):
        drive.step(1.5)
    assert drive.step(1.5)
    assert not drive.step(1.7)
    assert drive.snapshot.notes == ()  # what auto is for is no news


def test_it_does_not_flap_on_the_lane_line(sumo: NewWorld) -> None:
    drive = Drive(sumo(EGO))
    mirrored = [drive.step(1.6 + 0.02 * (-1) ** step) for step in range(60)]
    assert sum(mirrored) == 0


def test_reverse_is_placed_freely_and_standing_is_mirrored(sumo: NewWorld) -> None:
    drive = Drive(sumo(EGO))
    for _ in range(20):
        mirrored = drive.step(0.2, speed_mps=0.0)
    assert mirrored
    before = drive.snapshot.lane_position_m[drive.snapshot.index_of["ego"]]
    assert not drive.step(0.2, speed_mps=-1.0)
    row = drive.snapshot.index_of["ego"]
    assert drive.snapshot.speed_mps[row] == -1.0
    assert drive.snapshot.lane_position_m[row] == pytest.approx(before - 0.1, abs=1e-6)


def test_what_sumo_does_otherwise_than_foreseen_is_learnt_from(sumo: NewWorld) -> None:
    drive = Drive(sumo(EGO))
    for _ in range(2 * SETTLING_STEPS):
        mirrored = drive.step(0.2)
    assert mirrored
    drive.world._bindings.bound.refuse_mirror("ego")  # SUMO itself cannot be made to err
    again = [drive.step(0.2) for _ in range(12 * SETTLING_STEPS)]
    assert again.index(True) == 11 * SETTLING_STEPS - 1


@pytest.fixture
def crossing(tmp_path: Path) -> Iterator[SumoWorld]:
    """A major road from west to east and a minor one from the south; both cars would meet."""
    nodes = "".join(
        f'<node id="{name}" x="{x}" y="{y}" type="priority"/>'
        for name, x, y in (("w", -200, 0), ("c", 0, 0), ("e", 200, 0), ("s", 0, -200), ("n", 0, 200))
    )
    edges = "".join(
        f'<edge id="{a}{b}" from="{a}" to="{b}" priority="{priority}" numLanes="1" speed="13.89"/>'
        for a, b, priority in (("w", "c", 9), ("c", "e", 9), ("s", "c", 1), ("c", "n", 1))
    )
    net = plain_network(tmp_path, nodes, edges)
    cars = car("major", 60, 12, route="wc ce", kind="xgv") + car("minor", 60, 12, route="sc cn", kind="xgv")
    world = SumoWorld.headless(write_config(tmp_path, cars, net), step_s=STEP_S, seed=1)
    yield world
    world.close()


def column(snapshot: Snapshot, vehicle_id: str, name: str) -> float:
    return float(getattr(snapshot, name)[snapshot.index_of[vehicle_id]])


@pytest.mark.parametrize("kind", list(CouplingKind))
def test_traffic_of_the_minor_road_yields_to_a_bound_car(crossing: SumoWorld, kind: CouplingKind) -> None:
    crossing.start()
    snapshot = crossing.step(nobody())
    crossing.bind("major", kind)
    for _ in range(150):
        snapshot = crossing.step(ahead(snapshot, "major", 12.0, STEP_S))
        assert snapshot.collisions == ()
        if column(snapshot, "major", "front_x_m") - 4.4 > 3.0:
            break
        assert column(snapshot, "minor", "front_y_m") < -1.6  # it has not entered before
    assert column(snapshot, "minor", "speed_mps") < 9.0  # it has braked


@pytest.mark.parametrize("kind", list(CouplingKind))
def test_a_bound_car_that_waits_on_the_minor_road_holds_nobody_up(
    crossing: SumoWorld, kind: CouplingKind
) -> None:
    crossing.start()
    snapshot = crossing.step(nobody())
    crossing.bind("minor", kind)
    speed_mps, slowest_mps = 12.0, np.inf
    while "major" in snapshot.index_of:
        left_m = -4.0 - column(snapshot, "minor", "front_y_m")
        speed_mps = min(speed_mps, float(np.sqrt(max(2.0 * 2.0 * left_m, 0.0))))
        step = ahead if speed_mps > 0.05 else lambda now, name, *_: stay(now, name)
        snapshot = crossing.step(step(snapshot, "minor", speed_mps, STEP_S))
        if "major" in snapshot.index_of:
            slowest_mps = min(slowest_mps, column(snapshot, "major", "speed_mps"))
    assert slowest_mps > 11.0


def test_the_driver_of_a_bound_car_yields_where_he_governs_the_speed(crossing: SumoWorld) -> None:
    """Partial mode manual speed: SUMO's car following, and with it right of way, has the speed."""
    crossing.start()
    snapshot = crossing.step(nobody())
    crossing.bind("minor", CouplingKind.AUTO)
    while column(snapshot, "major", "front_x_m") < 6.0:
        row = snapshot.index_of["minor"]
        asked = place(
            "minor",
            float(snapshot.front_x_m[row]),
            float(snapshot.front_y_m[row]),
            float(snapshot.heading_rad[row]),
            speed_mps=12.0,
            travelled_m=float(snapshot.speed_mps[row]) * STEP_S,
            computer=(False, True),
        )
        snapshot = crossing.step(asked)
        assert snapshot.collisions == ()
        assert column(snapshot, "minor", "front_y_m") < -1.0
    assert column(snapshot, "minor", "speed_mps") < 9.0
