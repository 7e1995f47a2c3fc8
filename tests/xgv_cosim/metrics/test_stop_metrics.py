"""Stop metrics against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.metrics import VehicleSeries, stop_metrics, time_to_collision_s

STEP_S = 0.1


def braking_series(speed_mps: float, decel_mps2: float, edge_s: float, end_s: float = 40.0) -> VehicleSeries:
    """Constant speed up to the edge, then constant deceleration to standstill."""
    t = np.round(np.arange(1, round(end_s / STEP_S) + 1) * STEP_S, 9)
    since = np.clip(t - edge_s, 0.0, speed_mps / decel_mps2)
    speed = speed_mps - decel_mps2 * since
    speed[since >= speed_mps / decel_mps2] = 0.0
    distance = speed_mps * np.minimum(t, edge_s) + speed_mps * since - decel_mps2 * since**2 / 2.0
    stopping = t > edge_s
    none = np.full(t.size, np.inf)
    return VehicleSeries(
        t_s=t,
        x_m=distance,
        y_m=np.zeros(t.size),
        speed_mps=speed,
        accel_mps2=np.where(stopping & (speed > 0.0), -decel_mps2, 0.0),
        distance_m=distance,
        safety_mode=np.where(stopping, 8, 1),
        longitudinal=np.where(stopping, Longitudinal.CONTROLLED_STOP, Longitudinal.CLOSED_LOOP).astype(
            np.int64
        ),
        lateral=np.where(stopping & (t < edge_s + 1.05), Lateral.FREE, Lateral.CLOSED_LOOP).astype(np.int64),
        leader_gap_m=none,
        leader_ttc_s=none,
        follower_gap_m=np.where(stopping, 7.0, 20.0),
        follower_ttc_s=np.where(stopping, 2.5, np.inf),
        demanded_decel_mps2=np.where(stopping, decel_mps2, np.nan),
    )


@given(speed=st.floats(5.0, 35.0), decel=st.floats(1.5, 9.0))
def test_an_ideal_stop_has_ratio_one(speed: float, decel: float) -> None:
    metrics = stop_metrics(braking_series(speed, decel, 5.0), 5.0, 40.0)
    assert metrics.ideal_stopping_distance_m == pytest.approx(speed**2 / (2.0 * decel))
    # Standstill is below 0.1 m/s, so the last centimetres may be missing.
    assert metrics.stopping_distance_m == pytest.approx(speed**2 / (2.0 * decel), abs=0.1**2 / decel + 0.01)
    assert metrics.time_to_standstill_s == pytest.approx(speed / decel, abs=STEP_S + 0.1 / decel)
    assert metrics.peak_decel_mps2 == pytest.approx(decel)


def test_the_window_decides_what_counts() -> None:
    series = braking_series(20.0, 2.5, 5.0)
    early = stop_metrics(series, 5.0, 8.0)
    assert early.time_to_standstill_s is None
    assert early.stopping_distance_m is None
    assert early.min_ttc_follower_s == 2.5
    assert early.min_gap_m == 7.0
    assert early.min_ttc_s is None
    assert early.unattended_steering_s == pytest.approx(1.0)
    outside = stop_metrics(series, 100.0, 110.0)
    assert outside.speed_at_event_mps is None


def test_a_standstill_that_does_not_last_is_none() -> None:
    series = braking_series(10.0, 2.5, 5.0)
    speed = series.speed_mps.copy()
    first = int(np.flatnonzero(speed == 0.0)[0])
    speed[first + 3 :] = 1.0
    assert stop_metrics(series._replace(speed_mps=speed), 5.0, 40.0).time_to_standstill_s is None


def test_a_car_that_never_has_to_stop_has_no_ideal() -> None:
    series = braking_series(10.0, 2.5, 5.0)
    free = series._replace(demanded_decel_mps2=np.full(series.t_s.size, np.nan))
    assert stop_metrics(free, 5.0, 40.0).ideal_stopping_distance_m is None


@given(
    gap=st.floats(0.0, 200.0),
    follower=st.floats(3.0, 40.0),
    leader=st.floats(0.0, 40.0),
    shift=st.floats(-5, 5),
)
def test_time_to_collision_follows_its_definition(
    gap: float, follower: float, leader: float, shift: float
) -> None:
    """Hayward 1972; unchanged when both cars move faster by the same amount."""
    columns = (np.array([gap]), np.array([follower]), np.array([leader]))
    value = float(time_to_collision_s(*columns)[0])
    if follower > leader:
        assert value == pytest.approx(gap / (follower - leader))
    else:
        assert math.isinf(value)
    if follower + shift >= 3.0 and follower != leader:
        shifted = time_to_collision_s(columns[0], columns[1] + shift, columns[2] + shift)[0]
        if abs(follower - leader) > 1e-6:
            assert float(shifted) == pytest.approx(value, rel=1e-6)


def test_time_to_collision_needs_a_leader_and_a_moving_follower() -> None:
    ttc = time_to_collision_s(
        np.array([np.inf, 5.0, -1.0]), np.array([20.0, 2.0, 20.0]), np.array([0.0, 0.0, 0.0])
    )
    assert ttc.tolist() == [math.inf, math.inf, 0.0]


@given(offset=st.integers(0, 9), speed=st.floats(5.0, 35.0), decel=st.floats(1.5, 9.0))
def test_an_edge_between_two_samples_is_the_same_stop(offset: int, speed: float, decel: float) -> None:
    """Speed, distance and time all count from the edge, wherever it lies in the step."""
    edge_s = 5.0 + offset / 100.0
    metrics = stop_metrics(braking_series(speed, decel, edge_s), edge_s, 40.0)
    ideal = speed**2 / (2.0 * decel)
    assert metrics.speed_at_event_mps == pytest.approx(speed)
    assert metrics.ideal_stopping_distance_m == pytest.approx(ideal)
    assert metrics.stopping_distance_m == pytest.approx(ideal, abs=0.1**2 / decel + 0.01)


@pytest.mark.parametrize(("held", "stands"), [(5, False), (6, True)])
def test_a_standstill_lasts_half_a_second(held: int, stands: bool) -> None:
    """Six samples span 0.5 s, five only 0.4 s."""
    series = braking_series(10.0, 2.5, 5.0)
    speed = series.speed_mps.copy()
    first = int(np.flatnonzero(np.abs(speed) < 0.1)[0])
    speed[first + held :] = 1.0
    metrics = stop_metrics(series._replace(speed_mps=speed), 5.0, 40.0)
    assert (metrics.time_to_standstill_s is not None) is stands
