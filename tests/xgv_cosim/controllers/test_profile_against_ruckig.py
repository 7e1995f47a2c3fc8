"""The closed form is the same motion as ruckig's velocity interface; ruckig itself is the oracle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruckig import ControlInterface, InputParameter, Ruckig, Synchronization, Trajectory

from xgv_cosim.controllers.profile import advance_profile, advance_speed_profile

speeds = st.floats(-40.0, 40.0)
limits = st.floats(0.05, 12.0)
jerks = st.one_of(st.just(math.inf), st.floats(0.1, 1e3))


def _ruckig_trajectory(rows: np.ndarray) -> Trajectory:
    """Return the trajectory of rows (speed, accel, target, accel_limit, decel_limit, jerk)."""
    given = InputParameter(len(rows))
    given.control_interface = ControlInterface.Velocity
    given.synchronization = Synchronization.No
    given.current_velocity, given.current_acceleration, given.target_velocity = rows[:, :3].T.tolist()
    given.max_acceleration, given.min_acceleration = rows[:, 3].tolist(), (-rows[:, 4]).tolist()
    given.max_jerk = rows[:, 5].tolist()
    trajectory = Trajectory(len(rows))
    Ruckig(len(rows)).calculate(given, trajectory)
    return trajectory


def _random_rows(rng: np.random.Generator, count: int) -> np.ndarray:
    return np.column_stack(
        [
            rng.uniform(-30.0, 30.0, count),
            rng.uniform(-8.0, 8.0, count),  # often beyond the limits: the pre-phase
            rng.uniform(-30.0, 30.0, count),
            rng.uniform(0.2, 6.0, count),
            rng.uniform(0.2, 9.0, count),
            np.where(rng.random(count) < 0.15, np.inf, 10.0 ** rng.uniform(-0.5, 2.0, count)),
        ]
    )


def test_equals_ruckig_over_thousands_of_random_profiles() -> None:
    rows = _random_rows(np.random.default_rng(1), 3000)
    trajectory = _ruckig_trajectory(rows)
    for time_s in (0.01, 0.1, 0.37, 1.0, 2.5, 7.0, 20.0, 60.0, 200.0):
        _, speeds, accels = trajectory.at_time(time_s)
        mine = np.array([advance_profile(*row, time_s) for row in rows.tolist()])
        np.testing.assert_allclose(mine[:, 0], speeds, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(mine[:, 1], accels, rtol=0.0, atol=2e-9)


def test_following_tick_by_tick_equals_ruckigs_one_trajectory() -> None:
    rows = _random_rows(np.random.default_rng(2), 200)
    trajectory = _ruckig_trajectory(rows)
    state = rows.copy()
    for tick in range(1, 1001):
        for row in state:
            row[0], row[1] = advance_profile(*row.tolist(), 0.01)
        if tick % 50 == 0:
            _, speeds, accels = trajectory.at_time(tick * 0.01)
            np.testing.assert_allclose(state[:, 0], speeds, rtol=0.0, atol=1e-9)
            # With infinite jerk the acceleration jumps at the end, on this tick or the next.
            jumps = np.isinf(rows[:, 5])
            np.testing.assert_allclose(state[~jumps, 1], np.array(accels)[~jumps], rtol=0.0, atol=1e-7)


@given(speeds, st.floats(-12.0, 12.0), speeds, limits, limits, jerks)
def test_ends_at_the_target_at_rest(
    speed: float, accel: float, target: float, rise: float, fall: float, jerk: float
) -> None:
    assert advance_profile(speed, accel, target, rise, fall, jerk, 1e6) == (target, 0.0)


@given(speeds, speeds, limits, limits, jerks, st.floats(0.0, 30.0))
def test_never_leaves_its_limits_or_overshoots_from_rest(
    speed: float, target: float, rise: float, fall: float, jerk: float, time_s: float
) -> None:
    after, accel = advance_profile(speed, 0.0, target, rise, fall, jerk, time_s)
    assert -fall - 1e-9 <= accel <= rise + 1e-9
    assert min(speed, target) - 1e-9 <= after <= max(speed, target) + 1e-9


def test_the_speed_stops_at_zero_where_ruckig_would_pass_through() -> None:
    row = (0.3, -3.0, 0.0, 2.0, 3.0, 4.0)
    dip = min(advance_profile(*row, t)[0] for t in np.arange(0.0, 3.0, 0.01).tolist())
    assert dip == pytest.approx(-0.825, abs=0.001)  # 0.3 - 3² / (2 * 4)
    for t in np.arange(0.0, 3.0, 0.01).tolist():
        speed, accel = advance_speed_profile(*row, t)
        assert speed >= 0.0
        if speed == 0.0:
            assert accel == 0.0


@given(st.floats(0.0, 3.0), st.floats(-8.0, 0.0), st.floats(0.0, 10.0), st.floats(0.1, 20.0))
def test_a_forward_target_is_reached_without_going_backwards_whatever_the_tick(
    speed: float, accel: float, target: float, jerk: float
) -> None:
    limits = (2.0, 3.0, jerk)
    once = advance_speed_profile(speed, accel, target, *limits, 0.4)
    state = (speed, accel)
    for _ in range(40):
        state = advance_speed_profile(*state, target, *limits, 0.01)
        assert state[0] >= -1e-12
    assert state == pytest.approx(once, abs=1e-6)


def test_a_target_of_the_other_sign_takes_the_speed_through_zero() -> None:
    speed, _ = advance_speed_profile(1.0, 0.0, -2.0, 2.0, 3.0, 4.0, 10.0)
    assert speed == -2.0
