"""Where bound cars arrive, who enters late, and what a world says when SUMO fails under it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.contracts.world_contract import ahead, nobody
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.xgv_cosim.worlds.conftest import NewWorld
    from xgv_cosim.snapshot import Snapshot

EDGE_LENGTH_M = 1185.69


def arriving(vehicle_id: str, position_m: float, arrival: str, lane: int = 0) -> str:
    vehicle = car(vehicle_id, position_m, 10, lane=lane, kind="xgv")
    return vehicle.replace(" depart=", f' arrivalPos="{arrival}" depart=', 1)


def last_position_m(world: SumoWorld, coupling: CouplingKind = CouplingKind.FREE) -> float:
    """Drive until the car arrives, and return where it was one step of 1 m before."""
    snapshot = world.step(nobody())
    world.bind("ego", coupling)
    position_m = 0.0
    for _ in range(1300):
        position_m = float(snapshot.lane_position_m[snapshot.index_of["ego"]])
        snapshot = world.step(ahead(snapshot, "ego", 10.0, 0.1))
        if "ego" in snapshot.arrived:
            return position_m
    raise AssertionError("it never arrives")


@pytest.mark.parametrize(
    ("departs_m", "arrival", "expected_m"),
    [
        (150.0, "200", 200.0),
        (1100.0, "-50", EDGE_LENGTH_M - 50.0),
        (1150.0, "max", EDGE_LENGTH_M),
        (1150.0, "random", EDGE_LENGTH_M),
    ],
)
@pytest.mark.parametrize("options", [(), ("--output-prefix", "mine_")])
def test_a_freely_placed_car_arrives_at_its_arrival_position(
    sumo: NewWorld, departs_m: float, arrival: str, expected_m: float, options: tuple[str, ...]
) -> None:
    world = sumo(arriving("ego", departs_m, arrival), options=options)
    world.start()
    assert expected_m - 1.2 <= last_position_m(world) <= expected_m


def test_each_car_has_an_arrival_position_of_its_own(sumo: NewWorld) -> None:
    """The positions of all cars are read at once, when the first is on its last edge."""
    world = sumo(arriving("other", 300, "900"), arriving("ego", 150, "250", lane=1))
    world.start()
    assert 248.8 <= last_position_m(world) <= 250.0


def test_who_was_there_in_a_loaded_state_departs_with_the_first_snapshot(tmp_path: Path) -> None:
    config = write_config(tmp_path, car("a", 100, 10), network("hello"))
    first = SumoWorld.headless(config, step_s=0.1, seed=1)
    assert first.start().departed == ()
    assert first.step(nobody()).departed == ("a",)
    assert first.step(nobody()).departed == ()
    load_libsumo().simulation.saveState(str(tmp_path / "state.xml"))
    first.close()
    second = SumoWorld.headless(
        config, step_s=0.1, seed=1, options=("--load-state", str(tmp_path / "state.xml"))
    )
    snapshot = second.start()
    assert (snapshot.ids, snapshot.departed) == (("a",), ("a",))
    assert second.step(nobody()).departed == ()
    second.close()


def test_who_comes_back_from_a_teleport_departs_again(
    sumo: NewWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SUMO leaves who is under way in a teleport out of its list, and does not call it a departure later."""
    world = sumo(car("ego", 100, 10), car("other", 300, 10))
    world.start()
    assert set(world.step(nobody()).departed) == {"ego", "other"}
    with monkeypatch.context() as patch:
        patch.setattr(load_libsumo().vehicle, "getIDList", lambda: ("other",))
        assert world.step(nobody()).departed == ()
    assert world.step(nobody()).departed == ("ego",)
    assert world.step(nobody()).departed == ()


def fail(*_arguments: object) -> None:
    raise load_libsumo().TraCIException("the engine is gone")


CALLS: dict[str, tuple[str, Callable[[SumoWorld, Snapshot], object]]] = {
    "write": ("moveToXY", lambda world, seen: world.step(ahead(seen, "ego", 10.0, 0.1))),
    "enter": ("setLaneChangeMode", lambda world, seen: world.step(ahead(seen, "ego", 10.0, 0.1))),
    "read": ("getIDList", lambda world, seen: world.step(ahead(seen, "ego", 10.0, 0.1))),
    "knows": ("getLoadedIDList", lambda world, _: world.knows("ego")),
    "release": ("setSpeedMode", lambda world, _: world.release("ego")),
}


@pytest.mark.parametrize("name", CALLS)
def test_every_failure_of_libsumo_is_a_world_error_and_closes_the_world(
    sumo: NewWorld, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    function, call = CALLS[name]
    world = sumo(car("ego", 200, 10, kind="xgv"))
    world.start()
    seen = world.step(nobody())
    world.bind("ego", CouplingKind.FREE)
    monkeypatch.setattr(load_libsumo().vehicle, function, fail)
    with pytest.raises(WorldError, match=r"SUMO failed in .*: the engine is gone"):
        call(world, seen)
    assert not load_libsumo().isLoaded()


def test_a_failure_while_the_world_is_first_read_is_a_world_error(
    sumo: NewWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(load_libsumo().lane, "getIDList", fail)
    with pytest.raises(WorldError, match="the engine is gone"):
        sumo(car("ego", 200, 10)).start()
    assert not load_libsumo().isLoaded()


def test_who_has_the_id_of_one_that_has_arrived_arrives_at_its_own_place(sumo: NewWorld) -> None:
    """SUMO lets a script use an id again; where the first one arrived was read once for all."""
    world = sumo(arriving("ego", 150.0, "200"))
    world.start()
    assert 198.8 <= last_position_m(world) <= 200.0
    world.release("ego")
    arrivals = world._bindings._ends._arrivals
    vehicle = load_libsumo().vehicle
    vehicle.add("ego", "", typeID="xgv", departPos="150", departSpeed="10", arrivalPos="300")
    world.step(nobody())
    world.bind("ego", CouplingKind.FREE)
    assert arrivals.position_m("ego", "road", EDGE_LENGTH_M) == 300.0
