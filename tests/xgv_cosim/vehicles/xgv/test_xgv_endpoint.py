"""The XGV's endpoint in short stories: what clients send, and what comes of it."""

from __future__ import annotations

import math

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from jaus.vehicle_mode import ControlMode, ReadyMode
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
from xgv_cosim.commands import MotionProfile, WrenchEffort
from xgv_cosim.endpoint import (
    CommandAccepted,
    CommandDropped,
    CommandStatus,
    EndpointChanged,
    ReleaseControl,
    RequestControl,
    StackMessage,
)
from xgv_cosim.errors import ScenarioError
from xgv_cosim.vehicles.xgv.errors import ERRORS
from xgv_cosim.vehicles.xgv.settings import BothClients, ErrorLatch


def test_a_bound_car_starts_in_standby_uncontrolled() -> None:
    story = Story()
    assert story.modes == (ControlMode.SOFTWARE_PAUSE, ReadyMode.SOFTWARE_PAUSE)
    assert set(story.endpoint.component_status.values()) == {ComponentStatus.STANDBY}
    assert story.endpoint.component_controller == {PD: None, MPD: None}
    assert story.endpoint.next_deadline_s == math.inf
    assert story.endpoint.device_bits == 0


def test_torc_sequence_to_motion_profiles_xgv_17_xgv_18_xgv_23() -> None:
    story = Story()
    story.say(*TO_MOTION)
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)
    assert story.endpoint.component_controller == {
        MPD: ALICE,
        PD: JausAddress(1, 1, MPD, 1),
    }
    assert story.changes("control_mode") == [("software_pause", "motion_profiles")]
    assert story.changes("ready_mode") == [("software_pause", "ready")]
    assert story.changes("component_control") == [
        ("Motion Profile Driver: nobody", "Motion Profile Driver: 1.2.4.1"),
        ("Primitive Driver: nobody", "Primitive Driver: Motion Profile Driver"),
    ]
    assert story.changes("component_status") == [
        ("Primitive Driver: standby", "Primitive Driver: ready"),
        ("Motion Profile Driver: standby", "Motion Profile Driver: ready"),
    ]


def test_repeats_at_50_hz_say_nothing_xgv_20() -> None:
    story = Story()
    story.say(*TO_MOTION)
    for tick in range(1, 101):
        story.wait_until(tick * 0.02)
        assert story.say(*TO_MOTION) == []
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)


def test_client_switches_to_wrench_efforts_and_back_xgv_16_xgv_22() -> None:
    story = Story()
    story.say(*TO_MOTION)
    story.say(*TO_WRENCH)
    assert story.modes == (ControlMode.WRENCH_EFFORTS, ReadyMode.READY)
    assert isinstance(story.say(WRENCH)[0], CommandAccepted)
    assert "control mode is wrench efforts" in refusal(story.say(MOTION))
    story.say(*TO_MOTION)
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)


def test_releasing_both_is_software_pause_xgv_18() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    events = story.say(ReleaseControl(MPD), ReleaseControl(PD))
    assert story.modes == (ControlMode.SOFTWARE_PAUSE, ReadyMode.SOFTWARE_PAUSE)
    assert story.endpoint.component_controller == {PD: None, MPD: None}
    dropped = [event for event in events if isinstance(event, CommandDropped)]
    assert len(dropped) == 1
    assert "from motion profiles to software pause" in dropped[0].reason
    assert story.endpoint.next_deadline_s == math.inf


@pytest.mark.parametrize(("both", "mode"), [(BothClients.SOFTWARE_PAUSE, 1), (BothClients.WRENCH_EFFORTS, 2)])
def test_one_client_in_control_of_both_xgv_18(both: BothClients, mode: int) -> None:
    story = Story(control_mode_both_clients=both)
    story.say(RequestControl(PD), RequestControl(MPD))
    assert story.endpoint.control_mode == mode


def test_mpd_asks_each_second_and_takes_the_pd_when_it_is_free_xgv_19() -> None:
    story = Story(controller_timeout_s=0.0)
    story.say(RequestControl(PD), sender=BOB)
    story.say(RequestControl(MPD))
    assert story.endpoint.control_mode is ControlMode.SOFTWARE_PAUSE
    assert "1.3.4.1 controls the Primitive Driver" in story.endpoint.reasons(0)[0]
    assert story.endpoint.next_deadline_s == pytest.approx(1.0)
    assert story.wait_until(2.5) == []
    assert story.endpoint.next_deadline_s == pytest.approx(3.0)
    story.say(ReleaseControl(PD), sender=BOB)
    assert story.endpoint.control_mode is ControlMode.SOFTWARE_PAUSE
    story.wait_until(3.0)
    assert story.endpoint.control_mode is ControlMode.MOTION_PROFILES
    assert story.endpoint.next_deadline_s == math.inf


def test_mpd_takes_the_pd_with_its_controllers_authority_xgv_19() -> None:
    story = Story()
    story.say(RequestControl(PD, authority=6), sender=BOB)
    story.say(RequestControl(MPD, authority=7))
    assert story.endpoint.control_mode is ControlMode.MOTION_PROFILES
    assert "authority 7" in refusal(story.say(RequestControl(PD, authority=7), sender=BOB))


def test_mpd_raises_its_authority_with_its_controller_xgv_19() -> None:
    story = Story()
    story.say(RequestControl(MPD, authority=6))
    story.say(RequestControl(MPD, authority=100))
    refusal(story.say(RequestControl(PD, authority=100), sender=BOB))
    story.say(RequestControl(PD, authority=101), sender=BOB)
    assert story.endpoint.control_mode is ControlMode.SOFTWARE_PAUSE


def test_pd_taken_from_the_mpd_is_asked_for_again_xgv_19_xgv_66() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    events = story.say(RequestControl(PD, authority=255), sender=BOB)
    assert story.endpoint.control_mode is ControlMode.SOFTWARE_PAUSE
    assert any(isinstance(event, CommandDropped) for event in events)
    story.say(ReleaseControl(PD), sender=BOB)
    story.wait_until(1.0)
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.READY)


def test_motion_of_a_preempted_client_is_dropped_xgv_10_xgv_70() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    events = story.say(RequestControl(MPD, authority=255), sender=BOB)
    assert story.endpoint.control_mode is ControlMode.MOTION_PROFILES
    dropped = [event for event in events if isinstance(event, CommandDropped)]
    assert [event.reason == "1.2.4.1 was preempted" for event in dropped] == [True]
    assert "1.3.4.1 controls the Motion Profile Driver, not 1.2.4.1" in refusal(story.say(MOTION))
    assert story.endpoint.command_expired(0.4) == []


def test_commands_without_control_are_refused_xgv_10() -> None:
    story = Story()
    for command, name in ((MOTION, "Motion Profile Driver"), (WRENCH, "Primitive Driver")):
        reason = refusal(story.say(command))
        assert f"nobody controls the {name}, not 1.2.4.1" in reason
        assert "control mode is software pause" in reason


def test_wrench_of_the_mpds_controller_is_refused_xgv_16() -> None:
    story = Story()
    story.say(*TO_MOTION)
    assert "Motion Profile Driver controls the Primitive Driver, not 1.2.4.1" in refusal(story.say(WRENCH))


def test_commands_are_accepted_whatever_the_status_cross_profile() -> None:
    story = Story()
    story.say(RequestControl(MPD))
    assert story.endpoint.ready_mode is ReadyMode.SOFTWARE_PAUSE
    assert story.say(MOTION) == [CommandAccepted(MOTION, pytest.approx(0.4))]


@pytest.mark.parametrize(
    ("setup", "command", "lifetime_s", "code"),
    [(TO_MOTION, MOTION, 0.4, "9157"), (TO_WRENCH, WRENCH, 0.5, "9158")],
)
def test_expiry_raises_an_error_that_a_fresh_command_clears_xgv_43(
    setup: tuple[StackMessage, ...], command: MotionProfile | WrenchEffort, lifetime_s: float, code: str
) -> None:
    story = Story()
    story.say(*setup)
    story.now_s = 2.0
    assert story.say(command) == [CommandAccepted(command, pytest.approx(2.0 + lifetime_s))]
    expired = story.endpoint.command_expired(2.0 + lifetime_s)
    assert expired == [EndpointChanged("error", "", code, (ERRORS[int(code)].label,))]
    assert story.endpoint.device_bits == 128
    assert story.endpoint.reasons(128) == (ERRORS[int(code)].label,)
    assert story.modes[1] is ReadyMode.READY  # the pause comes from the error alone
    accepted, cleared = story.say(command)
    assert isinstance(accepted, CommandAccepted)
    assert isinstance(cleared, EndpointChanged)
    assert (cleared.before, cleared.after) == (code, "")
    assert story.endpoint.device_bits == 0


def test_a_refused_command_clears_no_timeout_xgv_43() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.endpoint.command_expired(0.4)
    refusal(story.say(MOTION, sender=BOB))
    assert story.endpoint.errors == {9157}


@pytest.mark.parametrize(
    ("motion", "named"),
    [
        (MotionProfile(70.0, 1.0, 0.0, 0.1, 0.4), "speed_mps"),
        (MotionProfile(1.0, 101.0, 0.0, 0.1, 0.4), "max_accel_mps2"),
        (MotionProfile(1.0, 1.0, 0.0, 10.5, 0.4), "max_curvature_rate_per_m_s"),
        (MotionProfile(1.0, 1.0, 0.0, 0.1, 66.0), "duration_s"),
    ],
)
def test_values_that_the_message_cannot_carry_are_refused_xgv_58(motion: MotionProfile, named: str) -> None:
    story = Story()
    story.say(*TO_MOTION)
    assert named in refusal(story.say(motion))


def test_standby_pauses_and_resume_from_the_mpds_controller_acts_xgv_24_xgv_25() -> None:
    story = Story()
    story.say(*TO_MOTION)
    story.say(CommandStatus(PD, StatusCommand.STANDBY))
    assert story.modes == (ControlMode.MOTION_PROFILES, ReadyMode.SOFTWARE_PAUSE)
    assert story.endpoint.reasons(0) == ("ready mode software pause: Primitive Driver is in standby",)
    story.say(RESUME_PD)
    assert story.endpoint.ready_mode is ReadyMode.READY


def test_a_stranger_may_only_set_emergency_xgv_63() -> None:
    story = Story()
    story.say(*TO_MOTION)
    for command in set(StatusCommand) - {StatusCommand.SET_EMERGENCY}:
        assert "may not send" in refusal(story.say(CommandStatus(MPD, command), sender=BOB))
    assert story.modes[1] is ReadyMode.READY
    story.say(CommandStatus(MPD, StatusCommand.SET_EMERGENCY), sender=BOB)
    assert story.endpoint.ready_mode is ReadyMode.SOFTWARE_PAUSE
    assert "resume acts in standby only" in refusal(story.say(RESUME_MPD))
    story.say(CommandStatus(MPD, StatusCommand.CLEAR_EMERGENCY), RESUME_MPD)
    assert story.endpoint.ready_mode is ReadyMode.READY


def test_reset_initialises_and_then_stands_by() -> None:
    story = Story(initialize_s=1.0)
    story.say(*TO_MOTION)
    story.say(CommandStatus(MPD, StatusCommand.RESET))
    assert story.endpoint.component_status[MPD] is ComponentStatus.INITIALIZE
    assert story.endpoint.next_deadline_s == pytest.approx(1.0)
    assert "in initialize" in refusal(story.say(RESUME_MPD))
    story.wait_until(1.0)
    assert story.endpoint.component_status[MPD] is ComponentStatus.STANDBY
    story.say(RESUME_MPD)
    assert story.modes[1] is ReadyMode.READY


def test_shutdown_ends_an_initialisation() -> None:
    story = Story()
    story.say(CommandStatus(PD, StatusCommand.RESET), CommandStatus(PD, StatusCommand.SHUTDOWN))
    assert story.endpoint.next_deadline_s == math.inf
    story.wait_until(5.0)
    assert story.endpoint.component_status[PD] is ComponentStatus.SHUTDOWN


def test_other_components_take_no_control_xgv_10() -> None:
    story = Story()
    for message in (
        RequestControl(ComponentId.SIGNALS_DRIVER),
        ReleaseControl(ComponentId.NODE_MANAGER),
        CommandStatus(ComponentId.ERROR_MANAGER, StatusCommand.RESET),
    ):
        assert "only the Primitive Driver and the Motion Profile Driver do" in refusal(story.say(message))


def test_an_authority_outside_one_byte_is_refused() -> None:
    assert "0 to 255" in refusal(Story().say(RequestControl(PD, authority=256)))


def test_warnings_and_link_loss_do_not_pause_xgv_38() -> None:
    story = Story(errors_latch=ErrorLatch.NONE)
    story.say(*TO_WRENCH)
    for code, error in ERRORS.items():
        story.endpoint.raise_error(code, 0.0)
        pauses = code not in {9138, 9143, 9144, *range(9175, 9181)}
        assert error.pauses is pauses
        assert story.endpoint.device_bits == (128 if pauses else 0)
        assert story.endpoint.raise_error(code, 0.0) == []
        assert len(story.endpoint.clear_error(code, 0.0)) == 1
        assert story.endpoint.clear_error(code, 0.0) == []


def test_an_unknown_error_code_is_named_with_the_known_ones() -> None:
    with pytest.raises(
        ScenarioError,
        match=r"got 9112, expected one that the XGV has.*9111 brake.*9113",
    ):
        Story().endpoint.raise_error(9112, 0.0)


def test_reasons_stand_strongest_first() -> None:
    story = Story()
    story.endpoint.raise_error(9109, 0.0)
    assert story.endpoint.reasons(0x7FF) == (
        "SafeStop stop relay",
        "emergency stop button",
        "emergency manual override",
        "manual override",
        "SafeStop pause relay",
        "door or liftgate open",
        "error 9109 brake",
        "steering requires initialisation",
        "steering initialisation awaits the user",
        "control mode software pause: nobody controls the Motion Profile Driver or the Primitive Driver",
    )


def test_drive_by_wire_has_a_reason_too() -> None:
    story = Story()
    story.say(*TO_MOTION)
    ready = "no device, error or pause in force; control mode motion profiles, ready"
    assert story.endpoint.reasons(16) == (f"{ready}, but without a live command",)
    story.say(MotionProfile(5.0, 1.0, 0.0, 0.1, 0.4))
    assert story.endpoint.reasons(16) == (ready,)
