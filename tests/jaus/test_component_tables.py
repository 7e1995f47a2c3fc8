"""Component control and status, each pair of situation and message, against RA 3.3 behaviour in words."""

from __future__ import annotations

from itertools import product

import pytest

from jaus.address import JausAddress
from jaus.component import (
    CONTROL_TRANSITIONS,
    PERMITTED_STATUS_COMMANDS,
    STATUS_TRANSITIONS,
    Component,
    ComponentStatus,
    Control,
    ControlChanged,
    ControlConfirmed,
    ControlInput,
    ControlRejected,
    Situation,
    Standing,
    StatusChanged,
    StatusCommand,
    StatusCommandRefused,
)
from jaus.errors import LocalProtocolError
from tests.jaus.status_words import status_in_words

OWN = JausAddress(1, 1, 33, 1)
ALICE = JausAddress(1, 2, 4, 1)
BOB = JausAddress(1, 3, 4, 1)
DEPUTY = JausAddress(1, 4, 4, 1)


def controlled_by(controller: JausAddress, authority: int = 6) -> Component:
    component = Component(OWN, ComponentStatus.STANDBY)
    component.request_control(controller, authority)
    return component


def in_status(status: ComponentStatus) -> Component:
    component = Component(OWN, status)
    component.request_control(ALICE, 6)
    return component


def test_status_wire_numbers_xgv_21() -> None:
    assert {status.name: int(status) for status in ComponentStatus} == {
        "INITIALIZE": 0,
        "READY": 1,
        "STANDBY": 2,
        "SHUTDOWN": 3,
        "FAILURE": 4,
        "EMERGENCY": 5,
    }


def test_control_table_is_total_xgv_20() -> None:
    assert set(CONTROL_TRANSITIONS) == set(product(Situation, ControlInput))


def test_request_of_a_free_component_is_confirmed_xgv_20() -> None:
    component = Component(OWN)
    assert component.request_control(ALICE, 6) == [
        ControlConfirmed(ALICE),
        ControlChanged(None, Control(ALICE, 6)),
    ]


def test_authority_0_takes_a_free_component_xgv_20() -> None:
    component = Component(OWN)
    component.request_control(ALICE, 0)
    assert component.controller == ALICE


@pytest.mark.parametrize("authority", [0, 5, 6])
def test_repeat_of_the_controller_only_confirms_xgv_20(authority: int) -> None:
    component = controlled_by(ALICE, 6)
    assert component.request_control(ALICE, authority) == [ControlConfirmed(ALICE)]
    assert component.control == Control(ALICE, 6)


def test_controller_may_raise_its_authority_xgv_20() -> None:
    component = controlled_by(ALICE, 6)
    outcomes = component.request_control(ALICE, 255)
    assert outcomes == [ControlConfirmed(ALICE), ControlChanged(Control(ALICE, 6), Control(ALICE, 255))]


@pytest.mark.parametrize("authority", [0, 5, 6])
def test_request_without_higher_authority_is_rejected_xgv_19(authority: int) -> None:
    component = controlled_by(ALICE, 6)
    assert component.request_control(BOB, authority) == [ControlRejected(BOB)]
    assert component.control == Control(ALICE, 6)


def test_higher_authority_preempts_and_tells_the_loser_first_xgv_19() -> None:
    component = controlled_by(ALICE, 6)
    assert component.request_control(BOB, 7) == [
        ControlRejected(ALICE),
        ControlConfirmed(BOB),
        ControlChanged(Control(ALICE, 6), Control(BOB, 7)),
    ]


def test_release_of_the_controller_xgv_20() -> None:
    component = controlled_by(ALICE)
    assert component.release_control(ALICE) == [ControlChanged(Control(ALICE, 6), None)]
    assert component.release_control(ALICE) == []


def test_release_of_another_changes_nothing_xgv_20() -> None:
    component = controlled_by(ALICE, 0)
    assert component.release_control(BOB) == []
    assert component.controller == ALICE


@pytest.mark.parametrize("authority", [-1, 256])
def test_authority_must_fit_into_a_byte(authority: int) -> None:
    with pytest.raises(LocalProtocolError, match="0 to 255"):
        Component(OWN).request_control(ALICE, authority)


@pytest.mark.parametrize(("status", "command"), list(product(ComponentStatus, StatusCommand)))
def test_every_status_command_of_the_controller_xgv_25(
    status: ComponentStatus, command: StatusCommand
) -> None:
    component = in_status(status)
    outcomes = component.command_status(command, ALICE)
    after = status_in_words(status, command)
    assert component.status is after
    assert outcomes == ([] if after is status else [StatusChanged(status, after)])
    assert STATUS_TRANSITIONS.get((status, command), status) is after


@pytest.mark.parametrize("command", list(StatusCommand))
@pytest.mark.parametrize(
    ("sender", "standing", "permitted"),
    [
        (ALICE, Standing.CONTROLLER, set(StatusCommand)),
        (
            DEPUTY,
            Standing.DEPUTY,
            {
                StatusCommand.RESUME,
                StatusCommand.STANDBY,
                StatusCommand.SET_EMERGENCY,
                StatusCommand.CLEAR_EMERGENCY,
            },
        ),
        (BOB, Standing.BYSTANDER, {StatusCommand.SET_EMERGENCY}),
    ],
)
def test_who_may_command_the_status_xgv_10_xgv_63(
    command: StatusCommand, sender: JausAddress, standing: Standing, permitted: set[StatusCommand]
) -> None:
    component = in_status(ComponentStatus.READY)
    outcomes = component.command_status(command, sender, deputy=DEPUTY)
    assert PERMITTED_STATUS_COMMANDS[standing] == permitted
    if command in permitted:
        assert component.status is status_in_words(ComponentStatus.READY, command)
    else:
        assert outcomes == [StatusCommandRefused(command, standing)]
        assert component.status is ComponentStatus.READY


@pytest.mark.parametrize("command", list(StatusCommand))
def test_without_controller_anyone_commands_but_clears_no_emergency_xgv_63(command: StatusCommand) -> None:
    component = Component(OWN, ComponentStatus.EMERGENCY)
    component.command_status(command, BOB)
    expected = (
        ComponentStatus.EMERGENCY
        if command is StatusCommand.CLEAR_EMERGENCY
        else status_in_words(ComponentStatus.EMERGENCY, command)
    )
    assert component.status is expected


@pytest.mark.parametrize("status", list(ComponentStatus))
def test_initialisation_ends_in_standby_and_touches_no_other_status(status: ComponentStatus) -> None:
    component = Component(OWN, status)
    component.finish_initialization()
    is_initializing = status is ComponentStatus.INITIALIZE
    assert component.status is (ComponentStatus.STANDBY if is_initializing else status)


def test_controller_sets_its_own_authority_up_and_down_xgv_20() -> None:
    component = controlled_by(ALICE, 6)
    for authority in (255, 0):
        before = component.control
        assert component.set_authority(ALICE, authority) == [
            ControlChanged(before, Control(ALICE, authority))
        ]
    assert component.set_authority(ALICE, 0) == []
    assert component.request_control(BOB, 1) == [
        ControlRejected(ALICE),
        ControlConfirmed(BOB),
        ControlChanged(Control(ALICE, 0), Control(BOB, 1)),
    ]


def test_others_set_no_authority_xgv_20() -> None:
    component = controlled_by(ALICE, 6)
    assert component.set_authority(BOB, 255) == []
    assert component.control == Control(ALICE, 6)
    free = Component(OWN)
    assert free.set_authority(ALICE, 6) == []
    assert free.control is None


@pytest.mark.parametrize("authority", [-1, 256])
def test_set_authority_must_fit_into_a_byte(authority: int) -> None:
    component = controlled_by(ALICE)
    with pytest.raises(LocalProtocolError, match="0 to 255"):
        component.set_authority(ALICE, authority)


@pytest.mark.parametrize("status", ComponentStatus)
def test_failure_is_entered_from_all_but_shutdown_and_not_left_by_resume_xgv_21(
    status: ComponentStatus,
) -> None:
    component = in_status(status)
    outcomes = component.fail()
    if status is ComponentStatus.SHUTDOWN:
        assert outcomes == []
        assert component.status is ComponentStatus.SHUTDOWN
        return
    expected = [] if status is ComponentStatus.FAILURE else [StatusChanged(status, ComponentStatus.FAILURE)]
    assert outcomes == expected
    assert component.command_status(StatusCommand.RESUME, ALICE) == []
    assert component.status is ComponentStatus.FAILURE
    component.command_status(StatusCommand.RESET, ALICE)
    assert component.status is ComponentStatus.INITIALIZE


@pytest.mark.parametrize("status", ComponentStatus)
def test_emergency_is_set_and_cleared_in_every_status_xgv_25(status: ComponentStatus) -> None:
    """As OpenJAUS does it: out of failure and shutdown as well, by anyone and by the controller."""
    component = in_status(status)
    component.command_status(StatusCommand.SET_EMERGENCY, BOB)
    assert component.status is ComponentStatus.EMERGENCY
    component = in_status(status)
    component.command_status(StatusCommand.CLEAR_EMERGENCY, ALICE)
    assert component.status is ComponentStatus.STANDBY
