"""Snapshots that are read on demand: what is not asked of SUMO is what SUMO has, and what is gone says so."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest

import xgv_cosim
from tests.contracts.world_contract import nobody
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.session import SAFETY

if TYPE_CHECKING:
    from pathlib import Path

    from tests.xgv_cosim.worlds.conftest import NewWorld

CARS = car("ego", 200, 12) + car("other", 100, 5)


@pytest.mark.parametrize("coupling", ["auto", "lane", "free"])
def test_places_that_are_not_asked_for_are_those_that_sumo_has(coupling: str) -> None:
    """Every vehicle of a town with bound cars, in every step, also where the reader does not ask."""
    vehicle = load_libsumo().vehicle
    compared = 0
    with xgv_cosim.simulate("urban_grid", set=[f"bind.0.coupling={coupling}"]) as run:
        lane_ids = run.world.road.lane_ids
        while run.now_s < 14.0:
            run.step()
            seen = run.snapshot
            for row, name in enumerate(seen.ids):
                lane = int(seen.lane[row])
                assert (lane_ids[lane] if lane >= 0 else "") == vehicle.getLaneID(name)
                if lane >= 0:
                    assert abs(seen.lane_position_m[row] - vehicle.getLanePosition(name)) < 1e-6
                assert abs(seen.speed_mps[row] - vehicle.getSpeed(name)) <= 0.01
                place_m = vehicle.getPosition(name)
                away_m = np.hypot(place_m[0] - seen.front_x_m[row], place_m[1] - seen.front_y_m[row])
                assert away_m <= (1e-6 if coupling == "lane" else 0.05)
                compared += name in run.vehicle_ids
    assert compared > 200


def test_what_was_not_read_is_gone_with_the_next_step_and_says_so(sumo: NewWorld) -> None:
    world = sumo(CARS)
    world.start()
    first = world.step(nobody())
    speeds = first.speed_mps
    world.step(nobody())
    np.testing.assert_array_equal(first.speed_mps, speeds)
    with pytest.raises(WorldError, match=r"not read before SUMO went on.*read_all"):
        _ = first.front_x_m
    with pytest.raises(WorldError, match=r"not read before SUMO went on"):
        _ = first.leader


def test_only_the_rows_that_are_asked_for_are_read(sumo: NewWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    world = sumo(CARS)
    world.start()
    snapshot = world.step(nobody())
    vehicle = load_libsumo().vehicle
    asked: list[str] = []
    own = vehicle.getSpeed
    monkeypatch.setattr(vehicle, "getSpeed", lambda name: asked.append(name) or own(name))
    row = snapshot.index_of["other"]
    assert snapshot.value("speed_mps", row) == pytest.approx(5.0, abs=1.0)
    assert asked == ["other"]
    assert len(snapshot.speed_mps) == 2
    assert sorted(asked) == ["ego", "other"]


def test_the_last_snapshot_of_a_closed_world_is_its_own(sumo: NewWorld, tmp_path: Path) -> None:
    world = sumo(CARS)
    world.start()
    last = world.step(nobody())
    place_m = load_libsumo().vehicle.getPosition("ego")[0]
    world.close()
    with xgv_cosim.simulate(write_config(tmp_path, car("ego", 50, 3), network("hello"))) as run:
        run.step()
        assert last.front_x_m[last.index_of["ego"]] == place_m
        assert run.snapshot.front_x_m[0] < place_m - 100.0


def test_under_attach_a_vehicle_that_is_gone_spoils_only_the_reading(tmp_path: Path) -> None:
    libsumo = load_libsumo()
    config = write_config(tmp_path, CARS, network("hello"))
    options = [f"--{name}={value}" for name, value in SAFETY.items()]
    libsumo.start(
        ["sumo", "-c", str(config), "--step-length=0.1", "--no-step-log", "--no-warnings", *options]
    )
    try:
        with xgv_cosim.attach(libsumo) as plugin:
            libsumo.simulationStep()
            libsumo.simulationStep()
            behind_the_plugin = sys.modules["libsumo._libsumo"].vehicle_remove.__wrapped__
            behind_the_plugin("other")  # as a second client of SUMO may
            with pytest.raises(WorldError, match="cannot tell of the last step any more"):
                _ = plugin.snapshot.front_x_m
            libsumo.simulationStep()
            assert plugin.snapshot.ids == ("ego",)
            assert len(plugin.snapshot.front_x_m) == 1
    finally:
        libsumo.close()
