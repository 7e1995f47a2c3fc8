"""Commands through gears and modes: reverse through standstill, the gear kept, entries without a bump."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.xgv_cosim.simulation.mode_drive import ModeDrive
from xgv_cosim.actuation import Gear, Lateral, Longitudinal

STOP = (Longitudinal.CONTROLLED_STOP, Lateral.CLOSED_LOOP)
CLOSED = (Longitudinal.CLOSED_LOOP, Lateral.CLOSED_LOOP)
OPEN = (Longitudinal.OPEN_LOOP, Lateral.OPEN_LOOP)

MAX_PEDAL_BUMP = 0.05
"""Share of effort by which a pedal may move in the first tick after an entry to closed loop."""
MAX_RELEASE_AT_STANDSTILL = 0.08
"""The same of a brake that goes back to what holds a car that stands, or that is at the end of its stop."""
MAX_ACCEL_BUMP_MPS2 = 0.35
MAX_STEER_BUMP_RAD = 0.001


@pytest.mark.parametrize("ticks", [1, 10])
def test_a_change_of_sign_goes_through_standstill_brake_and_shift_delay_xgv_70(ticks: int) -> None:
    drive = ModeDrive(4.0).command(4.0).for_s(1.0, ticks)
    drive.command(-3.0, curvature_per_m=0.05).for_s(10.0, ticks)
    speed, gear, wanted = drive.column("speed_mps"), drive.column("gear"), drive.wanted("speed_mps")
    tick_s = 0.01 * ticks
    stopped = int(np.argmax(speed == 0.0))
    started = stopped + int(np.argmax(speed[stopped:] < 0.0))
    assert 1.5 - 0.2 <= (started - stopped) * tick_s <= 1.5 + 0.4
    assert (drive.column("brake")[stopped + 20 // ticks : started - 1] > 0.1).all()
    in_drive = gear == Gear.DRIVE
    assert (wanted[in_drive] >= -1e-9).all()  # the reference never crosses zero without the gear
    assert (speed[in_drive] >= 0.0).all()
    assert (gear[started:] == Gear.REVERSE).all()
    assert speed[-1] == pytest.approx(-3.0, abs=0.2)
    assert drive.column("heading_rad")[-1] < drive.column("heading_rad")[started]  # wheel left, backwards
    drive.command(2.0).for_s(8.0, ticks)
    assert drive.fleet.motion.gear[0] == Gear.DRIVE
    assert drive.column("speed_mps")[-1] == pytest.approx(2.0, abs=0.2)


def test_in_reverse_a_pause_stops_and_the_gear_stays_xgv_36() -> None:
    drive = ModeDrive().command(-4.0).for_s(7.0)
    assert drive.fleet.motion.speed_mps[0] == pytest.approx(-4.0, abs=0.2)
    drive.enter(*STOP).for_s(4.0)
    accel = drive.column("accel_mps2")
    constant = slice(31, int(np.argmax(drive.column("speed_mps") >= -0.5)))
    np.testing.assert_allclose(accel[constant], 2.5, rtol=0.05)
    assert (drive.column("gear") == Gear.REVERSE).all()
    assert drive.column("speed_mps").max() == 0.0
    drive.enter(*CLOSED).command(-2.0).for_s(3.0)
    assert drive.column("speed_mps")[-1] == pytest.approx(-2.0, abs=0.2)
    assert (drive.column("gear") == Gear.REVERSE).all()  # no shift on the way back to work


def test_a_pause_stops_a_change_of_gear_under_way_xgv_36() -> None:
    drive = ModeDrive().command(-3.0).for_s(1.2)
    assert drive.fleet.motion.shift_s[0] > 0.5
    drive.enter(*STOP).for_s(3.0)
    assert drive.fleet.motion.gear[0] == Gear.DRIVE


def test_standstill_keeps_the_gear_xgv_70() -> None:
    drive = ModeDrive().command(-3.0).for_s(5.0)
    drive.command(0.0).for_s(6.0)
    assert drive.fleet.motion.gear[0] == Gear.REVERSE
    assert drive.fleet.motion.speed_mps[0] == 0.0


def test_low_gear_is_left_for_drive_before_closed_loop_starts() -> None:
    drive = ModeDrive().enter(*OPEN).wrench(brake=0.5)
    drive.fleet.gear_wanted[0] = Gear.LOW
    drive.for_s(2.0)
    assert drive.fleet.motion.gear[0] == Gear.LOW
    drive.enter(*CLOSED).command(5.0).for_s(1.0)
    assert (drive.column("speed_mps") == 0.0).all()
    drive.for_s(5.0)
    assert drive.fleet.motion.gear[0] == Gear.DRIVE
    assert drive.fleet.motion.speed_mps[0] == pytest.approx(5.0, abs=0.2)


def test_wrench_efforts_have_the_gear_that_closed_loop_left_in_and_then_their_own_xgv_04() -> None:
    drive = ModeDrive().command(-3.0).for_s(5.0).command(0.0).for_s(3.0)
    drive.enter(*OPEN).wrench(brake=0.3).for_s(3.0)
    assert drive.fleet.motion.gear[0] == Gear.REVERSE
    drive.fleet.gear_wanted[0] = Gear.DRIVE
    drive.for_s(3.0)
    assert drive.fleet.motion.gear[0] == Gear.DRIVE
    drive.wrench(throttle=0.3).for_s(2.0)
    assert drive.fleet.motion.speed_mps[0] > 1.0


def test_a_driver_who_turns_back_hands_over_the_gear_he_drove_in() -> None:
    drive = ModeDrive().command(-3.0).for_s(5.0)
    drive.enter(Longitudinal.DRIVER, Lateral.DRIVER)
    drive.fleet.motion.speed_mps[0] = 5.0  # the world's driver drives on forwards
    drive.fleet.motion.accel_mps2[0] = 0.0
    drive.for_s(0.2)
    drive.enter(*CLOSED).command(5.0).for_s(1.0)
    assert (drive.column("gear") == Gear.DRIVE).all()
    assert drive.column("speed_mps").min() > 4.8


@pytest.mark.parametrize("share", [1.0, 0.4])
def test_without_the_engine_the_brake_has_its_share_and_nothing_drives_xgv_31(share: float) -> None:
    """``xgv.engine.brake_assist_lost``; a driver who takes the car starts the engine again."""
    drive = ModeDrive(10.0).command(10.0).for_s(0.5)
    drive.fleet.brake_share_without_engine[0] = share
    drive.fleet.engine_on[0] = False
    drive.enter(Longitudinal.FULL_BRAKE, Lateral.FREE).for_s(1.0)
    decel = -drive.column("accel_mps2")[-1]
    assert decel == pytest.approx(min(share * 8.4, 0.85 * 9.81) + 0.1, abs=0.1)
    drive.for_s(4.0).enter(*CLOSED).command(3.0).for_s(3.0)
    assert drive.fleet.motion.speed_mps[0] == 0.0
    drive.enter(Longitudinal.DRIVER, Lateral.DRIVER)
    assert drive.fleet.engine_on[0]


@given(
    before=st.sampled_from(Longitudinal),
    sideways=st.sampled_from(Lateral),
    begin_mps=st.floats(3.0, 30.0),
    pedal=st.floats(-0.6, 0.6),
    steering=st.floats(-0.05, 0.05),
    target_mps=st.floats(0.0, 30.0),
    grade=st.sampled_from([0.0, 0.05, -0.05]),
    lasted_s=st.sampled_from([0.05, 0.2, 0.5, 1.0, 2.0]),
)
@settings(max_examples=60, deadline=None)
@example(Longitudinal.MAXIMUM_BRAKING, Lateral.CLOSED_LOOP, 3.0, 0.0, 0.0, 0.0, -0.05, 0.5)
@example(Longitudinal.FULL_BRAKE, Lateral.CLOSED_LOOP, 4.0, 0.0, 0.0, 0.0, 0.05, 0.5)
def test_no_entry_to_closed_loop_moves_pedals_or_wheel_by_a_bump_xgv_70(
    before: Longitudinal,
    sideways: Lateral,
    begin_mps: float,
    pedal: float,
    steering: float,
    target_mps: float,
    grade: float,
    lasted_s: float,
) -> None:
    """From every pair of modes, whatever their duration, pedals, slope and the command to come."""
    drive = ModeDrive(begin_mps, grade=grade).command(begin_mps).for_s(0.5, 5)
    drive.enter(before, sideways)
    if before is Longitudinal.OPEN_LOOP:
        drive.wrench(max(0.0, pedal), max(0.0, -pedal), steering).for_s(lasted_s, 5)
    else:
        drive.for_s(lasted_s, 5)
    drive.enter(*CLOSED).command(target_mps, curvature_per_m=0.0).for_s(0.01)
    stands = drive.wanted("speed_mps")[-1] < 0.1  # or the last of a stop is all that is left of it
    assert np.ptp(drive.column("throttle")) <= MAX_PEDAL_BUMP
    assert np.ptp(drive.column("brake")) <= (MAX_RELEASE_AT_STANDSTILL if stands else MAX_PEDAL_BUMP)
    assert np.ptp(drive.column("steer_rad")) <= MAX_STEER_BUMP_RAD
    assert stands or np.ptp(drive.column("accel_mps2")) <= MAX_ACCEL_BUMP_MPS2
