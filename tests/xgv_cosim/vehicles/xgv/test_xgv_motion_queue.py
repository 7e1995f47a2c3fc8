"""Set Motion Profile with several motions, and what drops them (XGV-43, XGV-58, XGV-70)."""

from __future__ import annotations

import pytest

from jaus.vehicle_mode import SafetyMode
from tests.xgv_cosim.vehicles.xgv.stories import MOTION, TO_MOTION, TO_WRENCH, WRENCH, Story, refusal
from xgv_cosim.commands import MotionProfile, MotionQueue
from xgv_cosim.endpoint import CommandAccepted, CommandDropped, EndpointChanged


def motion(speed_mps: float, duration_s: float) -> MotionProfile:
    return MotionProfile(speed_mps, 1.0, 0.0, 0.1, duration_s)


THREE = MotionQueue((motion(1.0, 0.4), motion(2.0, 0.3), motion(3.0, 0.5)))


def driving(**settings: object) -> Story:
    story = Story(motion_allow_many=True, **settings)
    story.say(*TO_MOTION)
    story.enter(SafetyMode.DRIVE_BY_WIRE)
    return story


def test_several_motions_are_refused_by_default_xgv_70() -> None:
    story = Story()
    story.say(*TO_MOTION)
    assert "got 3, expected 1: the XGV takes several only with xgv.motion.allow_many" in refusal(
        story.say(THREE)
    )
    assert story.say(MotionQueue((MOTION,))) == [CommandAccepted(MOTION, pytest.approx(0.4))]


def test_motions_run_in_order_each_from_the_end_of_the_last_xgv_58_xgv_43() -> None:
    story = driving()
    assert story.say(THREE) == [CommandAccepted(THREE.motions[0], pytest.approx(0.4))]
    # A tick late, the next one still ends at the sum of the durations.
    assert story.endpoint.command_expired(0.41) == [CommandAccepted(THREE.motions[1], pytest.approx(0.7))]
    assert story.endpoint.command_expired(0.70) == [CommandAccepted(THREE.motions[2], pytest.approx(1.2))]
    expired = story.endpoint.command_expired(1.2)
    assert [(e.kind, e.after) for e in expired if isinstance(e, EndpointChanged)] == [("error", "9157")]
    assert story.endpoint.command_expired(1.3) == []


def test_motions_that_are_over_before_their_tick_are_passed_over_xgv_43() -> None:
    story = driving()
    last = motion(9.0, 1.0)
    story.say(MotionQueue((motion(1.0, 0.1), motion(2.0, 0.0), motion(3.0, 0.004), last)))
    assert story.endpoint.command_expired(0.11) == [CommandAccepted(last, pytest.approx(1.104))]


def test_a_new_command_replaces_all_queued_motions_xgv_70() -> None:
    story = driving()
    story.say(THREE)
    story.now_s = 0.1
    story.say(MOTION)
    assert story.endpoint.command_expired(0.5) != []
    assert story.endpoint.errors == {9157}


@pytest.mark.parametrize("mode", [SafetyMode.SOFTWARE_PAUSE, SafetyMode.ESTOP_PAUSE])
def test_a_pause_drops_what_waits_and_goes_on_steering_with_what_runs_xgv_33_xgv_70(mode: SafetyMode) -> None:
    story = driving()
    story.say(THREE)
    dropped = [e for e in story.enter(mode) if isinstance(e, EndpointChanged) and e.kind == "motion_queue"]
    assert [(e.before, e.after) for e in dropped] == [("2 waiting", "0 waiting")]
    expired = story.endpoint.command_expired(0.4)
    assert [e.after for e in expired if isinstance(e, EndpointChanged)] == ["9157"]


@pytest.mark.parametrize(
    "mode",
    [SafetyMode.MANUAL_OVERRIDE, SafetyMode.EMERGENCY_MANUAL_OVERRIDE, SafetyMode.ESTOP_DISABLE],
)
def test_an_override_drops_the_whole_queue_xgv_70(mode: SafetyMode) -> None:
    story = driving()
    story.say(THREE)
    assert any(isinstance(event, CommandDropped) for event in story.enter(mode))
    assert story.endpoint.command_expired(0.4) == []


def test_a_change_of_control_mode_drops_the_whole_queue_xgv_70() -> None:
    story = driving()
    story.say(THREE)
    assert any(isinstance(event, CommandDropped) for event in story.say(*TO_WRENCH))
    assert story.endpoint.command_expired(0.4) == []


def test_an_override_drops_wrench_efforts_as_it_drops_motions_xgv_70() -> None:
    """Else an old effort would act again when the override ends."""
    story = Story()
    story.say(*TO_WRENCH, WRENCH)
    assert any(isinstance(e, CommandDropped) for e in story.enter(SafetyMode.MANUAL_OVERRIDE))
    assert 9158 not in story.endpoint.errors


def test_each_motion_must_be_valid_xgv_58() -> None:
    story = driving()
    bad = MotionQueue((motion(1.0, 1.0), motion(70.0, 1.0)))
    assert "speed_mps: got 70.0" in refusal(story.say(bad))
    assert "got 256, expected 1 to 255" in refusal(story.say(MotionQueue((MOTION,) * 256)))
    assert story.endpoint.command_expired(1.0) == []
