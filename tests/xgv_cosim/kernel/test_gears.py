"""Gears, engine, grade and lost functions in the plant (XGV-04, XGV-38, XGV-60, XGV-70)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.xgv_cosim.kernel.fleets import Drive
from xgv_cosim.actuation import Gear, Lateral, Longitudinal, LostFunction
from xgv_cosim.parameters import VehicleParameters, parameter_columns
from xgv_cosim.plant.wheels import wheel_speeds_mps

OPEN = {"longitudinal": Longitudinal.OPEN_LOOP, "lateral": Lateral.OPEN_LOOP, "brake": 0.0}
FREE = {"longitudinal": Longitudinal.FREE, "lateral": Lateral.FREE}


def _in_gear(gear: Gear, speed_mps: float = 0.0, **parameters: float) -> Drive:
    drive = Drive.at(speed_mps, **parameters)
    drive.motion.gear[:] = gear
    return drive


def test_a_gear_changes_after_half_a_second_at_standstill_and_a_second_of_shifting_xgv_70() -> None:
    drive = _in_gear(Gear.DRIVE)
    drive.motion.brake[:] = 0.5
    drive.for_s(3.0, **{**OPEN, "brake": 0.5}, gear_wanted=Gear.REVERSE)
    gears = drive.column("gear")
    assert int(np.argmax(gears == Gear.REVERSE)) == 150
    assert (gears[:150] == Gear.DRIVE).all()
    assert (gears[150:] == Gear.REVERSE).all()


@pytest.mark.parametrize("command", [{"brake": 0.0}, {"brake": 0.05}])
def test_no_gear_changes_without_the_brake_xgv_70(command: dict[str, float]) -> None:
    drive = _in_gear(Gear.NEUTRAL).for_s(5.0, **{**OPEN, **command}, gear_wanted=Gear.REVERSE)
    assert (drive.column("gear") == Gear.NEUTRAL).all()


def test_no_gear_changes_while_the_car_moves_and_a_release_begins_anew_xgv_70() -> None:
    drive = _in_gear(Gear.DRIVE, 10.0).for_s(2.0, **OPEN, gear_wanted=Gear.REVERSE)
    assert (drive.column("gear") == Gear.DRIVE).all()
    drive.for_s(5.0, **{**OPEN, "brake": 0.6}, gear_wanted=Gear.REVERSE)
    stopped = int(np.argmax(drive.column("speed_mps") < 0.1))
    changed = int(np.argmax(drive.column("gear") == Gear.REVERSE))
    assert changed == pytest.approx(stopped + 150, abs=1)
    braked = _in_gear(Gear.NEUTRAL)
    braked.motion.brake[:] = 0.5
    for brake in (0.5, 0.0, 0.5):  # 0.9 s, released for 0.9 s, 0.9 s: never 1.5 s together
        braked.for_s(0.9, **{**OPEN, "brake": brake}, gear_wanted=Gear.DRIVE)
        assert (braked.column("gear") == Gear.NEUTRAL).all()
    braked.for_s(0.9, **{**OPEN, "brake": 0.5}, gear_wanted=Gear.DRIVE)
    assert braked.motion.gear[0] == Gear.DRIVE


def test_between_gears_nothing_drives() -> None:
    drive = _in_gear(Gear.DRIVE, shift_brake=0.0, shift_speed_mps=100.0, creep_accel_mps2=1.0)
    drive.motion.brake[:] = 0.01
    drive.for_s(0.5, **{**OPEN, "brake": 0.01}, gear_wanted=Gear.REVERSE)
    creeping = drive.motion.speed_mps[0]
    assert creeping > 0.1
    drive.for_s(0.9, **{**OPEN, "brake": 0.01}, gear_wanted=Gear.REVERSE)
    assert (np.diff(drive.column("speed_mps"))[1:] < 0.0).all()


@pytest.mark.parametrize(
    ("gear", "way"),
    [(Gear.DRIVE, 1.0), (Gear.LOW, 1.0), (Gear.REVERSE, -1.0), (Gear.NEUTRAL, 0.0), (Gear.PARK, 0.0)],
)
def test_each_gear_drives_its_way_xgv_04(gear: Gear, way: float) -> None:
    """Throttle, and creep without it; neutral and park have no drive."""
    drive = _in_gear(gear).for_s(2.0, **OPEN, throttle=0.3)
    assert np.sign(drive.motion.speed_mps[0]) == way
    assert drive.motion.throttle[0] > 0.25
    assert np.sign(_in_gear(gear).for_s(2.0, **FREE).motion.speed_mps[0]) == way


def test_reverse_mirrors_drive_on_a_level_road() -> None:
    """The same pedals and the same wheel: the same path, from the other end."""
    command = {**OPEN, "throttle": 0.3, "steer_rad": 0.2}
    forward = _in_gear(Gear.DRIVE).for_s(6.0, **command)
    backward = _in_gear(Gear.REVERSE).for_s(6.0, **command)
    for name in ("speed_mps", "accel_mps2", "travelled_m", "heading_rad"):
        np.testing.assert_allclose(backward.column(name), -forward.column(name), atol=1e-12, err_msg=name)
    np.testing.assert_allclose(backward.column("curvature_per_m"), forward.column("curvature_per_m"))
    assert backward.column("curvature_per_m")[-1] > 0.05  # the wheel stands to the left ...
    assert backward.motion.heading_rad[0] < 0.0  # ... so backwards the car turns clockwise ...
    assert backward.motion.y_m[0] > 0.0  # ... round the same centre, to its left


def test_low_gear_brakes_with_its_engine_and_has_a_top_speed() -> None:
    low, coasting = _in_gear(Gear.LOW, 12.0), _in_gear(Gear.DRIVE, 12.0)
    low.for_s(1.0, **FREE)
    coasting.for_s(1.0, **FREE)
    more = coasting.column("accel_mps2")[-1] - low.column("accel_mps2")[-1]
    assert 0.8 <= more <= 1.0
    low.for_s(40.0, ticks=10, **OPEN, throttle=1.0)
    assert 14.0 < low.motion.speed_mps[0] <= VehicleParameters().low_speed_cap_mps


def test_park_locks_the_car_on_any_grade() -> None:
    for grade in (0.3, -0.3):
        drive = _in_gear(Gear.PARK, grade=grade).for_s(10.0, ticks=10, **OPEN, throttle=1.0)
        assert (drive.column("speed_mps") == 0.0).all()


@pytest.mark.parametrize("grade", [0.05, 0.2, -0.05, -0.2])
def test_a_car_without_brake_rolls_down_its_grade_as_gravity_says(grade: float) -> None:
    drive = _in_gear(Gear.NEUTRAL, grade=grade, drag_area_m2=0.0).for_s(2.0, **FREE)
    slope = 9.81 * math.sin(math.atan(grade))
    rolling = 0.01 * 9.81 * math.cos(math.atan(grade))
    expected = -math.copysign(abs(slope) - rolling, grade)
    assert drive.motion.speed_mps[0] == pytest.approx(2.0 * expected, rel=1e-9)
    assert drive.motion.travelled_m[0] == pytest.approx(2.0 * expected, rel=1e-9)


def test_a_grade_is_held_by_enough_brake_only() -> None:
    slope = 9.81 * math.sin(math.atan(0.2))
    enough = (slope - 0.01 * 9.81 * math.cos(math.atan(0.2))) / 8.4
    for brake, holds in ((1.01 * enough, True), (0.99 * enough, False)):
        drive = _in_gear(Gear.NEUTRAL, grade=0.2)
        drive.motion.brake[:] = brake
        drive.for_s(5.0, **{**OPEN, "brake": brake})
        assert bool(drive.motion.speed_mps[0] == 0.0) is holds
        assert holds or drive.motion.speed_mps[0] < 0.0


@pytest.mark.parametrize("grade", [0.1, -0.1])
@pytest.mark.parametrize("speed_mps", [10.0, -4.0])
def test_the_speed_controller_knows_the_grade_xgv_06(grade: float, speed_mps: float) -> None:
    drive = Drive.at(speed_mps, grade=grade).for_s(4.0, target_speed_mps=speed_mps)
    drive.for_s(6.0, target_speed_mps=0.5 * speed_mps)
    assert np.abs(drive.column("speed_mps") - drive.wanted("speed_mps")).max() < 0.3
    drive.for_s(12.0, target_speed_mps=0.0)
    drive.for_s(5.0, target_speed_mps=0.0)
    assert (drive.column("speed_mps") == 0.0).all()


def test_a_reference_is_tracked_backwards_xgv_06() -> None:
    drive = Drive.at(-0.001).for_s(6.0, target_speed_mps=-5.0, target_curvature_per_m=0.08)
    assert np.abs(drive.column("speed_mps") - drive.wanted("speed_mps")).max() < 0.25
    assert drive.column("speed_mps")[-1] == pytest.approx(-5.0, abs=0.1)
    assert drive.column("curvature_per_m")[-1] == pytest.approx(0.08, rel=1e-3)


def test_without_an_engine_neither_throttle_nor_creep_moves_the_car_xgv_04() -> None:
    drive = _in_gear(Gear.DRIVE).for_s(3.0, **OPEN, throttle=1.0, engine_on=False)
    assert (drive.column("speed_mps") == 0.0).all()
    rolling = _in_gear(Gear.DRIVE, 10.0).for_s(3.0, **OPEN, throttle=1.0, engine_on=False)
    assert (np.diff(rolling.column("speed_mps")) < 0.0).all()
    closed = _in_gear(Gear.DRIVE, 10.0).for_s(5.0, target_speed_mps=15.0, engine_on=False)
    assert closed.column("throttle").max() == 0.0
    assert abs(closed.motion.speed_error_integral_m[0]) < 0.2  # no wind-up


@pytest.mark.parametrize("mode", [m for m in Longitudinal if m is not Longitudinal.DRIVER])
def test_a_lost_brake_does_not_brake_in_any_mode_xgv_38(mode: Longitudinal) -> None:
    drive = Drive.at(10.0)
    drive.motion.brake[:] = 0.5
    drive.for_s(3.0, longitudinal=mode, brake=1.0, lost_functions=LostFunction.BRAKE)
    assert drive.motion.brake[0] == 0.0
    assert drive.motion.speed_mps[0] > 7.0


@pytest.mark.parametrize("mode", [Longitudinal.CLOSED_LOOP, Longitudinal.OPEN_LOOP])
def test_a_lost_throttle_returns_to_zero_xgv_38(mode: Longitudinal) -> None:
    drive = Drive.at(10.0).for_s(2.0, target_speed_mps=20.0)
    assert drive.motion.throttle[0] > 0.3
    lost = {"throttle": 1.0, "brake": 0.0, "lost_functions": LostFunction.THROTTLE}
    drive.for_s(6.0, longitudinal=mode, target_speed_mps=20.0, **lost)
    assert drive.motion.throttle[0] == 0.0


@pytest.mark.parametrize("mode", [Lateral.CLOSED_LOOP, Lateral.OPEN_LOOP, Lateral.LATCH_LAST])
def test_a_lost_steering_is_a_released_wheel_xgv_38(mode: Lateral) -> None:
    """``plant.released_steering`` says what it does: it turns back, or stays."""
    for aligns, expected in ((1.0, 0.0), (0.0, 0.05)):
        drive = Drive.at(10.0, released_steering_self_aligns=aligns)
        drive.motion.steer_rad[:] = 0.05
        command = {"target_speed_mps": 10.0, "target_curvature_per_m": 0.1, "steer_rad": 0.4}
        drive.for_s(8.0, ticks=10, lateral=mode, **command, lost_functions=LostFunction.STEERING)
        assert drive.motion.steer_rad[0] == pytest.approx(expected, abs=1e-4)


def test_a_lost_speed_feedback_leaves_the_feed_forward_xgv_38() -> None:
    lost = {"lost_functions": LostFunction.SPEED_FEEDBACK}
    drive = Drive.at(8.0).for_s(6.0, target_speed_mps=12.0, **lost)
    assert drive.motion.speed_error_integral_m[0] == 0.0
    assert drive.motion.speed_mps[0] == pytest.approx(12.0, abs=1.0)


def test_the_world_s_driver_selects_the_gear_he_drives_in() -> None:
    drive = _in_gear(Gear.REVERSE, 3.0).for_s(0.1, longitudinal=Longitudinal.DRIVER)
    assert drive.motion.gear[0] == Gear.DRIVE
    drive = _in_gear(Gear.PARK, -3.0).for_s(0.1, longitudinal=Longitudinal.DRIVER)
    assert drive.motion.gear[0] == Gear.REVERSE


def test_a_straight_car_has_four_equal_wheel_speeds_and_a_bend_sets_them_apart() -> None:
    motion = Drive.at(10.0).motion
    parameters = parameter_columns(VehicleParameters(), 1)
    assert [float(wheel[0]) for wheel in wheel_speeds_mps(motion, parameters)] == [10.0] * 4
    motion.curvature_per_m[:] = 0.1
    wheels = wheel_speeds_mps(motion, parameters)
    yaw_rate, p = 1.0, VehicleParameters()
    assert wheels.rear_right_mps - wheels.rear_left_mps == pytest.approx(yaw_rate * p.rear_track_m)
    # Each wheel goes round the centre of the turn, 10 m to the left of the rear axle's middle.
    assert wheels.front_left_mps == pytest.approx(
        yaw_rate * math.hypot(10.0 - p.front_track_m / 2, p.wheelbase_m)
    )
    assert wheels.front_right_mps == pytest.approx(
        yaw_rate * math.hypot(10.0 + p.front_track_m / 2, p.wheelbase_m)
    )
    motion.speed_mps[:] = -10.0
    assert all(wheel[0] < 0.0 for wheel in wheel_speeds_mps(motion, parameters))
