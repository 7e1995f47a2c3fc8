"""Neighbours while a bound car is off the road: those of everybody else stay what they were."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tests.contracts.world_contract import nobody, place
from tests.xgv_cosim.worlds.sumo_networks import signalised_grid
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.base import Placement
from xgv_cosim.worlds.sumo.ghosts import GHOST_PREFIX
from xgv_cosim.worlds.sumo.handover import HeadingEasing
from xgv_cosim.worlds.sumo.integration import Integration
from xgv_cosim.worlds.sumo.reader import SnapshotReader
from xgv_cosim.worlds.sumo.roster import Roster
from xgv_cosim.worlds.sumo.world import SumoWorld
from xgv_cosim.worlds.sumo.written import nothing_written

if TYPE_CHECKING:
    from xgv_cosim.snapshot import Snapshot

BOUND = ("ego", "wide", "behind", "lost")
TRAFFIC = (
    car("ego", 110, 0, route="A0A1 A1A2 A2A3", kind="xgv")
    + car("leader", 30, 0, route="A2A3")
    + car("wide", 60, 0, route="B0B1 B1B2", kind="xgv")
    + car("behind", 30, 0, lane=1, route="B0B1 B1B2", kind="xgv")
    + car("lost", 60, 0, route="D0D1", kind="xgv")
)


def seen(folder: Path, lost_by_m: float) -> Snapshot:
    """Hold the bound cars, ``wide`` across the line to the left lane and ``lost`` so far from its place."""
    folder.mkdir()
    world = SumoWorld.headless(write_config(folder, TRAFFIC, signalised_grid(folder)), step_s=0.1, seed=1)
    try:
        world.start()
        snapshot = world.step(nobody())
        rows = np.array([snapshot.index_of[name] for name in BOUND])
        for name in BOUND:
            world.bind(name, CouplingKind.FREE)
        heading = snapshot.heading_rad[rows]
        left_m = np.array([0.0, 1.2, 0.0, lost_by_m])
        still, ours = np.zeros(len(BOUND)), np.ones(len(BOUND), np.bool_)
        placement = Placement(
            BOUND,
            snapshot.front_x_m[rows] - left_m * np.sin(heading),
            snapshot.front_y_m[rows] + left_m * np.cos(heading),
            heading, still, still, ours, ours,
        )  # fmt: skip
        for _ in range(3):
            snapshot = world.step(placement)
        snapshot.read_all()
        return snapshot
    finally:
        world.close()


def test_who_is_not_off_the_road_sees_the_same_neighbours(tmp_path: Path) -> None:
    """Over two crossings with several ways on, and behind a body that only its ghost shows in the lane."""
    usual, other = seen(tmp_path / "a", 0.0), seen(tmp_path / "b", -60.0)
    assert usual.lane[usual.index_of["lost"]] >= 0
    assert other.lane[other.index_of["lost"]] == -1
    for name, leader in (("ego", "leader"), ("behind", "wide")):
        row, again = usual.index_of[name], other.index_of[name]
        assert usual.ids[usual.leader[row]] == leader
        assert other.ids[other.leader[again]] == leader
        assert abs(usual.leader_gap_m[row] - other.leader_gap_m[again]) < 0.05
    row, again = usual.index_of["wide"], other.index_of["wide"]
    assert usual.leader[row] == -1
    assert other.leader[again] == -1


def test_behind_its_own_ghost_a_car_sees_its_neighbours(tmp_path: Path) -> None:
    """In its lane, ahead of it and behind it, whether SUMO answers or, with a car off the road, the lanes."""
    ghosts = f"{GHOST_PREFIX}1:ego", f"{GHOST_PREFIX}2:ego"
    vehicles = car("ego", 100, 0, kind="xgv") + car("leader", 150, 0) + car("follower", 50, 0)
    vehicles += car(ghosts[0], 120, 0) + car(ghosts[1], 80, 0) + car("lost", 300, 0, kind="xgv")
    world = SumoWorld.headless(write_config(tmp_path, vehicles, network("hello")), step_s=0.1, seed=1)
    try:
        world.start()
        snapshot = world.step(nobody())
        bound = Roster()
        bound.add("ego", CouplingKind.FREE)
        reader = SnapshotReader(world._open(), world.road, 0.1, bound, Integration(0.1))
        owner_of = dict.fromkeys(ghosts, "ego")
        world.bind("lost", CouplingKind.FREE)
        for lost in (False, True):
            if lost:
                snapshot = world.step(place("lost", 0.0, -500.0, 0.0, speed_mps=0.0, travelled_m=0.0))
                assert snapshot.lane[snapshot.index_of["lost"]] == -1
            seen = reader.read(nothing_written(), None, HeadingEasing(0.1), (), owner_of)
            row = seen.index_of["ego"]
            assert seen.ids[seen.leader[row]] == "leader"
            assert seen.ids[seen.follower[row]] == "follower"
            along_m = dict(zip(seen.ids, seen.lane_position_m.tolist(), strict=True))
            assert abs(seen.leader_gap_m[row] - (along_m["leader"] - 5.2 - along_m["ego"])) < 0.05
            assert abs(seen.follower_gap_m[row] - (along_m["ego"] - 4.4 - along_m["follower"])) < 0.05
    finally:
        world.close()
