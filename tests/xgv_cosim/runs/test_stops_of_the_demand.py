"""SUMO's ``<stop>``s of bound vehicles: nobody keeps them, SUMO neither, and everybody is told."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import xgv_cosim
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.events import Event
from xgv_cosim.recording import EVENTS, TRAJECTORY, read_trajectory
from xgv_cosim.runs.warnings import warnings_of
from xgv_cosim.scenario.loading import load_scenario
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.worlds.sumo.libraries import load_libsumo

PARKED = '<stop lane="road_0" startPos="40" endPos="60" duration="{}" parking="true"/>'
"""Beside the lane; who departs there does so with ``departPos="stop"``."""
STOPS = '<stop lane="road_0" endPos="300" duration="5"/><stop lane="road_0" endPos="900" duration="5"/>'
TOLD = ["stop on lane road_0 at 300.0 m", "stop on lane road_0 at 900.0 m"]


def test_stops_of_a_bound_vehicle_are_told_once_and_not_kept(tmp_path: Path) -> None:
    vehicles = car("bus", 200, 12, extra=STOPS) + car("taxi", 150, 12, lane=1)
    vehicles += car("other", 250, 12, extra='<stop lane="road_0" endPos="500" duration="5"/>')
    config = write_config(tmp_path, vehicles, network("hello"))
    out = tmp_path / "out"
    result = xgv_cosim.run(config, bind=["bus,taxi"], set=["duration_s=12"], out=out, report=False)
    rows = [json.loads(line) for line in (out / EVENTS).read_text().splitlines()]
    told = [(row["vehicle"], row["reasons"]) for row in rows if row["kind"] == "stops_ignored"]
    assert told == [("bus", TOLD)]
    line = "bus: the computer does not keep the stops that SUMO's demand has for it"
    assert result.data["warnings"] == [f"{line} ({'; '.join(TOLD)})"]
    track = read_trajectory(out / TRAJECTORY)
    assert track["measured_speed"][track.rows_of["bus"]][5:].min() > 5.0


def test_a_vehicle_that_is_bound_twice_is_warned_of_once() -> None:
    events = [Event(0.0, "a", "bound")]
    events += [Event(t_s, "a", "stops_ignored", reasons=(f"stop at bs_{t_s:g}",)) for t_s in (0.0, 9.0)]
    events.append(Event(9.0, "b", "stops_ignored", reasons=("stop at bs_9",)))
    told = [line.partition(":")[0] for line in warnings_of(load_scenario("hello"), events)]
    assert told == ["a", "b"]


def test_a_bound_vehicle_does_not_park_though_sumos_demand_says_so(tmp_path: Path) -> None:
    """SUMO would take it off its lane, to a position 1e9 m away, while it is placed at its stop."""
    stop = PARKED.format(9)
    vehicles = car("ego", 20, 8, extra=stop)
    vehicles += f'<vehicle id="late" depart="1" departPos="stop"><route edges="road"/>{stop}</vehicle>'
    pause = (
        "injections=[{at_s: 3, vehicles: ego, kind: estop_pause, duration_s: 8}]"  # stands where SUMO stops
    )
    config = write_config(tmp_path, vehicles, network("hello"))
    with xgv_cosim.simulate(config, bind=["ego,late"], set=["duration_s=30", pause]) as run:
        stood_m = np.inf
        while run.now_s < 20.0:
            seen = run.step()
            assert np.all(seen.lane >= 0)
            assert np.all(seen.placement_error_m < 1e-6)
            ego = seen.index_of["ego"]
            stood_m = min(stood_m, seen.front_x_m[ego]) if seen.speed_mps[ego] == 0.0 else stood_m
        assert 45.0 < stood_m < 58.0
        assert run.vehicle_ids == ("ego", "late")
        assert min(seen.front_x_m) > stood_m + 10.0
        events = run.state.journal.events
    assert [event.vehicle for event in events if event.kind == "stops_ignored"] == ["ego", "late"]
    assert [event for event in events if event.kind == "road"] == []


@pytest.mark.parametrize("released_at_s", [None, 17.0])
def test_a_parked_car_comes_back_to_its_lane_is_bound_there_and_drives_on(
    tmp_path: Path, released_at_s: float | None
) -> None:
    """Beside the lanes no stack finds a way; SUMO's driver waits for a gap, here behind the other car."""
    passing = car("other", 0, 12.0).replace('depart="0"', 'depart="9"')
    config = write_config(tmp_path, car("ego", 10, 8, extra=PARKED.format(900)) + passing, network("hello"))
    with xgv_cosim.simulate(config, set=["duration_s=60"]) as run:
        run.run_until(12.0)
        ego, other = (run.snapshot.index_of[name] for name in ("ego", "other"))
        assert run.snapshot.lane[ego] < 0
        assert 10.0 < run.snapshot.front_x_m[ego] - run.snapshot.front_x_m[other] < 40.0
        run.bind("ego", "other")
        while "ego" not in run.vehicle_ids:
            assert run.vehicle_ids == ("other",)
            seen = run.step()  # without ego, as long as it waits
            assert "ego" not in seen.index_of or seen.front_x_m[seen.index_of["other"]] > 60.0
            assert run.now_s < 17.0
        if released_at_s is not None:
            run.run_until(released_at_s)
            run.release("ego")
        run.run_until(30.0)
        assert run.vehicle_ids == (("other", "ego") if released_at_s is None else ("other",))
        assert run.snapshot.front_x_m[run.snapshot.index_of["ego"]] > 110.0
        events = run.state.journal.events
    told = [(event.vehicle, event.reasons) for event in events if event.kind == "stops_ignored"]
    assert told == [("ego", ("stop on lane road_0 at 60.0 m",))]
    assert [event for event in events if event.kind in {"road", "contact"}] == []


def test_a_row_of_bind_takes_a_parked_car_too(tmp_path: Path) -> None:
    config = write_config(tmp_path, car("ego", 10, 8, extra=PARKED.format(900)), network("hello"))
    rows = ["duration_s=60", "bind=[{vehicles: ego, from_s: 14}]"]
    with xgv_cosim.simulate(config, set=rows) as run:
        run.run_until(13.9)
        assert run.snapshot.lane[0] < 0
        run.run_until(25.0)
        assert run.vehicle_ids == ("ego",)
        assert run.snapshot.front_x_m[0] > 75.0
        told = [event.t_s for event in run.state.journal.events if event.kind == "stops_ignored"]
    assert told == [pytest.approx(14.0)]


def test_a_parked_car_that_starts_cold_is_bound_where_it_stands(tmp_path: Path) -> None:
    config = write_config(tmp_path, car("ego", 10, 8, extra=PARKED.format(900)), network("hello"))
    with xgv_cosim.simulate(config, set=["duration_s=60"]) as run:
        run.run_until(12.0)
        parked_m = load_libsumo().vehicle.getPosition("ego")  # nobody has looked at the snapshot
        run.bind("ego", start="cold", stack="none")
        assert run.vehicle_ids == ("ego",)
        run.run_until(20.0)
        assert (run.snapshot.front_x_m[0], run.snapshot.front_y_m[0]) == pytest.approx(parked_m, abs=1e-6)


def leaves(folder: Path, duration_s: int, *, binds: bool) -> tuple[float, Snapshot]:
    """Return when a parked car is on its lane again, bound cold from 12 to 23 s, and the world at 60 s."""
    vehicles = car("ego", 10, 8, extra=PARKED.format(duration_s))
    vehicles += car("other", 0, 12).replace('depart="0"', 'depart="20"')
    with xgv_cosim.simulate(write_config(folder, vehicles, network("hello")), set=["duration_s=90"]) as run:
        run.run_until(12.0)
        parked_m, left_s = run.snapshot.pose_of(0), np.inf
        if binds:
            run.bind("ego", start="cold", stack="none", driver="none")
        while run.now_s < 60.0:
            if binds and run.now_s == pytest.approx(23.0):
                run.release("ego")
            seen = run.step()
            row = seen.index_of["ego"]
            if seen.lane[row] >= 0:
                left_s = min(left_s, run.now_s)
            elif left_s == np.inf:
                assert seen.pose_of(row) == pytest.approx(parked_m, abs=1e-6)
        seen.read_all()
        told = {event.kind for event in run.state.journal.events}
        assert told.isdisjoint({"world_note", "collision", "teleport"})
        if left_s == np.inf and binds:
            run.bind("ego")  # it is parked as before, and can be bound as before
            run.run_until(70.0)
            assert run.vehicle_ids == ("ego",)
        return left_s, seen


@pytest.mark.parametrize("duration_s", [40, 900])
def test_a_parked_car_that_was_bound_cold_is_parked_on_after_its_release(
    tmp_path: Path, duration_s: int
) -> None:
    """As if it had never been bound: SUMO's driver leaves the place when he would have."""
    left_s, seen = leaves(tmp_path, duration_s, binds=True)
    own_s, own = leaves(tmp_path, duration_s, binds=False)
    assert left_s == own_s
    assert (own_s == np.inf) is (duration_s == 900)
    for column in ("front_x_m", "front_y_m", "speed_mps", "lane"):
        np.testing.assert_array_equal(getattr(seen, column), getattr(own, column))


def test_a_parked_car_that_should_have_left_meanwhile_leaves_after_its_release(tmp_path: Path) -> None:
    left_s, seen = leaves(tmp_path, 10, binds=True)
    assert 24.0 < left_s < 27.0  # behind the other car
    assert seen.front_x_m[seen.index_of["other"]] > seen.front_x_m[seen.index_of["ego"]] > 300.0


def test_a_parked_car_that_was_bound_cold_and_drives_off_is_parked_no_more(tmp_path: Path) -> None:
    config = write_config(tmp_path, car("ego", 10, 8, extra=PARKED.format(40)), network("hello"))
    with xgv_cosim.simulate(config, set=["duration_s=60"]) as run:
        run.run_until(12.0)
        run.bind("ego", start="cold", stack="none", driver="none")
        run.run_until(15.0)
        assert len(load_libsumo().vehicle.getStops("ego")) == 1
        motion, slot = run.fleet.motion, run.fleet.slot_of("ego")
        for _ in range(32):  # onto its lane
            motion.y_m[slot] += 0.1
            run.step()
            motion = run.fleet.motion
        assert load_libsumo().vehicle.getStops("ego") == ()
        assert run.snapshot.lane[0] >= 0
        run.release("ego")
        run.run_until(30.0)
        assert run.snapshot.speed_mps[0] > 5.0


@pytest.mark.parametrize("start", ["cold", "handover"])
def test_whoever_looks_at_a_parked_car_as_it_is_bound_sees_where_it_stands(
    tmp_path: Path, start: str
) -> None:
    config = write_config(tmp_path, car("ego", 10, 8, extra=PARKED.format(900)), network("hello"))
    row = f"bind=[{{vehicles: ego, from_s: 12, start: {start}, stack: none, driver: none}}]"
    with xgv_cosim.simulate(config, set=["duration_s=60", row]) as run:
        while run.now_s < 15.0:
            run.step()
            assert all(0.0 < x_m < 100.0 for x_m in run.snapshot.front_x_m)
            assert all(speed_mps >= 0.0 for speed_mps in run.snapshot.speed_mps)
