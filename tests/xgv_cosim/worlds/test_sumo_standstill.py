"""Standing bound cars: SUMO neither teleports nor loses them, and types stay what they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.contracts.world_contract import nobody, place, stay
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.ghosts import GHOST_PREFIX
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from pathlib import Path

    from tests.xgv_cosim.worlds.conftest import NewWorld
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.base import Placement

COMPUTER, DRIVER_STEERS = (True, True), (True, False)
EGO = car("ego", 400, 0, kind="xgv")


def across(snapshot: Snapshot, computer: tuple[bool, bool] = COMPUTER, left_m: float = 0.0) -> Placement:
    """Stand, ``left_m`` left of where it is."""
    still = stay(snapshot, "ego", computer)
    return still._replace(front_y_m=still.front_y_m + left_m)


def stand(world: SumoWorld, still: Placement, duration_s: float) -> tuple[Snapshot, set[str]]:
    """Hold ``ego`` where it is; return the last state and whoever was teleported."""
    gone: set[str] = set()
    for _ in range(round(duration_s / 0.1)):
        snapshot = world.step(still)
        gone |= set(snapshot.teleported)
        if "ego" in snapshot.index_of:
            row = snapshot.index_of["ego"]
            assert snapshot.speed_mps[row] == 0.0
            assert snapshot.front_x_m[row] == pytest.approx(float(still.front_x_m[0]), abs=1e-9)
    return snapshot, gone


@pytest.mark.parametrize("computer", [COMPUTER, DRIVER_STEERS])
@pytest.mark.parametrize("kind", list(CouplingKind))
def test_it_is_not_teleported_however_it_is_written(
    sumo: NewWorld, kind: CouplingKind, computer: tuple[bool, bool]
) -> None:
    world = sumo(EGO, car("rear", 300, 10), options=("--time-to-teleport", "15"))
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", kind)
    snapshot, gone = stand(world, across(snapshot, computer), 50.0)
    assert gone == set()
    assert set(snapshot.ids) == {"ego", "rear"}
    assert snapshot.speed_mps[snapshot.index_of["rear"]] == pytest.approx(0.0, abs=0.05)


WRONG_LANE = '<connection from="wm" to="me" fromLane="1" toLane="0"/>'
"""The route goes on from the other lane."""
NOWHERE = '<delete from="wm" to="me"/>'
"""It does not go on at all."""
IMPATIENT = (
    (WRONG_LANE, ("--time-to-teleport", "2")),
    (WRONG_LANE, ("--time-to-teleport", "0:00:01")),
    (WRONG_LANE, ("--time-to-teleport.highways", "2")),
    (NOWHERE, ("--time-to-teleport.disconnected", "2")),
    (NOWHERE, ("--time-to-teleport.disconnected", "0.5")),
)


@pytest.mark.parametrize(("ways", "options"), IMPATIENT)
@pytest.mark.parametrize("is_ours", [True, False])
def test_it_is_not_teleported_however_short_the_time(
    tmp_path: Path, ways: str, options: tuple[str, ...], is_ours: bool
) -> None:
    """Nor is its ghost in the other lane, nor another car that is held; those of SUMO's are."""
    places_m = {"w": 0, "m": 300, "e": 600}
    nodes = "".join(f'<node id="{name}" x="{x_m}" y="0"/>' for name, x_m in places_m.items())
    edges = '<edge id="wm" from="w" to="m" numLanes="2" speed="30"/>'
    edges += '<edge id="me" from="m" to="e" speed="30"/>'
    (tmp_path / "p.con.xml").write_text(f"<connections>{ways}</connections>")
    net = plain_network(tmp_path, nodes, edges, "-x", str(tmp_path / "p.con.xml"))
    cars = car("ego", 250, 0, route="wm me", kind="xgv") + car("held", 150, 0, route="wm me")
    options = (*options, "--ignore-route-errors", "true")
    world = SumoWorld.headless(write_config(tmp_path, cars, net), step_s=0.1, seed=1, options=options)
    world.start()
    snapshot = world.step(nobody())
    if is_ours:
        world.bind("ego", CouplingKind.AUTO)
        world.immobilise("held")
    else:
        for name in snapshot.ids:
            load_libsumo().vehicle.setSpeed(name, 0.0)
    still, at_m = across(snapshot, left_m=1.2), dict(zip(snapshot.ids, snapshot.front_x_m, strict=True))
    gone: set[str] = set()
    for _ in range(50):
        snapshot = world.step(still if is_ours else nobody())
        gone |= set(snapshot.teleported)
    world.close()
    assert ("ego" in gone) is not is_ours
    assert not is_ours or dict(zip(snapshot.ids, snapshot.front_x_m, strict=True)) == pytest.approx(at_m)


def test_without_help_sumo_teleports_it(sumo: NewWorld) -> None:
    """So that the test above can fail: the same car, held by SUMO's own means."""
    world = sumo(EGO, options=("--time-to-teleport", "15"))
    world.start()
    world.step(nobody())
    vehicle = load_libsumo().vehicle
    vehicle.setSpeedMode("ego", 0)
    vehicle.setSpeed("ego", 0.0)
    gone: set[str] = set()
    for _ in range(300):
        gone |= set(world.step(nobody()).teleported)
    assert gone == {"ego"}


def test_a_type_with_a_time_to_teleport_of_its_own_is_not_teleported_either(sumo: NewWorld) -> None:
    own = '<vType id="impatient" length="4.4" timeToTeleport="12"/>'
    world = sumo(own, car("ego", 400, 0, kind="impatient"))
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", CouplingKind.AUTO)
    snapshot, gone = stand(world, across(snapshot), 40.0)
    assert gone == set()
    assert snapshot.ids == ("ego",)


def test_ghosts_and_whom_the_world_holds_are_not_teleported(sumo: NewWorld) -> None:
    world = sumo(EGO, car("held", 600, 0), options=("--time-to-teleport", "15"))
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", CouplingKind.AUTO)
    world.immobilise("held")
    at_m = snapshot.front_x_m[snapshot.index_of["held"]]
    still = across(snapshot, left_m=1.2)
    vehicle, ghosts = load_libsumo().vehicle, set()
    for _ in range(500):
        snapshot = world.step(still)
        assert snapshot.teleported == ()
        ghosts |= {name for name in vehicle.getIDList() if name.startswith(GHOST_PREFIX)}
        assert snapshot.front_x_m[snapshot.index_of["held"]] == at_m
    assert len(ghosts) == 1
    assert set(snapshot.ids) == {"ego", "held"}


def test_those_it_holds_up_never_see_it_move(sumo: NewWorld) -> None:
    """The stirring is over before anybody plans: the follower stands still, and so does the report."""
    world = sumo(EGO, car("rear", 380, 5))
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", CouplingKind.AUTO)
    still = across(snapshot)
    stand(world, still, 20.0)
    vehicle, seen = load_libsumo().vehicle, []
    for _ in range(250):
        world.step(still)
        seen.append((vehicle.getSpeed("ego"), vehicle.getAcceleration("ego"), vehicle.getSpeed("rear")))
    np.testing.assert_allclose(np.abs(seen).max(axis=0), [0.0, 0.0, 0.0], atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(CouplingKind))
def test_it_stands_for_half_an_hour_with_sumos_own_time_to_teleport(
    sumo: NewWorld, kind: CouplingKind
) -> None:
    """Issue 3.4: 30 minutes, ``--time-to-teleport 300``; then it drives on to its destination and arrives."""
    world = sumo(EGO, car("rear", 300, 10), options=("--time-to-teleport", "300"))
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", kind)
    snapshot, gone = stand(world, across(snapshot), 1800.0)
    assert gone == set()
    assert set(snapshot.ids) == {"ego", "rear"}
    steps = 0
    while "ego" not in snapshot.arrived:
        row = np.array([snapshot.index_of["ego"]])
        at = world.road.points_ahead(
            snapshot.lane[row], snapshot.lane_position_m[row] + 1.0, snapshot.next_lane[row]
        )
        snapshot = world.step(
            place(
                "ego",
                float(at.x_m[0]),
                float(at.y_m[0]),
                float(at.heading_rad[0]),
                speed_mps=10.0,
                travelled_m=1.0,
            )
        )
        steps += 1
        assert steps < 1000


def test_the_types_of_bound_cars_are_untouched(sumo: NewWorld) -> None:
    """Followers go by the decel, apparent decel and tau of the type that SUMO knows."""
    world = sumo(EGO)
    world.start()
    snapshot = world.step(nobody())
    vehicle = load_libsumo().vehicle
    getters = ("getTypeID", "getDecel", "getApparentDecel", "getTau", "getEmergencyDecel", "getMinGap")
    before = [getattr(vehicle, getter)("ego") for getter in getters]
    world.bind("ego", CouplingKind.AUTO)
    for _ in range(150):
        world.step(across(snapshot, left_m=1.2))
    assert [getattr(vehicle, getter)("ego") for getter in getters] == before
