"""Stops against closed forms and a published track test, over speeds, directions, grades and grip."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.xgv_cosim.kernel.fleets import Drive
from xgv_cosim.actuation import Gear, Lateral, Longitudinal, LostFunction
from xgv_cosim.parameters import load_preset

MPH_MPS = 0.44704
FOOT_M = 0.3048
EDMUNDS_30_TO_0_M = 35 * FOOT_M
"""Published track test of the non-hybrid sister car: where the preset's brake comes from."""
EDMUNDS_60_TO_0_M = 143 * FOOT_M
"""The same car's stop from twice the speed, 43.6 m: nothing in the preset comes from it."""
LOAD_MPS2 = 0.5 * 1.2 * 1.13 / 1900.0, 0.01 * 9.81
"""Drag over v², and rolling resistance."""


def full_brake_way_m(
    speed_mps: float,
    grade: float = 0.0,
    friction: float = 0.85,
    authority: float = 1.0,
    *,
    cruising: bool = False,
) -> float:
    """Return the way of a full brake, integrated here: lag, grip, road load and slope, each by its formula.

    With ``cruising`` the drive that held the speed until then fades with the throttle's lag.
    """
    cos = 1.0 / math.hypot(1.0, grade)
    way, speed, brake, dt = 0.0, speed_mps, 0.0, 1e-4

    def load_mps2() -> float:
        return LOAD_MPS2[0] * speed**2 + (LOAD_MPS2[1] + 9.81 * grade) * cos

    push = max(0.0, load_mps2()) if cruising else 0.0
    while speed > 0.0:
        brake += (1.0 - brake) * dt / 0.12
        push -= push * dt / 0.3
        decel = min(authority * 8.4 * brake, friction * 9.81 * cos) + load_mps2() - push
        way, speed = way + speed * dt, speed - decel * dt
    return way


def _paused(
    speed_mps: float, decel_mps2: float, grade: float = 0.0, friction: float = 0.85
) -> tuple[Drive, float]:
    """Return a car paused out of steady driving, and its speed at the edge."""
    drive = Drive.at(speed_mps, grade=grade, friction=friction).for_s(4.0, target_speed_mps=speed_mps)
    begin = float(drive.column("speed_mps")[-1])
    assert begin == pytest.approx(speed_mps, abs=0.1)
    drive.for_s(
        abs(speed_mps) / decel_mps2 + 2.0,
        longitudinal=Longitudinal.CONTROLLED_STOP,
        decel_limit_mps2=decel_mps2,
        brake=0.5,
    )
    return drive, begin


@pytest.mark.parametrize(
    ("speed_mps", "decel_mps2", "grade", "friction"),
    [
        (5.0, 2.5, 0.0, 0.85),
        (10.0, 1.5, 0.0, 0.85),
        (15.0, 4.0, 0.0, 0.85),
        (20.0, 2.5, 0.06, 0.85),
        (20.0, 2.5, -0.06, 0.85),
        (20.0, 2.5, -0.12, 0.85),
        (20.0, 2.5, 0.0, 0.3),
        (26.8, 2.5, 0.0, 0.85),
        (26.8, 4.0, -0.06, 0.6),
        (33.0, 6.0, 0.0, 0.85),
        (-3.0, 2.5, 0.0, 0.85),
        (-6.0, 1.5, 0.06, 0.85),
        (-6.0, 4.0, -0.06, 0.85),
    ],
)
def test_a_pause_brakes_at_its_set_deceleration_within_five_percent_xgv_36(
    speed_mps: float, decel_mps2: float, grade: float, friction: float
) -> None:
    """From 0.3 s after brake onset to 0.5 m/s; and the way is v²/2a + v t_d within 1 % + 0.1 m.

    The declared delay t_d is the time constant with which acceleration follows the demand. In reverse
    the same holds of |v|, and the gear stays.
    """
    drive, begin = _paused(speed_mps, decel_mps2, grade, friction)
    speed, accel = np.abs(drive.column("speed_mps")), drive.column("accel_mps2") * -math.copysign(1.0, begin)
    constant = slice(31, int(np.argmax(speed <= 0.5)))
    np.testing.assert_allclose(accel[constant], decel_mps2, rtol=0.05)
    expected = begin**2 / (2.0 * decel_mps2) + abs(begin) * drive.vehicle.speed_response_s
    way = float(abs(drive.motion.travelled_m[0]))
    assert abs(way - expected) <= 0.01 * expected + 0.1
    assert drive.motion.speed_mps[0] == 0.0
    assert drive.motion.gear[0] == (Gear.REVERSE if speed_mps < 0.0 else Gear.DRIVE)
    assert drive.motion.brake[0] == pytest.approx(0.5, abs=1e-3)  # XGV-33


@pytest.mark.parametrize("grade", [0.0, 0.15, -0.15])
@pytest.mark.parametrize("speed_mps", [12.0, -4.0])
def test_a_pause_holds_exactly_on_a_grade_xgv_33(speed_mps: float, grade: float) -> None:
    drive, _ = _paused(speed_mps, 2.5, grade)
    stood_m = drive.motion.x_m[0]
    drive.for_s(20.0, ticks=10, longitudinal=Longitudinal.CONTROLLED_STOP, decel_limit_mps2=2.5, brake=0.5)
    assert (drive.column("speed_mps") == 0.0).all()
    assert drive.motion.x_m[0] == stood_m


def test_a_pause_that_grip_does_not_allow_brakes_with_all_the_grip_there_is() -> None:
    drive = Drive.at(20.0, friction=0.15).for_s(1.0, target_speed_mps=20.0)
    drive.for_s(5.0, longitudinal=Longitudinal.CONTROLLED_STOP, decel_limit_mps2=4.0, brake=0.5)
    drag = 0.5 * 1.2 * 1.13 * drive.column("speed_mps")[200:400] ** 2 / 1900.0 + 0.01 * 9.81
    np.testing.assert_allclose(-drive.column("accel_mps2")[200:400], 0.15 * 9.81 + drag, rtol=0.02)


def _disabled(speed_mps: float, brake_authority: float = 1.0, **road: float) -> Drive:
    drive = Drive.at(speed_mps, **road)
    wanted = {"longitudinal": Longitudinal.FULL_BRAKE, "lateral": Lateral.FREE}
    return drive.for_s(25.0, ticks=10, brake_authority=brake_authority, **wanted)


def test_the_presets_brake_is_that_of_the_track_test_from_30_mph() -> None:
    """v²/2s of the shorter stop gives the preset; the longer one is kept for the comparison below."""
    calibrated = (30 * MPH_MPS) ** 2 / (2.0 * EDMUNDS_30_TO_0_M)
    assert load_preset("ford_escape_hybrid").max_brake_decel_mps2 == pytest.approx(calibrated, rel=0.005)


def test_disable_from_60_mph_is_within_ten_percent_of_the_track_test_xgv_31() -> None:
    """One number of the preset comes from the same car's stop from 30 mph, none from this one.

    So it is a prediction over twice the speed and four times the energy, and it fails for a wrong lag, grip,
    drag or mass law. It says nothing of the hybrid, of which no instrumented stop was found.
    """
    drive = _disabled(60 * MPH_MPS)
    assert abs(float(drive.motion.travelled_m[0]) - EDMUNDS_60_TO_0_M) <= 0.10 * EDMUNDS_60_TO_0_M
    assert (drive.motion.speed_mps[0], drive.motion.brake[0]) == (0.0, 1.0)


@pytest.mark.parametrize(
    "fault",
    [
        {"brake_lag_s": 0.3},
        {"friction": 0.7},
        {"brake_authority": 0.85},
        {"grade": -0.1},
        {"friction": 1.2, "max_brake_decel_mps2": 10.5},
    ],
)
def test_that_comparison_fails_for_a_car_with_another_brake(fault: dict[str, float]) -> None:
    """A slow brake, little grip, a lost booster, a slope or too good a brake: the ten percent see each."""
    way = float(_disabled(60 * MPH_MPS, **fault).motion.travelled_m[0])
    assert abs(way - EDMUNDS_60_TO_0_M) > 0.10 * EDMUNDS_60_TO_0_M


@pytest.mark.parametrize("speed_mps", [5.0, 13.4, 26.8, 33.0])
@pytest.mark.parametrize(
    ("road", "authority"),
    [
        ({}, 1.0),
        ({"grade": 0.12}, 1.0),
        ({"grade": -0.12}, 1.0),
        ({"friction": 0.3}, 1.0),
        ({"grade": -0.06, "friction": 0.5}, 1.0),
        ({}, 0.4),
        ({"grade": -0.12}, 0.4),
    ],
)
def test_disable_stops_after_the_way_that_lag_grip_slope_and_brake_assist_leave_xgv_31(
    speed_mps: float, road: dict[str, float], authority: float
) -> None:
    """Within 2 % + 0.1 m of the same forces integrated independently, a hundred times finer."""
    drive = _disabled(speed_mps, authority, **road)
    expected = full_brake_way_m(speed_mps, authority=authority, **road)
    assert float(drive.motion.travelled_m[0]) == pytest.approx(expected, rel=0.02, abs=0.1)
    assert drive.motion.speed_mps[0] == 0.0


@pytest.mark.parametrize("friction", [0.2, 0.4, 0.6])
def test_disable_on_a_slippery_road_takes_v_squared_over_2_mu_g_xgv_31(friction: float) -> None:
    drive = Drive.at(15.0, friction=friction, drag_area_m2=0.0, rolling_resistance=0.0)
    drive.for_s(12.0, longitudinal=Longitudinal.FULL_BRAKE)
    expected = 15.0**2 / (2.0 * friction * 9.81) + 15.0 * drive.vehicle.brake_lag_s
    assert abs(float(drive.motion.travelled_m[0])) == pytest.approx(expected, rel=0.05)


def test_brake_authority_is_what_is_left_without_the_engine_xgv_31() -> None:
    """``xgv.engine.brake_assist_lost``: the same effort gives a share of its deceleration."""
    full = Drive.at(15.0).for_s(1.0, longitudinal=Longitudinal.FULL_BRAKE, engine_on=False)
    part = Drive.at(15.0).for_s(
        1.0, longitudinal=Longitudinal.FULL_BRAKE, engine_on=False, brake_authority=0.4
    )
    assert part.motion.brake[0] == pytest.approx(full.motion.brake[0])
    assert part.column("accel_mps2")[-1] == pytest.approx(-0.4 * 8.4 - 0.1, abs=0.1)
    assert full.column("accel_mps2")[-1] < -8.0


def test_a_pause_without_speed_feedback_still_stops_and_holds_xgv_38() -> None:
    lost = {"lost_functions": LostFunction.SPEED_FEEDBACK, "decel_limit_mps2": 2.5, "brake": 0.5}
    drive = Drive.at(15.0).for_s(1.0, target_speed_mps=15.0)
    drive.for_s(10.0, longitudinal=Longitudinal.CONTROLLED_STOP, **lost)
    assert drive.motion.speed_mps[0] == 0.0
    assert float(drive.motion.travelled_m[0]) == pytest.approx(15.0**2 / 5.0, rel=0.1)
    assert drive.motion.brake[0] == pytest.approx(0.5, abs=1e-3)
