"""The status of the drivers: refusals, reasons and deadlines, beyond what component control already shows."""

from __future__ import annotations

import math

import pytest

from jaus.component import ComponentStatus, StatusCommand
from jaus.vehicle_mode import ReadyMode
from tests.xgv_cosim.vehicles.xgv.stories import (
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
from xgv_cosim.endpoint import CommandStatus, EndpointChanged, RequestControl


def reasons_of_ready(story: Story) -> list[tuple[str, ...]]:
    return [e.reasons for e in story.log if isinstance(e, EndpointChanged) and e.kind == "ready_mode"]


def test_an_emergency_that_nobody_controls_is_cleared_by_nobody_xgv_63() -> None:
    story = Story()
    story.say(CommandStatus(PD, StatusCommand.SET_EMERGENCY), sender=BOB)
    reason = refusal(story.say(CommandStatus(PD, StatusCommand.CLEAR_EMERGENCY)))
    assert reason == "only its controller may send clear emergency to the Primitive Driver, and it has none"


def test_resume_alone_is_refused_while_a_stop_lasts_xgv_37() -> None:
    story = Story()
    story.say(*TO_MOTION)
    story.endpoint.refuse_resume("Resume is refused: the door lasts")
    assert refusal(story.say(RESUME_PD)) == "Resume is refused: the door lasts"
    assert len(story.say(CommandStatus(PD, StatusCommand.STANDBY))) == 3  # status, ready mode, warning 9178
    assert story.say(CommandStatus(PD, StatusCommand.STANDBY)) == []
    story.endpoint.refuse_resume("")
    story.say(RESUME_PD)
    assert story.endpoint.ready_mode is ReadyMode.READY


def test_the_ready_mode_says_why_the_car_itself_stands_by_until_a_client_commands_xgv_37() -> None:
    story = Story()
    story.say(*TO_MOTION)
    assert reasons_of_ready(story)[-1] == ("all that is needed is ready",)
    story.log += story.endpoint.stand_by("set to standby by the open door or liftgate", 0.0)
    assert reasons_of_ready(story)[-1] == (
        "Primitive Driver is in standby",
        "Motion Profile Driver is in standby",
        "set to standby by the open door or liftgate",
    )
    story.say(RESUME_PD, RESUME_MPD, CommandStatus(PD, StatusCommand.STANDBY))
    assert reasons_of_ready(story)[-1] == ("Primitive Driver is in standby",)


def test_a_preemption_that_is_over_is_no_reason_any_more_xgv_66() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.say(RequestControl(MPD, 7), MOTION, sender=BOB)
    story.endpoint.raise_error(9156, 0.0)
    story.endpoint.stand_by("", 0.0)
    assert "preempted" not in str(story.endpoint.reasons(0))


def test_a_failure_outlasts_the_first_command_after_a_preemption_xgv_21_xgv_66() -> None:
    story = Story()
    story.say(*TO_MOTION, MOTION)
    story.say(RequestControl(MPD, 7), sender=BOB)
    story.endpoint.raise_error(9156, 0.0)
    story.say(MOTION, sender=BOB)
    assert story.endpoint.component_status == {PD: ComponentStatus.READY, MPD: ComponentStatus.FAILURE}


def test_clear_emergency_leads_out_of_a_failure_and_pauses_a_ready_driver_xgv_21_xgv_25() -> None:
    """It acts in every status: the MPD that failed stands by again, and so does one that was ready."""
    story = Story()
    story.say(*TO_MOTION)
    clear = CommandStatus(MPD, StatusCommand.CLEAR_EMERGENCY)
    story.say(clear)
    assert story.endpoint.component_status[MPD] is ComponentStatus.STANDBY
    assert story.endpoint.ready_mode is ReadyMode.SOFTWARE_PAUSE
    story.endpoint.raise_error(9156, 0.0)
    assert "the Motion Profile Driver is in failure" in refusal(story.say(RESUME_MPD))
    story.say(clear, RESUME_MPD)
    assert story.endpoint.component_status[MPD] is ComponentStatus.READY
    assert story.endpoint.device_bits == 128  # the error itself stays, and pauses (XGV-38)


def test_a_failure_ends_an_initialisation_xgv_21() -> None:
    story = Story()
    story.say(*TO_MOTION, CommandStatus(MPD, StatusCommand.RESET))
    story.endpoint.raise_error(9156, 0.5)
    story.wait_until(2.0)
    assert story.endpoint.component_status[MPD] is ComponentStatus.FAILURE


def test_a_frozen_clock_puts_the_end_of_an_initialisation_off_xgv_67() -> None:
    story = Story(initialize_s=1.0)
    story.say(CommandStatus(PD, StatusCommand.RESET))
    story.endpoint.delay(3.5)
    assert story.endpoint.next_deadline_s == pytest.approx(4.5)
    assert story.endpoint.handle_deadline(4.4) == []
    assert len(story.endpoint.handle_deadline(4.5)) == 1
    assert story.endpoint.next_deadline_s == math.inf


@pytest.mark.parametrize("setup", [TO_MOTION, TO_WRENCH], ids=["motion", "wrench"])
def test_a_driver_without_a_controller_is_set_to_standby_as_well_xgv_37(setup: tuple[object, ...]) -> None:
    """A stop counts for both drivers, whoever controls them or nobody."""
    story = Story()
    story.say(*TO_MOTION)
    story.say(*setup)  # type: ignore[arg-type]
    story.endpoint.stand_by("set to standby by the door", 0.0)
    assert set(story.endpoint.component_status.values()) == {ComponentStatus.STANDBY}


def test_a_loss_of_control_is_no_reason_for_a_control_mode_that_came_after_it_xgv_65() -> None:
    """Bob's silence frees the PD for Alice's MPD: from then on it explains nothing."""
    story = Story()
    story.say(RequestControl(PD, 9), sender=BOB)
    for second in range(5):
        story.wait_until(float(second))
        story.say(RequestControl(MPD, 6))
    story.wait_until(5.0)
    assert "was silent" not in refusal(story.say(WRENCH))
