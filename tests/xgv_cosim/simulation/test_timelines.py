"""Timelines on real SUMO traffic: what an operator does, what the vehicle does, tick by tick."""

from __future__ import annotations

import math

import numpy as np
import pytest

import xgv_cosim
from tests.xgv_cosim.simulation.conftest import Opener
from xgv_cosim.actuation import Longitudinal
from xgv_cosim.errors import ScenarioError, UnknownVehicleError, WorldError


def events_of(simulation: xgv_cosim.Simulation, kind: str, vehicle: str = "xgv_0") -> list[tuple[float, str]]:
    return [
        (e.t_s, e.after) for e in simulation.state.journal.events if e.kind == kind and e.vehicle == vehicle
    ]


def test_a_bound_car_drives_by_wire_as_soon_as_its_stack_has_control(open_hello: Opener) -> None:
    """XGV-17, 22-26: request, resume, motion profiles; the hand-over is logged."""
    simulation = open_hello()
    simulation.step()
    assert simulation.vehicle("xgv_0").mode == "software_pause"
    # The world's driver keeps it until then: it is not braked just because it was bound.
    assert simulation.fleet.longitudinal[simulation.fleet.slot_of("xgv_0")] == Longitudinal.DRIVER
    simulation.step()
    car = simulation.vehicle("xgv_0")
    assert car.mode == "drive_by_wire"
    assert events_of(simulation, "handover") == [(0.1, "computer")]


def test_pause_stops_at_the_set_deceleration_and_holds_half_brake_then_drives_on(open_hello: Opener) -> None:
    """XGV-12, 28, 33, 36: constant deceleration, 50 % effort at standstill, steering alive, release."""
    simulation = open_hello()
    simulation.run_until(5.0)
    car, slot = simulation.vehicle("xgv_0"), simulation.fleet.slot_of("xgv_0")
    entry_mps = car.speed_mps
    car.estop("pause")
    simulation.run_until(6.0)
    assert car.mode == "estop_pause"
    assert car.reasons[0] == "SafeStop pause relay"
    while car.speed_mps > 1.0:
        simulation.step()
        assert car.accel_mps2 == pytest.approx(-2.5, rel=0.05)
    simulation.run_until(6.0 + entry_mps / 2.5 + 1.0)
    assert car.speed_mps == 0.0
    assert simulation.fleet.motion.brake[slot] == pytest.approx(0.5, abs=1e-3)
    assert simulation.fleet.motion.throttle[slot] == pytest.approx(0.0, abs=1e-6)
    car.estop("run")
    simulation.run_until(simulation.now_s + 4.0)
    assert car.mode == "drive_by_wire"
    assert car.speed_mps > 2.0


def test_stop_brakes_fully_and_gives_the_wheel_to_the_rider_after_his_reaction(open_hello: Opener) -> None:
    """XGV-31, XGV-64: 100 % brake, steering nobody's for one second, then the rider's."""
    simulation = open_hello()
    simulation.run_until(5.0)
    car, slot = simulation.vehicle("xgv_0"), simulation.fleet.slot_of("xgv_0")
    car.estop("stop")
    simulation.run_until(5.5)
    assert car.mode == "estop_disable"
    assert simulation.fleet.motion.brake[slot] == pytest.approx(1.0, abs=0.03)
    simulation.run_until(10.0)
    assert events_of(simulation, "steering_control")[-2:] == [(5.0, "nobody"), (6.0, "driver")]
    assert car.speed_mps == 0.0


def test_nobody_aboard_nobody_takes_the_wheel(open_hello: Opener) -> None:
    """XGV-64 ``bind.driver = none``: the axis stays nobody's for as long as the disable lasts."""
    simulation = open_hello("bind.0.driver=none")
    simulation.run_until(5.0)
    simulation.vehicle("xgv_0").estop("stop")
    simulation.run_until(9.0)
    assert events_of(simulation, "steering_control")[-1] == (5.0, "nobody")


def test_override_hands_both_axes_to_the_rider_at_once_and_back_without_a_jerk(open_hello: Opener) -> None:
    """XGV-13, 29, 64: the world's driver drives; position, speed and heading stay continuous."""
    simulation = open_hello()
    simulation.run_until(6.0)
    car = simulation.vehicle("xgv_0")
    before = (car.pose, car.speed_mps)
    car.override()
    jumps_m, jumps_mps = [], []
    for tenth in range(80):
        simulation.step()
        pose, speed = car.pose, car.speed_mps
        moved = math.hypot(pose.x_m - before[0].x_m, pose.y_m - before[0].y_m)
        jumps_m.append(abs(moved - 0.05 * (speed + before[1])))
        jumps_mps.append(abs(speed - before[1]))
        before = (pose, speed)
        if tenth == 0:
            assert car.mode == "manual_override"
            assert events_of(simulation, "speed_control")[-1] == (6.0, "driver")
        if tenth == 40:
            car.override(engaged=False)
    assert car.mode == "drive_by_wire"
    assert max(jumps_m) < 0.15
    assert max(jumps_mps) < 0.5


def test_the_coupling_is_changed_at_run_time(open_hello: Opener) -> None:
    """Issue 3.1: by default auto; each change is an event, asking for what is already is none."""
    simulation = open_hello()
    simulation.run_until(3.0)
    car, shares = simulation.vehicle("xgv_0"), []
    for kind in ("auto", "free", "lane", "lane", "auto"):
        car.set_coupling(kind)
        shares.append(0)
        for _ in range(10):
            snapshot = simulation.step()
            shares[-1] += int(snapshot.in_lane_frame[snapshot.index_of["xgv_0"]])
    assert shares == [10, 0, 10, 10, 10]
    assert [after for _, after in events_of(simulation, "coupling")] == ["free", "lane", "auto"]
    with pytest.raises(ScenarioError, match="expected one of free, lane, auto"):
        car.set_coupling("magnetic")  # type: ignore[arg-type]


def test_disable_beats_override(open_hello: Opener) -> None:
    """XGV-29, XGV-31: under manual override the stop button still stops the car."""
    simulation = open_hello()
    simulation.run_until(5.0)
    car = simulation.vehicle("xgv_0")
    car.override()
    simulation.run_until(6.0)
    car.estop("stop")
    simulation.run_until(12.0)
    assert car.mode == "estop_disable"
    assert car.speed_mps == 0.0


def test_lost_commands_expire_raise_9157_and_clear_with_a_fresh_command(open_hello: Opener) -> None:
    """XGV-43, XGV-71: the 400 ms of the last motion run out on their own tick."""
    simulation = open_hello("injections=[{at_s: 5.03, vehicles: xgv_0, kind: cmd_loss, duration_s: 3.0}]")
    simulation.run_until(10.0)
    errors = events_of(simulation, "error")
    # The last motion arrived at 5.0 s and lasts 0.4 s; the first after the loss arrives at 8.1 s.
    assert errors == [(5.4, "9157"), (8.1, "")]
    modes = events_of(simulation, "safety_mode")
    assert modes[-2:] == [(5.4, "software_pause"), (8.1, "drive_by_wire")]


def test_device_edges_act_on_their_own_tick_inside_a_world_step(open_hello: Opener) -> None:
    """XGV-71: an edge at 5.03 s acts at 5.03 s, and the car brakes 70 ms longer than with one at 5.10 s."""
    distance = {}
    for at_s in (5.03, 5.10):
        simulation = open_hello(f"injections=[{{at_s: {at_s}, vehicles: xgv_0, kind: estop_pause}}]")
        simulation.run_until(15.0)
        assert events_of(simulation, "safety_mode")[-1] == (at_s, "estop_pause")
        distance[at_s] = simulation.vehicle("xgv_0").pose.x_m
        simulation.close()
    assert distance[5.10] - distance[5.03] == pytest.approx(0.07 * 13.9, rel=0.05)


def test_an_open_door_pauses_and_an_override_of_it_drives(open_hello: Opener) -> None:
    """XGV-27 below XGV-29."""
    simulation = open_hello()
    simulation.run_until(4.0)
    car = simulation.vehicle("xgv_0")
    car.door()
    simulation.run_until(5.0)
    assert (car.mode, car.reasons[0]) == ("software_pause", "door or liftgate open")
    car.override()
    simulation.run_until(5.2)
    assert car.mode == "manual_override"


def test_partial_mode_leaves_an_axis_to_the_rider(open_hello: Opener) -> None:
    """XGV-39: manual steering gives the wheel to the rider while the computer keeps the speed."""
    simulation = open_hello()
    simulation.run_until(4.0)
    car = simulation.vehicle("xgv_0")
    car.set_partial_mode("manual_steering")
    simulation.run_until(6.0)
    assert events_of(simulation, "steering_control")[-1] == (4.0, "driver")
    assert events_of(simulation, "speed_control") == [(0.1, "computer")]
    assert car.mode == "drive_by_wire"
    car.set_partial_mode("manual_speed")
    simulation.run_until(9.0)
    assert events_of(simulation, "speed_control")[-1] == (6.0, "driver")
    assert events_of(simulation, "steering_control")[-1] == (6.0, "computer")
    assert car.speed_mps > 1.0
    with pytest.raises(ScenarioError, match="both axes manual"):
        car.set_partial_mode("both_manual")


def test_partial_mode_is_refused_where_nobody_sits(open_hello: Opener) -> None:
    """XGV-41: manual speed with nobody aboard is refused."""
    simulation = open_hello("bind.0.driver=none")
    simulation.step()
    with pytest.raises(ScenarioError, match="driver"):
        simulation.vehicle("xgv_0").set_partial_mode("manual_speed")


def test_a_stop_before_the_hand_over_acts(open_hello: Opener) -> None:
    """XGV-31: no stop demand is without effect, even while the world's driver still drives."""
    simulation = open_hello("bind.0.stack=none")
    simulation.run_until(3.0)
    car = simulation.vehicle("xgv_0")
    assert car.mode == "software_pause"
    assert car.speed_mps > 5.0
    car.estop("stop")
    simulation.run_until(8.0)
    assert car.speed_mps == 0.0


def test_cold_start_needs_standstill(open_hello: Opener) -> None:
    """Cross-profile rules, Binding: ``bind.start = cold`` begins at standstill only."""
    simulation = open_hello("bind.0.start=cold")
    with pytest.raises(ScenarioError, match="standstill"):
        simulation.step()


def test_unsupported_injections_say_so(open_hello: Opener) -> None:
    """Cross-profile rules: a profile that lacks an event logs "unsupported"."""
    simulation = open_hello("injections=[{at_s: 1.0, vehicles: xgv_0, kind: reinit}]")
    simulation.run_until(2.0)
    assert events_of(simulation, "injection_unsupported") == [(1.0, "reinit")]


def test_injections_choose_among_bound_vehicles_by_pattern(open_hello: Opener) -> None:
    simulation = open_hello("injections=[{at_s: 1.0, vehicles: 'xgv_*', kind: door, duration_s: 1.0}]")
    simulation.run_until(3.0)
    for vehicle in simulation.vehicle_ids:
        assert events_of(simulation, "injection", vehicle) == [(1.0, "door"), (2.0, "")]


def test_an_injection_into_a_vehicle_nobody_knows_is_an_event_with_near_names(open_hello: Opener) -> None:
    rows = [f"{{at_s: {at_s}, vehicles: {name}, kind: door}}" for at_s, name in ((1, "xgv_00"), (1.2, "zz"))]
    simulation = open_hello(f"injections=[{', '.join(rows)}, {{at_s: 1.4, vehicles: xgv_0, kind: door}}]")
    simulation.run_until(2.0)
    assert events_of(simulation, "injection_without_vehicle", "xgv_00") == [(1.0, "door")]
    told = [event for event in simulation.state.journal.events if event.kind == "injection_without_vehicle"]
    unknown = "the world knows no vehicle of this name now"
    assert [event.reasons for event in told] == [(unknown, "did you mean 'xgv_0'?"), (unknown,)]
    assert events_of(simulation, "injection", "xgv_0") == [(1.4, "door")]


def test_unknown_vehicles_and_kinds_are_named(open_hello: Opener) -> None:
    simulation = open_hello()
    simulation.step()
    with pytest.raises(UnknownVehicleError, match="ghost"):
        simulation.vehicle("ghost")
    with pytest.raises(ScenarioError, match="estop_pause"):
        simulation.vehicle("xgv_0").inject("estop")
    with pytest.raises(ScenarioError, match="'run'"):
        simulation.vehicle("xgv_0").estop("go")  # type: ignore[arg-type]


def test_one_simulation_per_process(open_hello: Opener) -> None:
    simulation = open_hello()
    with pytest.raises(WorldError, match="one"), xgv_cosim.simulate("hello"):
        pass
    simulation.step()  # the first one lives on


def test_lane_coupling_follows_the_plant(open_hello: Opener) -> None:
    """Point 1.10: the lane coupling drives like the free one as long as the car keeps its lane."""
    ends = {}
    for coupling in ("free", "lane"):
        simulation = open_hello(f"bind.0.coupling={coupling}")
        simulation.run_until(5.0)
        simulation.vehicle("xgv_0").estop("pause")
        simulation.run_until(12.0)
        ends[coupling] = np.array(simulation.vehicle("xgv_0").pose)
        simulation.close()
    assert ends["lane"][:2] == pytest.approx(ends["free"][:2], abs=0.3)
