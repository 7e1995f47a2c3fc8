"""The mode rules called with their defaults, and the bits that no rule reads."""

from __future__ import annotations

from jaus.address import JausAddress
from jaus.vehicle_mode import ControlMode, SafetyMode
from xgv_cosim.actuation import Lateral
from xgv_cosim.commands import CommandKind
from xgv_cosim.vehicles.xgv import modes
from xgv_cosim.vehicles.xgv.modes import resolve_control_mode, resolve_lateral

ALICE, MPD = JausAddress(1, 2, 4, 1), JausAddress(1, 1, 10, 1)


def test_the_device_word_is_that_of_the_note_xgv_52() -> None:
    """XGV-52: every bit in its place; a good link (2 in bits 3 and 4) is no device."""
    assert modes.LINK_GOOD == 0b1_0000
    devices = (
        modes.MANUAL_OVERRIDE_ENGAGED,
        modes.SAFESTOP_PAUSE,
        modes.SAFESTOP_STOP,
        modes.ESTOP_BUTTON,
        modes.DOOR_OPEN,
        modes.ERRORS_DETECTED,
        modes.EMERGENCY_OVERRIDE_ENGAGED,
        modes.STEERING_UNINITIALISED,
        modes.STEERING_AWAITS_USER,
    )
    assert devices == tuple(1 << bit for bit in (0, 1, 2, 5, 6, 7, 8, 9, 10))


def test_one_client_in_control_of_both_is_a_pause_unless_said_otherwise_xgv_18() -> None:
    assert resolve_control_mode(ALICE, ALICE, mpd_address=MPD) is ControlMode.SOFTWARE_PAUSE


def test_a_pause_without_command_keeps_the_curvature_of_an_initialised_wheel_xgv_35() -> None:
    mode, control = SafetyMode.SOFTWARE_PAUSE, ControlMode.MOTION_PROFILES
    assert resolve_lateral(mode, control, CommandKind.NONE, 0) is Lateral.CLOSED_LOOP
    assert resolve_lateral(mode, control, CommandKind.MOTION_PROFILE, 0) is Lateral.CLOSED_LOOP
