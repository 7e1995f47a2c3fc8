"""Who stands at the end of a run for no reason that the run knows is named among the warnings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import xgv_cosim
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.fleet import Fleet
from xgv_cosim.metrics.standing import Standing
from xgv_cosim.runs import standing as standing_rows
from xgv_cosim.runs.standing import unexplained, warning_of

STOP = '<stop lane="road_0" endPos="500" duration="900"/>'


@pytest.mark.parametrize(("duration_s", "is_told"), [(20, False), (30, True)])
def test_a_car_that_waits_for_long_is_named_and_one_that_has_to_stand_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, duration_s: int, is_told: bool
) -> None:
    """``ego`` waits behind a car of SUMO's, here from 13 s on; the others are stopped, or cold."""
    monkeypatch.setattr(standing_rows, "LONG_S", 10.0)
    vehicles = car("blocker", 480, 5, extra=STOP) + car("ego", 400, 10)
    vehicles += car("stopped", 300, 10, lane=1) + car("cold", 100, 0, lane=1)
    rows = [
        "bind=[{vehicles: [ego, stopped]}, {vehicles: cold, start: cold, driver: none, stack: none}]",
        "injections=[{at_s: 2, vehicles: stopped, kind: estop_pause}]",
        f"duration_s={duration_s}",
    ]
    config = write_config(tmp_path, vehicles, network("hello"))
    result = xgv_cosim.run(config, set=rows, out=tmp_path / "out", report=False)
    told = [line for line in result.data["warnings"] if "stood" in line]
    assert len(told) == is_told
    if is_told:
        assert told[0].startswith("1 bound vehicle has stood for more than 10 s at the end (ego for 1")


def test_who_has_crashed_or_is_at_the_end_of_his_route_has_to_stand(tmp_path: Path) -> None:
    vehicles = car("ego", 100, 10) + car("there", 1168, 1)
    with xgv_cosim.simulate(write_config(tmp_path, vehicles, network("hello")), bind=["ego", "there"]) as run:
        run.run_until(3.0)
        assert run.snapshot.value("lane_position_m", run.snapshot.index_of["there"]) > 1168.0
        lasts_s = dict.fromkeys(run.vehicle_ids, 100.0)
        assert set(lasts_s) == {"ego", "there"}
        assert unexplained(run, lasts_s) == {"ego": 100.0}
        run.state.crashed.add("ego")
        assert unexplained(run, lasts_s) == {}


def test_standing_counts_from_the_last_move_and_anew_for_another_car_in_the_slot() -> None:
    fleet, standing = Fleet(), Standing()
    standing.note(0.5, fleet)  # nobody is bound yet
    assert standing.lasts_s() == {}
    slot = fleet.occupy("a")
    for t_s, speed_mps in ((1.0, 0.0), (2.0, -0.5), (3.0, 0.05), (7.0, 0.0)):
        fleet.motion.speed_mps[slot] = speed_mps
        standing.note(t_s, fleet)
    assert standing.lasts_s() == {"a": 5.0}
    for number in range(10):  # the columns grow
        fleet.occupy(f"more_{number}")
    standing.note(8.0, fleet)
    assert standing.lasts_s() == {"a": 6.0} | {f"more_{number}": 0.0 for number in range(10)}
    fleet.vacate("a")
    assert fleet.occupy("b") == slot
    standing.note(9.0, fleet)
    assert standing.lasts_s()["b"] == 0.0
    assert "a" not in standing.lasts_s()


def test_many_are_counted_and_a_few_named() -> None:
    assert warning_of({}) == []
    (line,) = warning_of({f"car_{number}": 100.0 + number for number in range(12)})
    assert line.startswith("12 bound vehicles have stood for more than 90 s at the end (car_0 for 100 s, ")
    assert line.endswith("car_9 for 109 s, and 2 more)")
    assert np.char.count(line, "car_") == 10
