"""The plant's scalar functions against their closed forms."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xgv_cosim.controllers.curvature import steer_for_curvature_rad
from xgv_cosim.controllers.speed import leading, pedals
from xgv_cosim.plant.actuators import advance_pedal, advance_steer_rad, lag_share
from xgv_cosim.plant.lateral import advance_curvature, max_lateral_accel_mps2, steady_curvature_per_m
from xgv_cosim.plant.longitudinal import (
    advance_speed,
    full_throttle_accel_mps2,
    maximum_braking_share,
    throttle_accel_mps2,
)
from xgv_cosim.plant.pose import advance_pose


@given(st.floats(0.0, 40.0), st.floats(0.0, 5.0), st.floats(0.0, 12.0), st.floats(1e-3, 0.2))
def test_resistance_never_turns_the_car_round(
    speed: float, push: float, resistance: float, dt: float
) -> None:
    after, accel, distance = advance_speed(speed, push, resistance, dt)
    assert after >= 0.0
    assert distance >= 0.0
    assert after - speed == pytest.approx(accel * dt, abs=1e-9)
    if speed == 0.0 and push <= resistance:
        assert (after, accel, distance) == (0.0, 0.0, 0.0)


@given(st.floats(-40.0, 40.0), st.floats(-5.0, 5.0), st.floats(0.0, 12.0), st.floats(1e-3, 0.2))
def test_backwards_is_forwards_mirrored(speed: float, push: float, resistance: float, dt: float) -> None:
    there = advance_speed(speed, push, resistance, dt)
    assert advance_speed(-speed, -push, resistance, dt) == tuple(-value for value in there)


def test_a_car_that_stops_within_a_tick_has_driven_v_squared_over_2a() -> None:
    speed, _, distance = advance_speed(0.05, 0.0, 8.0, 0.01)
    assert speed == 0.0
    assert distance == pytest.approx(0.05**2 / 16.0)


@given(st.floats(-0.5, 0.5), st.floats(-3.0, 3.0), st.floats(0.0, 20.0))
def test_an_arc_equals_the_circle_it_lies_on(curvature: float, heading: float, distance: float) -> None:
    x, y, after = advance_pose(1.0, -2.0, heading, distance, curvature)
    assert after == pytest.approx(heading + curvature * distance)
    if abs(curvature) > 1e-3:
        assert x == pytest.approx(1.0 + (math.sin(after) - math.sin(heading)) / curvature, abs=1e-10)
        assert y == pytest.approx(-2.0 - (math.cos(after) - math.cos(heading)) / curvature, abs=1e-10)
    else:
        assert math.hypot(x - 1.0, y + 2.0) == pytest.approx(distance, abs=1e-3)


@pytest.mark.parametrize("half_angle", [0.0999999, 0.1000001])
def test_series_and_quotient_of_the_arc_meet(half_angle: float) -> None:
    x, y, _ = advance_pose(0.0, 0.0, 0.0, 1.0, 2.0 * half_angle)
    assert math.hypot(x, y) == pytest.approx(math.sin(half_angle) / half_angle, abs=1e-15)


@given(st.floats(-0.2, 0.2), st.floats(0.0, 40.0))
def test_the_curvature_controller_inverts_the_steady_turn(curvature: float, speed: float) -> None:
    steer = steer_for_curvature_rad(curvature, speed, 2.619, 0.0025, math.pi / 2)
    assert steady_curvature_per_m(steer, speed, 2.619, 0.0025) == pytest.approx(curvature, abs=1e-12)


def test_the_curvature_controller_is_the_bicycle_model_for_small_angles() -> None:
    assert steer_for_curvature_rad(0.005, 20.0, 2.619, 0.0025, 0.57) == pytest.approx(
        math.atan(0.005 * 2.619) + 0.0025 * 0.005 * 400.0, rel=1e-3
    )
    assert steer_for_curvature_rad(5.0, 1.0, 2.619, 0.0025, 0.57) == 0.57


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.01, 1.0))
def test_a_lag_is_the_exponential_whatever_the_tick(present: float, command: float, lag: float) -> None:
    effort = present
    for _ in range(10):
        effort = advance_pedal(effort, command, lag_share(lag, 0.01))
    exact = command + (present - command) * math.exp(-0.1 / lag)
    assert effort == pytest.approx(exact, abs=2e-6)  # the actuator counts as settled within 1e-6


def test_a_released_pedal_ends_at_exactly_zero() -> None:
    effort = 1.0
    for _ in range(200):
        effort = advance_pedal(effort, 0.0, lag_share(0.12, 0.01))
    assert effort == 0.0


def test_steering_keeps_its_rate_and_its_stops() -> None:
    assert advance_steer_rad(0.0, 0.5, 1.0, 0.4, 0.57, 0.01) == pytest.approx(0.004)
    assert advance_steer_rad(0.569, 2.0, 1.0, 0.4, 0.57, 0.01) == 0.57


def test_throttle_is_dead_then_linear_then_bounded_by_power() -> None:
    assert throttle_accel_mps2(0.02, 3.0, 0.02) == 0.0
    assert throttle_accel_mps2(0.51, 3.0, 0.02) == pytest.approx(1.5)
    assert throttle_accel_mps2(1.0, 3.0, 0.02) == pytest.approx(3.0)
    assert full_throttle_accel_mps2(5.0, 6200.0, 105e3, 1900.0) == pytest.approx(6200.0 / 1900.0)
    assert full_throttle_accel_mps2(30.0, 6200.0, 105e3, 1900.0) == pytest.approx(105e3 / 30.0 / 1900.0)


@given(st.floats(-8.0, 8.0), st.floats(0.0, 0.5), st.floats(0.0, 0.5))
def test_only_one_pedal_at_a_time(tyres: float, throttle: float, brake: float) -> None:
    wanted_throttle, wanted_brake = pedals(tyres, throttle, brake, 0.0, 3.0, 8.4, 0.02, 0.15)
    assert wanted_throttle >= 0.0
    assert wanted_brake >= 0.0
    assert wanted_throttle == 0.0 or wanted_brake == 0.0
    if wanted_throttle > 0.0:
        assert throttle_accel_mps2(wanted_throttle, 3.0, 0.02) == pytest.approx(tyres, abs=1e-12)
    if wanted_brake > 0.0:
        assert wanted_brake * 8.4 == pytest.approx(-tyres)


def test_a_demand_near_zero_does_not_change_pedals() -> None:
    assert pedals(-0.1, 0.2, 0.0, 0.5, 3.0, 8.4, 0.02, 0.15) == (0.0, 0.0)
    assert pedals(0.1, 0.0, 0.2, 0.0, 3.0, 8.4, 0.02, 0.15) == (0.0, 0.0)
    assert pedals(-0.1, 0.0, 0.0, 0.0, 3.0, 8.4, 0.02, 0.15)[1] > 0.0


def test_a_leading_command_makes_the_pedal_as_fast_as_wanted() -> None:
    slow, fast = lag_share(0.12, 0.01), lag_share(0.06, 0.01)
    effort = 0.1
    for tick in range(1, 20):
        effort = advance_pedal(effort, leading(0.3, effort, fast / slow), slow)
        assert effort == pytest.approx(0.3 - 0.2 * math.exp(-tick * 0.01 / 0.06), abs=1e-9)


@given(st.floats(-10.0, 10.0))
def test_the_friction_circle(along: float) -> None:
    grip = 0.85 * 9.81
    lateral = max_lateral_accel_mps2(along, grip, 0.3)
    if abs(along) < 0.95 * grip:
        assert math.hypot(lateral, along) == pytest.approx(grip)
    else:
        assert lateral == pytest.approx(max(0.3 * grip, math.sqrt(max(0.0, grip**2 - along**2))))


def test_grip_caps_the_curvature_on_both_sides() -> None:
    for sign in (1.0, -1.0):
        curvature, is_limited = advance_curvature(
            sign * 0.1, sign * 0.1, 20.0, 0.0, 0.85 * 9.81, 0.3, 0.01, 0.01
        )
        assert curvature == pytest.approx(sign * 0.85 * 9.81 / 400.0)
        assert is_limited
        curvature, is_limited = advance_curvature(
            sign * 0.02, sign * 0.02, 20.0, 0.0, 0.85 * 9.81, 0.3, 0.01, 0.01
        )
        assert curvature == pytest.approx(sign * 0.02)  # 8.0 m/s², just within the circle
        assert not is_limited


def test_maximum_braking_spends_what_the_bend_leaves_gkc_24() -> None:
    grip = 0.95 * 0.85 * 9.81
    assert maximum_braking_share(0.0, 8.4, 0.85 * 9.81) == pytest.approx(grip / 8.4)
    assert maximum_braking_share(5.0, 8.4, 0.85 * 9.81) == pytest.approx(math.sqrt(grip**2 - 25.0) / 8.4)
    assert maximum_braking_share(20.0, 8.4, 0.85 * 9.81) == 0.0


@given(st.floats(-0.1, 0.1), st.floats(0.0, 30.0))
def test_the_steady_turn_is_the_relation_of_public_clients_for_small_angles_xgv_62(
    steer: float, speed: float
) -> None:
    """They use ``tan(phi / (1 + v² k_us)) / L``; with ``k_us = Ku / L`` it differs in third order only."""
    theirs = math.tan(steer / (1.0 + speed * speed * 0.0025 / 2.619)) / 2.619
    assert steady_curvature_per_m(steer, speed, 2.619, 0.0025) == pytest.approx(theirs, rel=4e-3, abs=1e-12)
