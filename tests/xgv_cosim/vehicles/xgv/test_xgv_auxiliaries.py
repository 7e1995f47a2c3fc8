"""Set Discrete Devices and Set Signals: every mode and sender, then short stories."""

from __future__ import annotations

from itertools import product

import pytest

from jaus.component import Standing
from jaus.vehicle_mode import ControlMode, SafetyMode
from tests.xgv_cosim.vehicles.xgv.stories import ALICE, BOB, TO_MOTION, TO_WRENCH, Story, refusal
from xgv_cosim.actuation import Gear
from xgv_cosim.commands import DiscreteDevices, Headlights, Signals, Turn
from xgv_cosim.endpoint import DevicesCommanded, EndpointChanged, MessageRefused
from xgv_cosim.vehicles.xgv.auxiliaries import (
    engine_refusal,
    gear_refusal,
    parking_brake_refusal,
    signals_refusal,
)

SHIFT = DiscreteDevices(gear=Gear.REVERSE)
ENGINE_OFF = DiscreteDevices(engine_on=False)
ENGINE_ON = DiscreteDevices(engine_on=True)
PAUSES = {SafetyMode.SOFTWARE_PAUSE, SafetyMode.ESTOP_PAUSE}
COMPUTER_HAS_DEVICES = PAUSES | {SafetyMode.DRIVE_BY_WIRE}
IN_CONTROL = {Standing.CONTROLLER, Standing.DEPUTY}


@pytest.mark.parametrize(
    ("safety", "control", "standing", "manual"),
    list(product(SafetyMode, ControlMode, Standing, (False, True))),
)
def test_gear_shifts_in_drive_by_wire_and_wrench_efforts_only_xgv_09_xgv_16_xgv_34_xgv_41(
    safety: SafetyMode, control: ControlMode, standing: Standing, manual: bool
) -> None:
    permitted = (
        safety is SafetyMode.DRIVE_BY_WIRE
        and control is ControlMode.WRENCH_EFFORTS
        and standing in IN_CONTROL
        and not manual
    )
    assert (gear_refusal(safety, control, standing, manual_speed=manual) == "") is permitted


@pytest.mark.parametrize(
    ("safety", "standing", "sets", "manual", "needed"),
    list(product(SafetyMode, Standing, (False, True), (False, True), (False, True))),
)
def test_the_parking_brake_is_set_in_every_pause_and_released_in_drive_by_wire_only_xgv_09_xgv_34(
    safety: SafetyMode, standing: Standing, sets: bool, manual: bool, needed: bool
) -> None:
    """XGV-16, XGV-41: by a controller, in a pause by anyone; never where a human has the brakes."""
    by_controller = standing in IN_CONTROL
    permitted = not manual and (
        (safety is SafetyMode.DRIVE_BY_WIRE and by_controller)
        or (safety in PAUSES and sets and (by_controller or not needed))
    )
    why = parking_brake_refusal(safety, standing, sets=sets, manual_speed=manual, needs_control=needed)
    assert (why == "") is permitted


@pytest.mark.parametrize(("safety", "standing", "needed"), list(product(SafetyMode, Standing, (False, True))))
def test_engine_switches_in_every_pause_xgv_34(safety: SafetyMode, standing: Standing, needed: bool) -> None:
    permitted = safety in COMPUTER_HAS_DEVICES and (
        standing in IN_CONTROL or (safety in PAUSES and not needed)
    )
    assert (engine_refusal(safety, standing, needs_control=needed) == "") is permitted


@pytest.mark.parametrize("safety", SafetyMode)
def test_signals_work_unless_the_human_has_all_systems_xgv_10_xgv_13_xgv_31(safety: SafetyMode) -> None:
    assert (signals_refusal(safety) == "") is (safety in COMPUTER_HAS_DEVICES)


def test_shift_in_wrench_efforts_xgv_09() -> None:
    story = Story()
    story.say(*TO_WRENCH)
    story.enter(SafetyMode.DRIVE_BY_WIRE)
    assert story.say(SHIFT) == [DevicesCommanded(gear=Gear.REVERSE)]
    assert "only the controller" in refusal(story.say(SHIFT, sender=BOB))


def test_shift_is_refused_in_a_pause_with_a_reason_xgv_34() -> None:
    story = Story()
    story.say(*TO_WRENCH)
    for mode in sorted(PAUSES):
        story.enter(mode)
        assert "gear: a gear shift is motion-related" in refusal(story.say(SHIFT))


def test_pd_takes_the_engine_from_the_controller_of_the_mpd_cross_profile() -> None:
    story = Story(nonmotion_needs_control=True)
    story.say(*TO_MOTION)
    story.enter(SafetyMode.DRIVE_BY_WIRE)
    assert story.say(ENGINE_OFF) == [DevicesCommanded(engine_on=False)]
    assert "engine: only a controller" in refusal(story.say(ENGINE_OFF, sender=BOB))
    assert "the XGV's own controllers choose the gear" in refusal(story.say(SHIFT))


def test_engine_restarts_in_every_pause_without_control_xgv_34() -> None:
    """A disabled and released car, which nobody controls, can be started again."""
    story = Story()
    story.enter(SafetyMode.ESTOP_DISABLE)
    assert "in estop disable the computer has none" in refusal(story.say(ENGINE_ON))
    for mode in sorted(PAUSES):
        story.enter(mode)
        assert story.say(ENGINE_ON, sender=BOB) == [DevicesCommanded(engine_on=True)]


def test_engine_may_need_control_xgv_34() -> None:
    story = Story(nonmotion_needs_control=True)
    story.enter(SafetyMode.SOFTWARE_PAUSE)
    assert "xgv.nonmotion.needs_control" in refusal(story.say(ENGINE_ON))
    story.say(*TO_WRENCH)
    assert story.say(ENGINE_ON) == [DevicesCommanded(engine_on=True)]


def test_what_is_permitted_of_a_message_is_done_and_the_rest_refused_xgv_34() -> None:
    story = Story()
    message = DiscreteDevices(gear=Gear.LOW, engine_on=True)
    done, refused = story.say(message)
    assert done == DevicesCommanded(engine_on=True)
    assert isinstance(refused, MessageRefused)
    assert refused.reason.startswith("gear: ")
    assert "engine" not in refused.reason
    assert story.say(DiscreteDevices()) == []


def test_manual_speed_takes_gear_and_parking_brake_from_the_computer_xgv_41() -> None:
    """The endpoint learns the partial mode; the engine stays the computer's (XGV-39)."""
    story = Story()
    story.say(*TO_WRENCH)
    story.enter(SafetyMode.DRIVE_BY_WIRE)
    message = DiscreteDevices(gear=Gear.REVERSE, engine_on=True, parking_brake=True)
    for bits in (2, 3):
        story.endpoint.partial_mode_entered(bits)
        done, refused = story.say(message)
        assert done == DevicesCommanded(engine_on=True)
        assert isinstance(refused, MessageRefused)
        assert refused.reason == (
            "gear: in manual speed the gear belongs to the human (XGV-41); "
            "parking brake: in manual speed the brakes belong to the human (XGV-41)"
        )
    for bits in (0, 1):
        story.endpoint.partial_mode_entered(bits)
        assert story.say(message) == [DevicesCommanded(Gear.REVERSE, engine_on=True, parking_brake=True)]


def test_disable_switches_the_engine_off_if_configured_xgv_31() -> None:
    story = Story(disable_engine_off=True)
    stopped = DevicesCommanded(engine_on=False, reason="estop disable (xgv.disable.engine_off)")
    assert stopped in story.enter(SafetyMode.ESTOP_DISABLE)
    assert not any(isinstance(e, DevicesCommanded) for e in Story().enter(SafetyMode.ESTOP_DISABLE))


def test_anyone_sets_signals_xgv_10_xgv_11() -> None:
    story = Story()
    story.say(*TO_MOTION)
    story.enter(SafetyMode.DRIVE_BY_WIRE)
    message = Signals(turn=Turn.LEFT, headlights=Headlights.ON)
    changed = EndpointChanged("signals", "off", "turn left, headlights on", ("set by 1.3.4.1",))
    assert story.say(message, sender=BOB) == [changed]
    assert story.say(message, sender=ALICE) == []
    story.say(Signals(horn=True, turn=Turn.OFF))
    assert story.endpoint.signals == Signals(turn=Turn.OFF, horn=True, headlights=Headlights.ON)


@pytest.mark.parametrize("mode", sorted(set(SafetyMode) - COMPUTER_HAS_DEVICES))
def test_signals_go_off_and_are_refused_where_all_is_manual_xgv_13_xgv_31(mode: SafetyMode) -> None:
    story = Story()
    story.say(Signals(turn=Turn.HAZARD))
    off = [e for e in story.enter(mode) if isinstance(e, EndpointChanged) and e.kind == "signals"]
    assert [(e.before, e.after) for e in off] == [("turn hazard", "off")]
    assert refusal(story.say(Signals(turn=Turn.LEFT)))
    assert story.endpoint.signals.turn is Turn.OFF
