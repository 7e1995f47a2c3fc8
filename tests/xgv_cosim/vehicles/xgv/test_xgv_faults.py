"""Errors: latch, the operator, what they take away; warnings that follow from modes and devices (XGV-38)."""

from __future__ import annotations

from itertools import product

import pytest

from jaus.vehicle_mode import SafetyMode
from tests.xgv_cosim.vehicles.xgv.stories import MOTION, TO_MOTION, Story
from xgv_cosim.actuation import LostFunction
from xgv_cosim.endpoint import EndpointChanged
from xgv_cosim.errors import ScenarioError
from xgv_cosim.vehicles.xgv.errors import COMMAND_TIMEOUTS, ERRORS, near_codes
from xgv_cosim.vehicles.xgv.faults import Faults, warnings_of
from xgv_cosim.vehicles.xgv.modes import DEVICE_WORDS, DOOR_OPEN, STEERING_AWAITS_USER, STEERING_UNINITIALISED
from xgv_cosim.vehicles.xgv.settings import ErrorLatch, XgvSettings

HARDWARE = sorted(set(ERRORS) - {9138, 9143, 9144, 9157, 9158, *range(9175, 9181)})


@pytest.mark.parametrize("code", HARDWARE)
def test_hardware_errors_stay_until_the_operator_clears_them_xgv_38(code: int) -> None:
    story = Story()
    story.endpoint.raise_error(code, 0.0)
    (latched,) = story.endpoint.clear_error(code, 1.0)
    assert isinstance(latched, EndpointChanged)
    assert (latched.kind, latched.before) == ("error_latched", str(code))
    assert story.endpoint.device_bits == 128
    assert story.endpoint.clear_error(code, 1.5) == []
    (cleared,) = story.endpoint.clear_errors(2.0)
    assert isinstance(cleared, EndpointChanged)
    assert (cleared.kind, cleared.before, cleared.after) == ("error", str(code), "")
    assert story.endpoint.device_bits == 0


def test_operator_cannot_clear_what_lasts_xgv_38() -> None:
    story = Story()
    story.endpoint.raise_error(9109, 0.0)
    (kept,) = story.endpoint.clear_errors(1.0)
    assert isinstance(kept, EndpointChanged)
    assert kept.kind == "error_latched"
    assert "its cause lasts" in kept.reasons[0]
    assert story.endpoint.device_bits == 128


def test_a_latched_error_that_comes_again_lasts_again_xgv_38() -> None:
    story = Story()
    story.endpoint.raise_error(9109, 0.0)
    story.endpoint.clear_error(9109, 1.0)
    assert story.endpoint.raise_error(9109, 2.0) == []
    story.endpoint.clear_errors(3.0)
    assert story.endpoint.device_bits == 128


@pytest.mark.parametrize("code", sorted(set(ERRORS) - set(HARDWARE) - COMMAND_TIMEOUTS))
def test_warnings_and_link_loss_go_with_their_cause_xgv_38(code: int) -> None:
    story = Story()
    story.endpoint.raise_error(code, 0.0)
    story.endpoint.clear_error(code, 1.0)
    assert story.endpoint.errors == {9178}


def test_operator_does_not_clear_a_command_timeout_xgv_43() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.endpoint.command_expired(0.4)
    assert story.endpoint.clear_errors(0.5) == []
    assert story.endpoint.errors == {9157}


def test_without_latch_errors_go_with_their_cause_xgv_38() -> None:
    story = Story(errors_latch=ErrorLatch.NONE)
    story.endpoint.raise_error(9109, 0.0)
    story.endpoint.clear_error(9109, 1.0)
    assert story.endpoint.device_bits == 0


EFFECTS = {
    9109: LostFunction.BRAKE,
    9110: LostFunction.BRAKE,
    9111: LostFunction.BRAKE,
    9103: LostFunction.STEERING,
    9104: LostFunction.STEERING,
    9106: LostFunction.THROTTLE,
    9107: LostFunction.SPEED_FEEDBACK,
    9108: LostFunction.SPEED_FEEDBACK,
}


@pytest.mark.parametrize("code", sorted(ERRORS))
def test_what_each_error_takes_away_xgv_38(code: int) -> None:
    story = Story()
    story.endpoint.raise_error(code, 0.0)
    assert story.endpoint.lost_functions == EFFECTS.get(code, 0)
    story.endpoint.raise_error(9109, 0.0)
    assert story.endpoint.lost_functions == EFFECTS.get(code, 0) | LostFunction.BRAKE
    story.endpoint.clear_error(9109, 1.0)  # latched: still without brake
    assert story.endpoint.lost_functions & LostFunction.BRAKE


def test_effects_are_a_setting_xgv_38() -> None:
    settings = XgvSettings(errors_effect_brake=(), errors_effect_throttle=(9113, 9107))
    assert settings.error_effects[9113] == LostFunction.THROTTLE
    assert settings.error_effects[9107] == LostFunction.THROTTLE | LostFunction.SPEED_FEEDBACK
    assert 9109 not in settings.error_effects
    with pytest.raises(ScenarioError, match="errors_effect_brake: got 1, expected codes that the XGV has"):
        XgvSettings(errors_effect_brake=(1,))


def test_near_codes_are_named_with_their_texts() -> None:
    assert (
        near_codes(9105) == "9103 steering communication, 9104 steering feedback, 9106 throttle communication"
    )


@pytest.mark.parametrize("mode", SafetyMode)
def test_warnings_follow_from_modes_and_devices_xgv_38(mode: SafetyMode) -> None:
    for devices, ready in product(range(DEVICE_WORDS), (False, True)):
        found = warnings_of(mode, devices, software_ready=ready)
        active = mode is not SafetyMode.INACTIVE
        steering = devices & (STEERING_UNINITIALISED | STEERING_AWAITS_USER)
        assert (9143 in found) is (mode is SafetyMode.ESTOP_DISABLE)
        assert (9144 in found) is (mode is SafetyMode.ESTOP_PAUSE)
        assert (9176 in found) is (active and bool(devices & DOOR_OPEN))
        assert (9177 in found) is (active and bool(steering))
        assert (9178 in found) is (active and not ready)
        assert 9175 not in found
        assert all(ERRORS[code].is_warning for code in found)
    drags = warnings_of(mode, 0, software_ready=True, parking_brake_drags=True)
    assert (9175 in drags) is (mode is not SafetyMode.INACTIVE)


def test_warnings_come_and_go_as_events_and_set_no_bit_xgv_38() -> None:
    story = Story()
    story.say(*TO_MOTION)
    assert story.endpoint.errors == frozenset()
    story.enter(SafetyMode.ESTOP_PAUSE)
    story.log += story.endpoint.devices_changed(DOOR_OPEN, 0.0)
    assert story.endpoint.errors == {9144, 9176}
    assert story.endpoint.device_bits == 0
    story.enter(SafetyMode.ESTOP_DISABLE)
    story.enter(SafetyMode.DRIVE_BY_WIRE)
    story.log += story.endpoint.devices_changed(0, 0.0)
    assert story.changes("warning") == [
        ("9178", ""),
        ("", "9144"),
        ("", "9176"),
        ("9144", ""),
        ("", "9143"),
        ("9143", ""),
        ("9176", ""),
    ]


def test_a_code_that_the_xgv_has_not_is_refused_with_its_neighbours_xgv_38() -> None:
    with pytest.raises(ScenarioError, match=r"error code: got 9112, expected one that the XGV has.*9111"):
        Story().endpoint.raise_error(9112, 0.0)


@pytest.mark.parametrize("function", [LostFunction.BRAKE, LostFunction.STEERING, LostFunction.SPEED_FEEDBACK])
def test_which_errors_take_a_function_away_is_told_in_order_xgv_38(function: LostFunction) -> None:
    taken = {
        LostFunction.BRAKE: (9109, 9110),
        LostFunction.STEERING: (9103,),
        LostFunction.SPEED_FEEDBACK: (),
    }
    faults = Faults(
        ErrorLatch.HARDWARE, {9103: LostFunction.STEERING} | dict.fromkeys((9109, 9110), LostFunction.BRAKE)
    )
    for code in (9110, 9156, 9103, 9109):  # 9156 takes nothing away
        faults.raise_code(code)
    assert faults.taking(function) == tuple(ERRORS[code].label for code in taken[function])
    assert faults.lost_functions == LostFunction.STEERING | LostFunction.BRAKE
