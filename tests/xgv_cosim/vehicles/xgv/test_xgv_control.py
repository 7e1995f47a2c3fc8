"""Component control and status beyond the plain sequences: authority, pre-emption, silence, failure."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
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
from xgv_cosim.commands import MotionProfile, Signals, Turn
from xgv_cosim.endpoint import (
    CommandAccepted,
    CommandDropped,
    CommandStatus,
    ControlPreempted,
    EndpointChanged,
    MessageRefused,
    ReleaseControl,
    RequestControl,
    SetAuthority,
    StackMessage,
)

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
    ("setup", "command", "component"), [(TO_MOTION, MOTION, MPD), (TO_WRENCH, WRENCH, PD)]
)
def test_preemption_of_a_driven_car_is_a_software_pause_for_its_own_reason_xgv_66(
    setup: tuple[StackMessage, ...], command: StackMessage, component: ComponentId
) -> None:
    """The control mode stays; no time-out error: nothing has timed out (XGV-43)."""
    story = Story()
    story.say(*setup, command)
    control, _ = story.modes
    events = story.say(RequestControl(component, 7), sender=BOB)
    assert story.modes == (control, ReadyMode.SOFTWARE_PAUSE)
    assert [type(event) for event in events if isinstance(event, CommandDropped)] == [CommandDropped]
    assert story.endpoint.command_expired(5.0) == []
    assert story.endpoint.device_bits == 0
    assert story.endpoint.errors == {9178}
    assert story.endpoint.reasons(0)[0].endswith("is in standby, 1.2.4.1 was preempted")
    refusal(story.say(command))
    assert story.modes == (control, ReadyMode.SOFTWARE_PAUSE)
    story.say(command, sender=BOB)
    assert story.modes == (control, ReadyMode.READY)
    assert "first command of 1.3.4.1" in str(story.log[-3:])
    assert story.endpoint.errors == frozenset()


def test_whoever_preempts_may_also_resume_the_car_before_he_commands_it_xgv_66() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.say(RequestControl(MPD, 7), RESUME_PD, RESUME_MPD, sender=BOB)
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)
    assert "preempted" not in story.endpoint.reasons(0)[0]


@pytest.mark.parametrize(
    "by_bob",
    [StatusCommand.STANDBY, StatusCommand.RESET, StatusCommand.SET_EMERGENCY, StatusCommand.SHUTDOWN],
)
def test_a_status_of_the_new_controllers_own_outlasts_his_first_command_xgv_25_xgv_66(
    by_bob: StatusCommand,
) -> None:
    """Only what the pre-emption has paused goes on by itself, not what he has paused himself."""
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.say(RequestControl(MPD, 7), CommandStatus(MPD, by_bob), MOTION, sender=BOB)
    assert story.endpoint.ready_mode is ReadyMode.SOFTWARE_PAUSE
    assert story.endpoint.component_status[PD] is ComponentStatus.READY


def test_a_preemption_that_must_be_resumed_is_not_ended_by_a_command_xgv_37_xgv_66() -> None:
    """``xgv.rearm.preemption`` alone decides: the simulation then sets the drivers to standby for it."""
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.say(RequestControl(MPD, 7), sender=BOB)
    assert story.endpoint.stand_by("set to standby by the pre-emption", 0.0) == []
    story.say(MOTION, sender=BOB)
    assert story.endpoint.ready_mode is ReadyMode.SOFTWARE_PAUSE
    assert "1.2.4.1 was preempted" in story.endpoint.reasons(0)[0]
    story.say(RESUME_PD, RESUME_MPD, sender=BOB)
    assert story.endpoint.ready_mode is ReadyMode.READY


def test_a_preemption_that_changes_the_control_mode_pauses_too_xgv_66() -> None:
    """Alice drives by wrench efforts; Bob takes the MPD, and that the PD from her: both are ready."""
    story = Story()
    story.say(*TO_MOTION)
    story.say(*TO_WRENCH, WRENCH)
    story.say(RequestControl(MPD, 7), sender=BOB)
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.SOFTWARE_PAUSE)
    assert "1.2.4.1 was preempted" in story.endpoint.reasons(0)[0]
    story.say(MOTION, sender=BOB)
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)


def test_where_control_mode_pauses_by_a_preemption_the_status_stays_xgv_24_xgv_66() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.say(RequestControl(PD, 7), sender=BOB)
    assert story.endpoint.control_mode is ControlMode.SOFTWARE_PAUSE
    assert set(story.endpoint.component_status.values()) == {ComponentStatus.READY}
    assert 9157 not in story.endpoint.errors


def test_a_client_that_changes_from_wrench_to_motion_preempts_nobody_xgv_66() -> None:
    """Its own MPD takes the PD from it, with its higher authority."""
    story = Story()
    story.say(RequestControl(PD, 6), RESUME_PD, WRENCH)
    events = story.say(RequestControl(MPD, 7))
    assert story.endpoint.component_controller[PD] == MPD_ADDRESS
    assert not [event for event in events if isinstance(event, ControlPreempted)]
    assert story.endpoint.component_status[PD] is ComponentStatus.READY


def test_a_timeout_before_the_preemption_stays_until_the_first_command_xgv_43_xgv_66() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.endpoint.command_expired(0.4)
    story.say(RequestControl(MPD, 7), sender=BOB)
    assert story.endpoint.errors == {9157}
    assert story.endpoint.ready_mode is ReadyMode.READY
    story.say(MOTION, sender=BOB)
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


def test_who_drives_through_the_mpd_clears_a_strangers_emergency_on_the_pd_xgv_63() -> None:
    """The MPD controls the PD, and clears nothing itself; the stranger cannot clear it either."""
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.say(CommandStatus(PD, StatusCommand.SET_EMERGENCY), sender=BOB)
    clear = CommandStatus(PD, StatusCommand.CLEAR_EMERGENCY)
    assert "1.3.4.1 may not send clear emergency" in refusal(story.say(clear, sender=BOB))
    story.say(clear)
    assert story.endpoint.component_status[PD] is ComponentStatus.STANDBY
    story.say(RESUME_PD)
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)


@pytest.mark.parametrize("command", [StatusCommand.RESET, StatusCommand.SHUTDOWN])
def test_reset_and_shutdown_of_the_pd_are_its_controllers_own_xgv_10(command: StatusCommand) -> None:
    """While the MPD holds the PD nobody outside resets it or shuts it down; the refusal names the way."""
    story = Story()
    story.say(*TO_MOTION)
    reason = refusal(story.say(CommandStatus(PD, command)))
    assert reason.endswith("controls the Primitive Driver; release the Motion Profile Driver first")
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)


def released(story: Story) -> None:
    story.say(ReleaseControl(MPD), ReleaseControl(PD))


def silent(story: Story) -> None:
    story.wait_until(5.0)


@pytest.mark.parametrize("setup", [TO_MOTION, TO_WRENCH], ids=["motion", "wrench"])
@pytest.mark.parametrize("ending", [released, silent])
def test_who_gives_up_control_or_loses_it_leaves_no_timeout_xgv_43_xgv_65_xgv_70(
    setup: tuple[StackMessage, ...], ending: Callable[[Story], None]
) -> None:
    """The command is dropped with the control mode: none is left that could expire."""
    story = Story(wrench_timeout_s=60.0)
    story.say(*setup, MotionProfile(10.0, 2.0, 0.0, 0.1, 60.0) if setup is TO_MOTION else WRENCH)
    ending(story)
    assert story.endpoint.control_mode is ControlMode.SOFTWARE_PAUSE
    assert story.changes("error") == []
    assert story.endpoint.command_expired(60.0) == []
    assert story.endpoint.device_bits == 0


@pytest.mark.parametrize(
    "command",
    [StatusCommand.STANDBY, StatusCommand.SHUTDOWN, StatusCommand.RESET, StatusCommand.SET_EMERGENCY],
)
@pytest.mark.parametrize(
    ("setup", "component", "motion", "code"),
    [(TO_MOTION, MPD, MOTION, 9157), (TO_WRENCH, PD, WRENCH, 9158)],
    ids=["motion", "wrench"],
)
def test_a_status_raises_no_timeout_but_a_stream_that_ends_in_it_does_xgv_33_xgv_43(
    setup: tuple[StackMessage, ...],
    component: ComponentId,
    motion: StackMessage,
    code: int,
    command: StatusCommand,
) -> None:
    """A status is the ready mode and nothing more: the pause steers on by commands, so they are watched."""
    story = Story()
    story.say(*setup, motion)
    events = story.say(CommandStatus(component, command))
    assert not [event for event in events if isinstance(event, CommandDropped)]
    assert (story.endpoint.ready_mode, story.endpoint.device_bits) == (ReadyMode.SOFTWARE_PAUSE, 0)
    assert isinstance(story.say(motion)[0], CommandAccepted)
    story.endpoint.command_expired(1.0)
    assert story.endpoint.errors >= {code}
    story.say(motion)
    assert code not in story.endpoint.errors


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
