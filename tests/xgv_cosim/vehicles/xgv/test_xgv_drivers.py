"""Drivers alone, to the last word: what each message and each deadline makes of control and status."""

from __future__ import annotations

import math

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, Standing, StatusCommand
from xgv_cosim.endpoint import (
    CommandStatus,
    ControlPreempted,
    EndpointChanged,
    EndpointEvent,
    MessageRefused,
    ReleaseControl,
    RequestControl,
    SetAuthority,
    StackMessage,
)
from xgv_cosim.vehicles.xgv.drivers import Drivers
from xgv_cosim.vehicles.xgv.silence import SilenceWatch

PD, MPD, NODE = ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER, ComponentId.NODE_MANAGER
PD_NAME, MPD_NAME = "Primitive Driver", "Motion Profile Driver"
ALICE, BOB = JausAddress(1, 2, 4, 1), JausAddress(1, 3, 4, 1)
READY, STANDBY = ComponentStatus.READY, ComponentStatus.STANDBY


def new(timeout_s: float = 0.0) -> Drivers:
    return Drivers(7, request_period_s=1.0, initialize_s=2.0, controller_timeout_s=timeout_s)


def say(
    drivers: Drivers, message: StackMessage, sender: JausAddress = ALICE, now_s: float = 0.0
) -> list[EndpointEvent]:
    match message:
        case RequestControl():
            events = drivers.request_control(message, sender, now_s)
        case ReleaseControl():
            events = drivers.release_control(message, sender, now_s)
        case SetAuthority():
            events = drivers.set_authority(message, sender, now_s)
        case CommandStatus():
            events = drivers.command_status(message, sender, now_s)
        case _:
            raise AssertionError(message)
    drivers.heard(sender, now_s)
    return events


def taken(name: str, before: str, after: str, reason: str) -> EndpointChanged:
    return EndpointChanged("component_control", f"{name}: {before}", f"{name}: {after}", (reason,))


def preempted(name: str, before: str, after: str, reason: str) -> ControlPreempted:
    return ControlPreempted(f"{name}: {before}", f"{name}: {after}", (reason,))


def became(name: str, before: str, after: str, reason: str) -> EndpointChanged:
    return EndpointChanged("component_status", f"{name}: {before}", f"{name}: {after}", (reason,))


def refused(events: list[EndpointEvent], message: StackMessage) -> str:
    (event,) = events
    assert isinstance(event, MessageRefused)
    assert event.message is message
    return event.reason


def holders(drivers: Drivers) -> tuple[JausAddress | None, JausAddress | None]:
    return drivers.primitive.controller, drivers.profile.controller


def test_they_begin_in_standby_under_their_addresses_with_nobody_and_nothing_due_xgv_07_xgv_08() -> None:
    drivers = new()
    assert drivers.primitive.address == JausAddress(7, 1, 33, 1)
    assert drivers.profile.address == JausAddress(7, 1, 10, 1)
    assert (drivers.primitive.status, drivers.profile.status) == (STANDBY, STANDBY)
    assert holders(drivers) == (None, None)
    assert (drivers.next_deadline_s, drivers.loss, drivers.status.standby_reason) == (math.inf, "", "")
    assert drivers.by_id == {PD: drivers.primitive, MPD: drivers.profile}


def test_requests_and_releases_of_the_pd_tell_who_and_why_xgv_10_xgv_20() -> None:
    drivers = new()
    assert say(drivers, RequestControl(PD, 6)) == [
        taken(PD_NAME, "nobody", "1.2.4.1", "requested with authority 6")
    ]
    assert say(drivers, RequestControl(PD, 9)) == []  # a mere rise of authority
    message = RequestControl(PD, 9)
    assert refused(say(drivers, message, BOB), message) == (
        "the Primitive Driver is controlled by 1.2.4.1 with authority 9; 9 is not higher"
    )
    assert say(drivers, RequestControl(PD, 10), BOB) == [
        taken(PD_NAME, "1.2.4.1", "1.3.4.1", "requested with authority 10"),
        preempted(PD_NAME, "1.2.4.1", "1.3.4.1", "requested with authority 10"),
    ]
    assert say(drivers, ReleaseControl(PD)) == []  # from one who has lost it
    assert say(drivers, ReleaseControl(PD), BOB) == [taken(PD_NAME, "1.3.4.1", "nobody", "released")]
    assert holders(drivers) == (None, None)
    assert drivers.next_deadline_s == math.inf


def test_the_mpd_takes_the_pd_with_its_controllers_authority_and_gives_it_back_xgv_17_xgv_19() -> None:
    drivers = new()
    assert say(drivers, RequestControl(MPD, 6)) == [
        taken(MPD_NAME, "nobody", "1.2.4.1", "requested with authority 6"),
        taken(PD_NAME, "nobody", MPD_NAME, "requested with authority 6"),
    ]
    assert drivers.next_deadline_s == math.inf
    assert holders(drivers) == (drivers.profile.address, ALICE)
    assert say(drivers, ReleaseControl(MPD)) == [
        taken(MPD_NAME, "1.2.4.1", "nobody", "released"),
        taken(PD_NAME, MPD_NAME, "nobody", "released: the Motion Profile Driver lost its controller"),
    ]
    assert holders(drivers) == (None, None)
    assert drivers.next_deadline_s == math.inf


def test_the_mpd_asks_at_its_period_for_a_pd_that_another_has_and_no_longer_than_it_is_controlled() -> None:
    """XGV-19: denied at 0.5, 1.5 and 2.5 s; free at 3.2 s; its own at 3.5 s."""
    drivers = new()
    say(drivers, RequestControl(PD, 6), BOB)
    assert say(drivers, RequestControl(MPD, 6), now_s=0.5) == [
        taken(MPD_NAME, "nobody", "1.2.4.1", "requested with authority 6")
    ]
    for due_s in (1.5, 2.5):
        assert drivers.next_deadline_s == due_s
        assert drivers.handle_deadline(due_s - 0.01) == []
        assert drivers.next_deadline_s == due_s
        assert drivers.handle_deadline(due_s) == []
    # That the PD is free now does not move the time at which the MPD asks.
    assert say(drivers, ReleaseControl(PD), BOB, 3.2) == [taken(PD_NAME, "1.3.4.1", "nobody", "released")]
    assert drivers.next_deadline_s == 3.5
    assert drivers.handle_deadline(3.5 - 5e-10) == [
        taken(PD_NAME, "nobody", MPD_NAME, "requested with authority 6")
    ]
    assert drivers.next_deadline_s == math.inf
    say(drivers, RequestControl(PD, 7), BOB, 4.0)
    assert drivers.next_deadline_s == 5.0  # it was taken from the MPD, which asks again
    say(drivers, ReleaseControl(MPD), now_s=4.2)
    assert drivers.next_deadline_s == math.inf


def test_a_higher_authority_of_the_mpds_controller_takes_the_pd_from_a_client_xgv_19_xgv_66() -> None:
    drivers = new()
    say(drivers, RequestControl(PD, 6), BOB)
    assert say(drivers, RequestControl(MPD, 7)) == [
        taken(MPD_NAME, "nobody", "1.2.4.1", "requested with authority 7"),
        taken(PD_NAME, "1.3.4.1", MPD_NAME, "requested with authority 7"),
        preempted(PD_NAME, "1.3.4.1", MPD_NAME, "requested with authority 7"),
    ]


def test_who_takes_the_pd_from_the_mpd_for_the_same_client_preempts_nobody_xgv_66() -> None:
    drivers = new()
    say(drivers, RequestControl(MPD, 6))
    assert say(drivers, RequestControl(PD, 7), now_s=1.0) == [
        taken(PD_NAME, MPD_NAME, "1.2.4.1", "requested with authority 7")
    ]
    assert drivers.next_deadline_s == 2.0
    assert say(drivers, RequestControl(PD, 8), BOB, 1.5) == [
        taken(PD_NAME, "1.2.4.1", "1.3.4.1", "requested with authority 8"),
        preempted(PD_NAME, "1.2.4.1", "1.3.4.1", "requested with authority 8"),
    ]
    assert drivers.next_deadline_s == 2.0  # it keeps its own pace


def test_a_mpd_that_changes_hands_hands_the_new_authority_on_xgv_19_xgv_66() -> None:
    drivers = new()
    say(drivers, RequestControl(MPD, 6))
    assert say(drivers, RequestControl(MPD, 8), BOB) == [
        taken(MPD_NAME, "1.2.4.1", "1.3.4.1", "requested with authority 8"),
        preempted(MPD_NAME, "1.2.4.1", "1.3.4.1", "requested with authority 8"),
    ]
    assert drivers.primitive.control is not None
    assert drivers.primitive.control.authority == 8


def test_authority_is_set_by_the_controller_alone_and_the_mpd_tells_the_pd_xgv_19_xgv_20() -> None:
    drivers = new()
    message = SetAuthority(MPD, 3)
    assert refused(say(drivers, message), message) == "nobody controls the Motion Profile Driver, not 1.2.4.1"
    say(drivers, RequestControl(MPD, 6))
    assert refused(say(drivers, message, BOB), message) == (
        "1.2.4.1 controls the Motion Profile Driver, not 1.3.4.1"
    )
    assert say(drivers, message) == []
    assert drivers.primitive.control is not None
    assert drivers.primitive.control.authority == 3
    wild = SetAuthority(MPD, 256)
    assert "0 to 255" in refused(say(drivers, wild), wild)
    say(drivers, RequestControl(PD, 5), BOB)
    assert say(drivers, SetAuthority(MPD, 9)) == [  # it asks at once, not only in a second
        taken(PD_NAME, "1.3.4.1", MPD_NAME, "requested with authority 9"),
        preempted(PD_NAME, "1.3.4.1", MPD_NAME, "requested with authority 9"),
    ]
    drivers = new()
    say(drivers, RequestControl(PD, 6))
    assert say(drivers, SetAuthority(PD, 2)) == []
    assert drivers.primitive.control is not None
    assert drivers.primitive.control.authority == 2
    assert drivers.next_deadline_s == math.inf


@pytest.mark.parametrize(
    "message",
    [
        RequestControl(NODE, 6),
        ReleaseControl(NODE),
        SetAuthority(NODE, 6),
        CommandStatus(NODE, StatusCommand.RESUME),
    ],
)
def test_other_components_take_none_of_these_messages_xgv_08(message: StackMessage) -> None:
    assert refused(say(new(), message), message) == (
        f"the Node Manager takes no {type(message).__name__}; "
        "only the Primitive Driver and the Motion Profile Driver do"
    )


def test_an_authority_that_does_not_fit_the_wire_is_refused_xgv_20() -> None:
    message = RequestControl(PD, 256)
    assert "0 to 255" in refused(say(new(), message), message)


def test_who_stands_how_to_the_pd_xgv_10() -> None:
    drivers = new()
    assert drivers.standing(ALICE) is Standing.NOBODY_CONTROLS
    say(drivers, RequestControl(MPD, 6))
    assert (drivers.standing(ALICE), drivers.standing(BOB)) == (Standing.DEPUTY, Standing.BYSTANDER)
    assert drivers.standing(drivers.profile.address) is Standing.CONTROLLER
    say(drivers, RequestControl(PD, 7), BOB)
    assert (drivers.standing(ALICE), drivers.standing(BOB)) == (Standing.BYSTANDER, Standing.CONTROLLER)
    assert drivers.holder_name(None) == "nobody"
    assert drivers.holder_name(drivers.profile.address) == MPD_NAME


def test_a_silent_controller_loses_both_drivers_on_its_time_and_the_reason_stands_xgv_65() -> None:
    drivers = new(timeout_s=5.0)
    say(drivers, RequestControl(MPD, 6), now_s=1.0)
    drivers.heard(ALICE, 2.0)
    drivers.heard(BOB, 1.5)  # controls nothing, so nobody waits for him
    assert drivers.next_deadline_s == 7.0
    assert drivers.handle_deadline(6.99) == []
    reason = "1.2.4.1 was silent for 5 s and lost control"
    assert drivers.handle_deadline(7.0) == [
        taken(MPD_NAME, "1.2.4.1", "nobody", reason),
        taken(PD_NAME, MPD_NAME, "nobody", "released: the Motion Profile Driver lost its controller"),
    ]
    assert (drivers.loss, drivers.next_deadline_s) == (reason, math.inf)
    say(drivers, RequestControl(PD, 6), BOB, 8.0)
    assert (drivers.loss, drivers.next_deadline_s) == ("", 13.0)
    assert drivers.handle_deadline(13.0) == [
        taken(PD_NAME, "1.3.4.1", "nobody", "1.3.4.1 was silent for 5 s and lost control")
    ]


def test_silence_counts_only_where_its_time_is_given_and_a_strangers_release_ends_no_reason_xgv_65() -> None:
    drivers = Drivers(7, request_period_s=1.0, initialize_s=2.0)
    say(drivers, RequestControl(PD, 6))
    assert drivers.next_deadline_s == math.inf
    drivers = new(timeout_s=5.0)
    say(drivers, RequestControl(PD, 6))
    drivers.handle_deadline(5.0)
    assert say(drivers, ReleaseControl(PD), BOB, 6.0) == []
    assert drivers.loss == "1.2.4.1 was silent for 5 s and lost control"


def test_silence_of_one_client_leaves_the_others_what_they_have_xgv_65() -> None:
    drivers = new(timeout_s=5.0)
    say(drivers, RequestControl(PD, 7), BOB, 0.0)
    say(drivers, RequestControl(MPD, 6), now_s=1.0)
    drivers.heard(BOB, 3.0)
    while drivers.next_deadline_s < 5.9:
        assert drivers.handle_deadline(drivers.next_deadline_s) == []
    drivers.handle_deadline(6.0)
    assert holders(drivers) == (BOB, None)


def test_a_controllers_frozen_clock_puts_every_deadline_off_xgv_67() -> None:
    drivers = new(timeout_s=5.0)
    say(drivers, RequestControl(PD, 6), BOB)
    say(drivers, RequestControl(MPD, 6))
    assert drivers.next_deadline_s == 1.0
    drivers.delay(3.0)
    assert drivers.next_deadline_s == 4.0
    drivers.handle_deadline(4.0)
    say(drivers, ReleaseControl(PD), BOB, 4.5)
    drivers.handle_deadline(5.0)
    drivers.heard(ALICE, 5.0)
    drivers.delay(0.5)
    assert drivers.next_deadline_s == 10.5
    say(drivers, CommandStatus(MPD, StatusCommand.RESET), now_s=6.0)
    drivers.delay(0.25)
    assert drivers.next_deadline_s == 8.25


def test_reset_initialises_for_its_time_and_a_repeat_does_not_begin_anew_xgv_21() -> None:
    drivers = new()
    say(drivers, RequestControl(PD, 6))
    assert say(drivers, CommandStatus(PD, StatusCommand.RESET), now_s=1.0) == [
        became(PD_NAME, "standby", "initialize", "reset from 1.2.4.1")
    ]
    assert say(drivers, CommandStatus(PD, StatusCommand.RESET), now_s=2.0) == []
    assert drivers.next_deadline_s == 3.0
    early = CommandStatus(PD, StatusCommand.RESUME)
    assert refused(say(drivers, early, now_s=2.5), early) == (
        "resume acts in standby only; the Primitive Driver is in initialize"
    )
    assert drivers.handle_deadline(2.99) == []
    assert drivers.next_deadline_s == 3.0
    assert drivers.handle_deadline(3.0 - 5e-10) == [became(PD_NAME, "initialize", "standby", "initialised")]
    assert drivers.next_deadline_s == math.inf
    assert say(drivers, CommandStatus(PD, StatusCommand.RESUME), now_s=3.0) == [
        became(PD_NAME, "standby", "ready", "resume from 1.2.4.1")
    ]
    assert say(drivers, CommandStatus(PD, StatusCommand.RESUME), now_s=3.0) == []


@pytest.mark.parametrize("command", [StatusCommand.SHUTDOWN, StatusCommand.SET_EMERGENCY])
def test_what_leads_out_of_initialising_ends_its_time_xgv_21(command: StatusCommand) -> None:
    drivers = new()
    say(drivers, RequestControl(PD, 6))
    say(drivers, CommandStatus(PD, StatusCommand.RESET))
    say(drivers, CommandStatus(PD, command), now_s=1.0)
    assert drivers.primitive.status is not ComponentStatus.INITIALIZE
    assert drivers.next_deadline_s == math.inf
    assert drivers.handle_deadline(5.0) == []


def test_a_failure_ends_initialising_and_the_wait_for_a_command_xgv_21_xgv_66() -> None:
    drivers = new()
    say(drivers, RequestControl(PD, 6))
    say(drivers, CommandStatus(PD, StatusCommand.RESET))
    assert drivers.status.fail(PD, "gone") == [became(PD_NAME, "initialize", "failure", "gone")]
    assert drivers.next_deadline_s == math.inf
    assert drivers.status.fail(PD, "gone") == []
    drivers = ready()
    drivers.status.stand_by_for_command("taken")
    drivers.status.fail(PD, "gone")
    assert drivers.status.command_accepted(BOB) == [
        became(MPD_NAME, "standby", "ready", "first command of 1.3.4.1")
    ]
    assert drivers.primitive.status is ComponentStatus.FAILURE


def ready() -> Drivers:
    drivers = new()
    say(drivers, RequestControl(MPD, 6))
    for component in (PD, MPD):
        say(drivers, CommandStatus(component, StatusCommand.RESUME))
    assert (drivers.primitive.status, drivers.profile.status) == (READY, READY)
    return drivers


def test_a_stop_sets_the_drivers_that_are_ready_to_standby_until_they_are_resumed_xgv_37() -> None:
    drivers = ready()
    drivers.status.resume_refusal = "the door is open"
    assert drivers.status.stand_by("the door") == [
        became(PD_NAME, "ready", "standby", "the door"),
        became(MPD_NAME, "ready", "standby", "the door"),
    ]
    assert drivers.status.standby_reason == "the door"
    assert drivers.status.stand_by("again") == []
    assert drivers.status.standby_reason == "the door"
    message = CommandStatus(PD, StatusCommand.RESUME)
    assert refused(say(drivers, message), message) == "the door is open"
    assert say(drivers, CommandStatus(PD, StatusCommand.STANDBY)) == []
    assert drivers.status.command_accepted(ALICE) == []
    drivers.status.resume_refusal = ""
    assert say(drivers, message) == [became(PD_NAME, "standby", "ready", "resume from 1.2.4.1")]
    assert drivers.status.standby_reason == ""


def test_a_stop_without_a_controller_acts_too_xgv_37() -> None:
    drivers = ready()
    say(drivers, ReleaseControl(MPD))
    assert [event.reasons for event in drivers.status.stand_by("the door")] == [("the door",), ("the door",)]  # type: ignore[union-attr]
    assert (drivers.primitive.status, drivers.profile.status) == (STANDBY, STANDBY)


def test_after_a_preemption_the_first_command_resumes_just_what_was_ready_xgv_66() -> None:
    drivers = ready()
    say(drivers, CommandStatus(MPD, StatusCommand.STANDBY))
    assert drivers.status.stand_by_for_command("taken") == [became(PD_NAME, "ready", "standby", "taken")]
    assert drivers.status.standby_reason == "taken"
    assert drivers.status.command_accepted(BOB) == [
        became(PD_NAME, "standby", "ready", "first command of 1.3.4.1")
    ]
    assert drivers.status.standby_reason == ""
    assert drivers.profile.status is STANDBY
    assert drivers.status.command_accepted(BOB) == []


def test_a_stop_or_a_clients_own_status_after_a_preemption_outlasts_the_first_command_xgv_37_xgv_66() -> None:
    drivers = ready()
    drivers.status.stand_by_for_command("taken")
    drivers.status.stand_by("the door")
    assert drivers.status.command_accepted(BOB) == []
    drivers = ready()
    drivers.status.stand_by_for_command("taken")
    say(drivers, CommandStatus(PD, StatusCommand.STANDBY))
    assert drivers.status.standby_reason == ""
    assert drivers.status.command_accepted(BOB) == [
        became(MPD_NAME, "standby", "ready", "first command of 1.3.4.1")
    ]


def test_a_refused_status_command_changes_nothing_and_says_who_may_xgv_10_xgv_25() -> None:
    drivers = new()
    say(drivers, CommandStatus(PD, StatusCommand.SET_EMERGENCY))
    clear = CommandStatus(PD, StatusCommand.CLEAR_EMERGENCY)
    assert refused(say(drivers, clear), clear) == (
        "only its controller may send clear emergency to the Primitive Driver, and it has none"
    )
    drivers = ready()
    drivers.status.stand_by_for_command("taken")
    clear = CommandStatus(PD, StatusCommand.STANDBY)
    assert refused(say(drivers, clear, BOB), clear) == (
        "1.3.4.1 may not send standby: Motion Profile Driver controls the Primitive Driver"
    )
    assert drivers.status.standby_reason == "taken"
    assert len(drivers.status.command_accepted(ALICE)) == 2
    reset = CommandStatus(PD, StatusCommand.RESET)
    words = refused(say(drivers, reset), reset)
    assert words.endswith("controls the Primitive Driver; release the Motion Profile Driver first")
    assert drivers.next_deadline_s == math.inf


def test_two_resets_end_each_at_its_own_time_xgv_21() -> None:
    drivers = new()
    say(drivers, RequestControl(PD, 6))
    say(drivers, RequestControl(MPD, 6), BOB)
    say(drivers, CommandStatus(PD, StatusCommand.RESET), now_s=0.1)
    say(drivers, CommandStatus(MPD, StatusCommand.RESET), BOB, 0.4)
    ends = []
    while drivers.next_deadline_s < 3.0:
        due_s = drivers.next_deadline_s
        ends += [(due_s, event) for event in drivers.handle_deadline(due_s)]
    assert ends == [
        (2.1, became(PD_NAME, "initialize", "standby", "initialised")),
        (2.4, became(MPD_NAME, "initialize", "standby", "initialised")),
    ]


def test_the_watch_over_silence_forgets_who_controls_nothing_xgv_65() -> None:
    watch = SilenceWatch(5.0)
    assert watch.next_deadline_s == math.inf
    watch.heard(ALICE, 1.0)
    watch.heard(BOB, 2.0)
    assert (watch.next_deadline_s, watch.timeout_s) == (6.0, 5.0)
    assert [watch.silent(now_s) for now_s in (5.99, 6.0 - 5e-10, 7.0)] == [[], [ALICE], [ALICE, BOB]]
    watch.keep({BOB})
    assert watch.next_deadline_s == 7.0
    watch.delay(2.5)
    assert (watch.next_deadline_s, watch.silent(9.4)) == (9.5, [])
    off = SilenceWatch(0.0)
    off.heard(ALICE, 1.0)
    assert (off.next_deadline_s, off.silent(1e9)) == (math.inf, [])
