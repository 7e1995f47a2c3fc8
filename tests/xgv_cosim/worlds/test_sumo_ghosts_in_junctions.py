"""Ghosts on the lanes inside a junction: SUMO lives on, and its drivers see the body there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.contracts.world_contract import nobody, place
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.ghosts import is_ghost
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from pathlib import Path

ARMS = {"w": (-200, 0), "e": (200, 0), "s": (0, -200), "n": (0, 200)}
NODES = '<node id="c" x="0" y="0"/>' + "".join(
    f'<node id="{name}" x="{x}" y="{y}"/>' for name, (x, y) in ARMS.items()
)
EDGES = "".join(
    f'<edge id="{ends[0]}{ends[1]}" from="{ends[0]}" to="{ends[1]}" numLanes="2" speed="14"/>'
    for name in ARMS
    for ends in (name + "c", "c" + name)
)
INNER_LANE_Y_M = -1.6


@pytest.mark.parametrize(("speed_mps", "steps"), [(0.0, 90), (2.0, 30)])
def test_a_body_that_hangs_out_of_a_lane_in_a_junction_is_seen_there(
    tmp_path: Path, speed_mps: float, steps: int
) -> None:
    """Front to the left of its route's lanes, rear on the inner one of the two that lead straight on.

    A ghost whose route ends inside the junction crashes SUMO in its second step.
    """
    vehicles = (
        car(name, at_m, 8.0, kind="xgv", lane=1, route="wc ce")
        for name, at_m in (("ego", 180), ("behind", 165))
    )
    config = write_config(tmp_path, "".join(vehicles), plain_network(tmp_path, NODES, EDGES))
    world = SumoWorld.headless(config, step_s=0.1, seed=1)
    try:
        world.start()
        world.step(nobody())
        vehicle, edge = load_libsumo().vehicle, load_libsumo().edge
        world.bind("ego", CouplingKind.FREE)
        world.step(place("ego", -2.0, INNER_LANE_Y_M, 0.0, speed_mps=speed_mps, travelled_m=0.0))
        inside = vehicle.getLaneID("ego")
        assert inside.startswith(":c_")
        assert edge.getLaneNumber(inside.rpartition("_")[0]) == 2
        for number in range(steps):
            travelled_m = 0.1 * speed_mps
            snapshot = world.step(
                place(
                    "ego",
                    -2.0 + number * travelled_m,
                    INNER_LANE_Y_M + 2.6,
                    0.4,
                    speed_mps=speed_mps,
                    travelled_m=travelled_m,
                )
            )
            assert vehicle.getLaneID("ego") == ""
            (ghost,) = filter(is_ghost, vehicle.getIDList())
            assert vehicle.getLaneID(ghost) == inside
        if speed_mps == 0.0:  # and who comes along stops behind it
            rear_m = vehicle.getLanePosition(ghost) - vehicle.getLength(ghost)
            assert vehicle.getLaneID("behind") == inside
            assert 1.0 < rear_m - vehicle.getLanePosition("behind") < 3.0
            assert snapshot.speed_mps[snapshot.index_of["behind"]] == pytest.approx(0.0, abs=0.1)
    finally:
        world.close()
