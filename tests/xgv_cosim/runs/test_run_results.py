"""What ``result.json`` says of real runs: gaps, stops from any edge, lengths, the ledger, SUMO's notes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import xgv_cosim


def run(folder: Path, **values: str) -> dict[str, Any]:
    overrides = [f"{key.replace('__', '.')}={value}" for key, value in values.items()]
    return xgv_cosim.run("hello", out=folder, set=overrides, report=False).data


@pytest.fixture(scope="module")
def quiet(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return the result of a run in which nothing happens, of a length that is no multiple of the step."""
    return run(
        tmp_path_factory.mktemp("quiet") / "out",
        duration_s="3.04",
        injections="[]",
        expect="[{no_collision: true, always: true}, {vehicle: xgv_0, mode: drive_by_wire, always: true}]",
    )


def test_a_length_that_is_no_multiple_of_the_step_is_rounded_up(quiet: dict[str, Any]) -> None:
    assert (quiet["num_steps"], quiet["simulated_s"]) == (31, 3.1)
    assert quiet["expectations"][0]["status"] == "ok"


def test_a_car_that_only_drives_is_in_drive_by_wire_always(quiet: dict[str, Any]) -> None:
    assert quiet["expectations"][1]["status"] == "ok", quiet["expectations"]
    assert quiet["status"] == "ok"


def test_a_run_without_any_event_exercises_neither_pause_nor_rearming(quiet: dict[str, Any]) -> None:
    """XGV-20, XGV-36 and XGV-37 had no effect; XGV-26, XGV-50 and XGV-18 did."""
    exercised = {row["rule"] for row in quiet["assumptions"] if row["exercised"]}
    assert exercised.isdisjoint({"XGV-20", "XGV-36", "XGV-37"})
    assert {"XGV-18", "XGV-26", "XGV-50"} <= exercised


def test_the_gap_of_a_vehicle_that_nobody_watches_counts_and_sumos_words_are_kept(tmp_path: Path) -> None:
    """Nobody is near xgv_1; car_0 follows xgv_0, close enough for SUMO to call it a collision."""
    data = run(
        tmp_path / "out",
        duration_s="3",
        injections="[{at_s: 2, vehicles: xgv_1, kind: door}]",
        expect="[{min_gap_m: 100, always: true}]",
        world__sumo__options="['--collision.action', warn, '--collision.mingap-factor', '20']",
    )
    (row,) = data["expectations"]
    assert row["status"] == "failed"
    assert "behind of xgv_0" in row["detail"]
    assert data["collisions"]
    assert any("collision" in note for note in data["notes"])


def test_metrics_do_not_depend_on_how_the_vehicle_is_named(tmp_path: Path) -> None:
    """An edge between two world steps, for a vehicle that is named and one that a pattern finds."""
    stops = [
        run(
            tmp_path / str(number),
            duration_s="12",
            injections=f"[{{at_s: 5.09, vehicles: '{vehicles}', kind: estop_pause}}]",
            expect="[]",
        )["vehicles"]["xgv_0"]["metrics"]
        for number, vehicles in enumerate(("xgv_0", "xgv_[0]"))
    ]
    assert stops[0] == stops[1]
    assert stops[0]["stopping_distance_ratio"] == pytest.approx(1.0, abs=0.03)
    speed_mps, decel_mps2 = stops[0]["speed_at_event_mps"], 2.5
    assert stops[0]["time_to_standstill_s"] == pytest.approx(speed_mps / decel_mps2, abs=0.3)
