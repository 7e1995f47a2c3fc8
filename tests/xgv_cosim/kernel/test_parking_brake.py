"""The parking brake in the plant: at once, gently, against motion, whatever engine and brake do (XGV-60)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.xgv_cosim.kernel.fleets import Drive
from xgv_cosim.actuation import Gear, Lateral, Longitudinal, LostFunction
from xgv_cosim.parameters import GRAVITY_MPS2, VehicleParameters
from xgv_cosim.plant.longitudinal import brake_decel_mps2, parking_brake_mps2

NOBODY = {"longitudinal": Longitudinal.FREE, "lateral": Lateral.FREE}
OPEN = {"longitudinal": Longitudinal.OPEN_LOOP, "lateral": Lateral.OPEN_LOOP, "brake": 0.0}
SET_MPS2 = VehicleParameters().parking_brake_decel_mps2


def _rolling(speed_mps: float = 0.0, **parameters: float) -> Drive:
    drive = Drive.at(speed_mps, **parameters)
    drive.motion.gear[:] = Gear.NEUTRAL
    return drive


@pytest.mark.parametrize("grade", [0.05, 0.2, -0.05, -0.2])
def test_set_it_holds_a_car_that_nobody_holds_on_a_grade_xgv_09(grade: float) -> None:
    held = _rolling(grade=grade).for_s(30.0, ticks=10, **NOBODY, parking_brake=True)
    assert (held.column("speed_mps") == 0.0).all()
    assert held.motion.travelled_m[0] == 0.0
    rolled = _rolling(grade=grade).for_s(2.0, **NOBODY)
    assert np.sign(rolled.motion.speed_mps[0]) == -np.sign(grade)


@pytest.mark.parametrize("grade", [0.25, -0.25])
def test_it_is_no_park_lock_a_steeper_grade_wins(grade: float) -> None:
    drive = _rolling(grade=grade, drag_area_m2=0.0).for_s(2.0, **NOBODY, parking_brake=True)
    angle = math.atan(grade)
    left = GRAVITY_MPS2 * (abs(math.sin(angle)) - 0.01 * math.cos(angle)) - SET_MPS2
    assert drive.motion.speed_mps[0] == pytest.approx(-math.copysign(2.0 * left, grade), rel=1e-6)


@pytest.mark.parametrize("speed_mps", [10.0, -4.0])
def test_a_moving_car_it_brakes_at_once_and_gently_to_a_standstill(speed_mps: float) -> None:
    drive = _rolling(speed_mps, drag_area_m2=0.0).for_s(8.0, **NOBODY, parking_brake=True)
    accel = drive.column("accel_mps2")
    expected = -math.copysign(SET_MPS2 + 0.01 * GRAVITY_MPS2, speed_mps)
    moving = np.flatnonzero(np.abs(drive.column("speed_mps")) > 0.1)[1:]
    np.testing.assert_allclose(accel[moving], expected, rtol=1e-9)  # from the first tick on, no lag
    assert drive.motion.speed_mps[0] == 0.0


def test_it_does_not_yield_to_creep_or_a_little_throttle() -> None:
    drive = Drive.at(0.0).for_s(5.0, **OPEN, throttle=0.3, parking_brake=True)
    assert (drive.column("speed_mps") == 0.0).all()
    drive.for_s(3.0, **OPEN, throttle=1.0, parking_brake=True)
    assert drive.motion.speed_mps[0] > 1.0  # it is a brake, no lock


@pytest.mark.parametrize(
    "fault",
    [
        {"engine_on": False},
        {"brake_authority": 0.0},
        {"lost_functions": LostFunction.BRAKE},
        {"lost_functions": LostFunction.BRAKE | LostFunction.THROTTLE | LostFunction.SPEED_FEEDBACK},
    ],
)
def test_no_engine_no_assistance_and_no_brake_error_takes_it_away_xgv_38(fault: dict[str, float]) -> None:
    drive = _rolling(5.0).for_s(1.0, **NOBODY, parking_brake=True, **fault)
    assert drive.motion.speed_mps[0] == pytest.approx(5.0 - (SET_MPS2 + 0.1), abs=0.05)


@pytest.mark.parametrize("grade", [0.0, -0.05])
def test_a_pause_keeps_its_constant_deceleration_with_it_set_xgv_36(grade: float) -> None:
    drive = Drive.at(15.0, grade=grade)
    drive.for_s(10.0, longitudinal=Longitudinal.CONTROLLED_STOP, decel_limit_mps2=2.5, parking_brake=True)
    speed, accel = drive.column("speed_mps"), drive.column("accel_mps2")
    braking = np.flatnonzero(speed > 0.5)
    np.testing.assert_allclose(accel[braking[31:]], -2.5, rtol=0.05)
    assert drive.motion.speed_mps[0] == 0.0


def test_closed_loop_knows_it_and_keeps_its_speed_xgv_06() -> None:
    drive = Drive.at(10.0).for_s(3.0, target_speed_mps=10.0)
    drive.for_s(6.0, target_speed_mps=10.0, parking_brake=True)
    assert np.abs(drive.column("speed_mps") - 10.0).max() < 0.6
    assert drive.motion.speed_mps[0] == pytest.approx(10.0, abs=0.1)


@pytest.mark.parametrize("brake", [0.0, 1.0])
def test_on_ice_all_brakes_together_have_the_grip_and_no_more(brake: float) -> None:
    drive = _rolling(5.0, friction=0.1).for_s(1.0, **{**OPEN, "brake": brake}, parking_brake=True)
    grip = 0.1 * GRAVITY_MPS2
    assert drive.column("accel_mps2")[1:].min() == pytest.approx(-grip - 0.01 * GRAVITY_MPS2, abs=0.02)


@given(
    brake=st.floats(0.0, 1.0),
    most=st.floats(0.0, 12.0),
    parking=st.floats(0.0, 5.0),
    grip=st.floats(0.0, 10.0),
)
def test_brakes_add_up_to_the_grip(brake: float, most: float, parking: float, grip: float) -> None:
    set_mps2 = parking_brake_mps2(True, parking, grip)
    assert parking_brake_mps2(False, parking, grip) == 0.0
    assert set_mps2 == min(parking, grip)
    both = brake_decel_mps2(brake, most, set_mps2, grip)
    assert both == min(brake * most + set_mps2, grip)
    assert both >= brake_decel_mps2(brake, most, 0.0, grip)
