"""Component control and status beyond the plain sequences: authority, pre-emption, silence, failure."""

from __future__ import annotations

import math

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from tests.xgv_cosim.vehicles.xgv.stories import (
    ALICE,
    BOB,
    MOTION,
    MPD,
    PD,
    RESUME_MPD,
    RESUME_PD,
    TO_MOTION,
    TO_WRENCH,
    WRENCH,
    Story,
    refusal,
)
from xgv_cosim.commands import Signals, Turn
from xgv_cosim.endpoint import (
    CommandDropped,
    CommandStatus,
    EndpointChanged,
    MessageRefused,
    ReleaseControl,
    RequestControl,
    SetAuthority,
    StackMessage,
)
from xgv_cosim.vehicles.xgv.modes import ControlMode, ReadyMode, SafetyMode

MPD_ADDRESS = JausAddress(1, 1, MPD, 1)


def test_controller_sets_the_authority_with_which_it_is_held_xgv_20() -> None:
    story = Story()
    story.say(RequestControl(PD, 200))
    assert story.endpoint.component_authority == {PD: 200, MPD: 0}
    refusal(story.say(RequestControl(PD, 50), sender=BOB))
    assert story.say(SetAuthority(PD, 6)) == []
    assert story.endpoint.component_authority[PD] == 6
    story.say(RequestControl(PD, 50), sender=BOB)
    assert story.endpoint.component_controller[PD] == BOB


def test_only_the_controller_sets_the_authority_xgv_10_xgv_20() -> None:
    story = Story()
    assert "nobody controls the Primitive Driver, not 1.2.4.1" in refusal(story.say(SetAuthority(PD, 7)))
    story.say(RequestControl(PD, 6))
    assert "1.2.4.1 controls" in refusal(story.say(SetAuthority(PD, 255), sender=BOB))
    assert "0 to 255" in refusal(story.say(SetAuthority(PD, 256)))
    assert "takes no SetAuthority" in refusal(story.say(SetAuthority(ComponentId.NODE_MANAGER, 6)))
    assert story.endpoint.component_authority[PD] == 6


def test_mpd_hands_its_controllers_authority_on_to_the_pd_xgv_19() -> None:
    story = Story()
    story.say(*TO_MOTION)
    assert story.endpoint.component_authority == {PD: 6, MPD: 6}
    story.say(SetAuthority(MPD, 3))
    assert story.endpoint.component_authority == {PD: 3, MPD: 3}
    story.say(RequestControl(PD, 4), sender=BOB)
    assert story.endpoint.component_controller[PD] == BOB
    story.say(SetAuthority(MPD, 5))  # now it outranks Bob, and asks at once
    assert story.endpoint.component_controller[PD] == MPD_ADDRESS


@pytest.mark.parametrize(
    ("setup", "command", "component", "code"), [(TO_MOTION, MOTION, MPD, 9157), (TO_WRENCH, WRENCH, PD, 9158)]
)
def test_preemption_of_a_driven_car_is_a_software_pause_xgv_66(
    setup: tuple[StackMessage, ...], command: StackMessage, component: ComponentId, code: int
) -> None:
    """The control mode stays, so the pause comes of the command that has ended without a successor."""
    story = Story()
    story.say(*setup, command)
    before = story.modes
    events = story.say(RequestControl(component, 7), sender=BOB)
    assert story.modes == before
    assert [type(event) for event in events if isinstance(event, CommandDropped)] == [CommandDropped]
    assert story.endpoint.errors == {code}
    assert story.endpoint.device_bits == 128
    raised = [e for e in events if isinstance(e, EndpointChanged) and e.kind == "error"]
    assert "1.2.4.1 was preempted" in raised[0].reasons[1]
    story.say(command, sender=BOB)
    assert story.endpoint.errors == frozenset()


def test_preemption_of_an_idle_car_raises_nothing_xgv_66() -> None:
    story = Story()
    story.say(*TO_WRENCH)
    story.say(RequestControl(PD, 7), sender=BOB)
    assert story.endpoint.errors == frozenset()


def test_silent_controller_loses_control_with_that_reason_xgv_65() -> None:
    story = Story()
    story.say(*TO_MOTION)
    assert story.endpoint.next_deadline_s == 5.0
    story.wait_until(4.99)
    assert story.endpoint.control_mode is ControlMode.MOTION_PROFILES
    story.wait_until(5.0)
    assert story.modes == (ControlMode.SOFTWARE_PAUSE, ReadyMode.SOFTWARE_PAUSE)
    assert story.endpoint.component_controller == {PD: None, MPD: None}
    reason = "1.2.4.1 was silent for 5 s and lost control"
    assert story.endpoint.reasons(0)[0].endswith(reason)
    changed = [e for e in story.log if isinstance(e, EndpointChanged) and e.kind == "control_mode"]
    assert changed[-1].reasons[0].endswith(reason)
    assert story.endpoint.next_deadline_s == math.inf
    story.say(RequestControl(PD))
    story.say(ReleaseControl(PD))
    assert "silent" not in story.endpoint.reasons(0)[0]


@pytest.mark.parametrize(
    "message",
    [MOTION, WRENCH, RESUME_PD, RequestControl(MPD), Signals(turn=Turn.LEFT), ReleaseControl(PD)],
    ids=lambda message: type(message).__name__,
)
def test_any_traffic_of_the_controller_counts_refused_or_not_xgv_65(message: StackMessage) -> None:
    story = Story()
    story.say(*TO_MOTION)
    story.wait_until(4.0)
    story.say(message)
    story.wait_until(8.99)
    assert story.endpoint.component_controller[MPD] == ALICE
    story.wait_until(9.0)
    assert story.endpoint.component_controller[MPD] is None


def test_traffic_without_a_message_counts_xgv_65() -> None:
    story = Story()
    story.say(*TO_MOTION)
    story.endpoint.heard(ALICE, 4.0)
    assert story.endpoint.next_deadline_s == 9.0


def test_a_strangers_traffic_does_not_count_xgv_65() -> None:
    """A forged or foreign source neither keeps a controller in control nor commands or releases."""
    story = Story()
    story.say(*TO_MOTION)
    story.wait_until(4.0)
    story.say(MOTION, ReleaseControl(MPD), ReleaseControl(PD), sender=BOB)
    assert story.endpoint.component_controller[MPD] == ALICE
    story.wait_until(5.0)
    assert story.endpoint.component_controller[MPD] is None


def test_the_name_of_the_cars_own_component_opens_nothing_xgv_65() -> None:
    story = Story()
    story.say(*TO_MOTION)
    for message in (ReleaseControl(PD), CommandStatus(PD, StatusCommand.STANDBY), RequestControl(MPD, 255)):
        assert "is a component of this car" in refusal(story.say(message, sender=MPD_ADDRESS))
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)


def test_silence_of_one_controller_leaves_the_other_xgv_65() -> None:
    story = Story()
    story.say(RequestControl(PD, 9), sender=BOB)
    story.say(RequestControl(MPD, 6))
    for second in range(1, 5):
        story.wait_until(float(second))
        story.say(RequestControl(MPD, 6))
        assert story.endpoint.component_controller == {PD: BOB, MPD: ALICE}
    story.wait_until(5.0)  # the MPD asks each second
    assert story.endpoint.component_controller == {PD: MPD_ADDRESS, MPD: ALICE}


def test_one_who_lost_the_pd_to_the_mpd_is_no_longer_waited_for_xgv_65() -> None:
    story = Story()
    story.say(RequestControl(PD, 0), sender=BOB)
    story.now_s = 1.0
    story.say(RequestControl(MPD, 1))  # the MPD outranks Bob and takes the PD
    assert story.endpoint.next_deadline_s == 6.0
    story.wait_until(5.5)
    assert story.endpoint.control_mode is ControlMode.MOTION_PROFILES
    assert story.changes("component_control")[-1] == (
        "Primitive Driver: 1.3.4.1",
        "Primitive Driver: Motion Profile Driver",
    )


def test_timeout_0_never_takes_control_xgv_65() -> None:
    story = Story(controller_timeout_s=0.0)
    story.say(*TO_MOTION)
    assert story.endpoint.next_deadline_s == math.inf


def test_emergency_status_is_ready_mode_software_pause_and_nothing_more_xgv_63() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.say(CommandStatus(PD, StatusCommand.SET_EMERGENCY), sender=BOB)
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.SOFTWARE_PAUSE)
    assert story.endpoint.device_bits == 0
    assert story.endpoint.reasons(0) == ("ready mode software pause: Primitive Driver is in emergency",)
    # The MPD, not Alice, controls the PD: as its deputy she may resume it, not clear its emergency.
    assert "may not send clear emergency" in refusal(
        story.say(CommandStatus(PD, StatusCommand.CLEAR_EMERGENCY))
    )


def test_shut_down_component_comes_back_by_reset_only_xgv_25() -> None:
    story = Story()
    story.say(*TO_WRENCH, CommandStatus(PD, StatusCommand.SHUTDOWN))
    assert story.endpoint.ready_mode is ReadyMode.SOFTWARE_PAUSE
    assert "in shutdown" in refusal(story.say(RESUME_PD))
    story.say(CommandStatus(PD, StatusCommand.RESET))
    story.wait_until(1.0)
    assert story.endpoint.component_status[PD] is ComponentStatus.STANDBY
    story.say(RESUME_PD)
    assert story.endpoint.ready_mode is ReadyMode.READY


def test_repeated_reset_ends_when_the_first_would_have_xgv_20_xgv_25() -> None:
    story = Story(initialize_s=1.0)
    story.say(*TO_WRENCH)
    for tick in range(51):
        story.wait_until(tick * 0.02)
        if story.endpoint.component_status[PD] is ComponentStatus.STANDBY:
            break
        story.say(CommandStatus(PD, StatusCommand.RESET))
    assert story.now_s == pytest.approx(1.0)


def test_failed_controllers_put_the_mpd_into_failure_until_reset_xgv_21_xgv_23() -> None:
    story = Story()
    story.say(*TO_MOTION)
    story.endpoint.raise_error(9156, 0.0)
    assert story.endpoint.component_status == {PD: ComponentStatus.READY, MPD: ComponentStatus.FAILURE}
    assert story.endpoint.ready_mode is ReadyMode.SOFTWARE_PAUSE
    assert "in failure" in refusal(story.say(RESUME_MPD))
    story.endpoint.clear_error(9156, 0.0)
    story.endpoint.clear_errors(0.0)
    assert story.endpoint.component_status[MPD] is ComponentStatus.FAILURE
    story.say(CommandStatus(MPD, StatusCommand.RESET))
    story.wait_until(1.0)
    story.say(RESUME_MPD)
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)


def test_an_inactive_system_takes_nothing_xgv_32() -> None:
    story = Story()
    story.enter(SafetyMode.INACTIVE)
    for message in (RequestControl(PD), MOTION, Signals(turn=Turn.LEFT)):
        events = story.say(message)
        assert isinstance(events[0], MessageRefused)
        assert "not active" in refusal(events)
    assert story.endpoint.component_controller == {PD: None, MPD: None}
