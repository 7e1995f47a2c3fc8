"""Long random conversations with one component, against a model in a few lines."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
    run_state_machine_as_test,
)

from jaus import component as jaus_component
from jaus.address import JausAddress
from jaus.component import (
    Component,
    ComponentStatus,
    ControlChanged,
    ControlConfirmed,
    ControlRejected,
    StatusChanged,
    StatusCommand,
    StatusCommandRefused,
)
from tests.jaus.status_words import status_in_words

CLIENTS = [JausAddress(1, node, 4, 1) for node in (2, 3, 4)]


class ComponentConversation(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        self.component = Component(JausAddress(1, 1, 33, 1), ComponentStatus.STANDBY)
        self.holder: JausAddress | None = None
        self.authority = -1
        self.status = ComponentStatus.STANDBY

    @initialize(status=st.sampled_from(ComponentStatus))
    def begin(self, status: ComponentStatus) -> None:
        self.component = Component(JausAddress(1, 1, 33, 1), status)
        self.status = status

    @rule(sender=st.sampled_from(CLIENTS), authority=st.integers(0, 3) | st.integers(0, 255))
    def request(self, sender: JausAddress, authority: int) -> None:
        outcomes = self.component.request_control(sender, authority)
        wins = self.holder in {None, sender} or authority > self.authority
        told = [outcome for outcome in outcomes if not isinstance(outcome, ControlChanged)]
        if not wins:
            assert outcomes == [ControlRejected(sender)]
            return
        loser = [] if self.holder in {None, sender} else [ControlRejected(self.holder)]
        assert told == [*loser, ControlConfirmed(sender)]
        self.authority = max(authority, self.authority) if self.holder == sender else authority
        self.holder = sender

    @rule(sender=st.sampled_from(CLIENTS))
    def release(self, sender: JausAddress) -> None:
        outcomes = self.component.release_control(sender)
        if sender == self.holder:
            self.holder, self.authority = None, -1
            assert [type(outcome) for outcome in outcomes] == [ControlChanged]
        else:
            assert outcomes == []

    @rule(sender=st.sampled_from(CLIENTS), authority=st.integers(0, 3) | st.integers(0, 255))
    def set_authority(self, sender: JausAddress, authority: int) -> None:
        outcomes = self.component.set_authority(sender, authority)
        if sender == self.holder and authority != self.authority:
            assert [type(outcome) for outcome in outcomes] == [ControlChanged]
            self.authority = authority
        else:
            assert outcomes == []

    @rule()
    def fail(self) -> None:
        self.component.fail()
        if self.status is not ComponentStatus.SHUTDOWN:
            self.status = ComponentStatus.FAILURE

    @rule(
        sender=st.sampled_from(CLIENTS),
        deputy=st.none() | st.sampled_from(CLIENTS),
        command=st.sampled_from(StatusCommand),
    )
    def command_status(self, sender: JausAddress, deputy: JausAddress | None, command: StatusCommand) -> None:
        """XGV-10, XGV-25, XGV-63: who may, and what becomes of it, both in words."""
        outcomes = self.component.command_status(command, sender, deputy=deputy)
        if self.holder is None:
            allowed = command is not StatusCommand.CLEAR_EMERGENCY
        elif sender == self.holder:
            allowed = True
        elif sender == deputy:
            allowed = command not in {StatusCommand.SHUTDOWN, StatusCommand.RESET}
        else:
            allowed = command is StatusCommand.SET_EMERGENCY
        if not allowed:
            assert [type(outcome) for outcome in outcomes] == [StatusCommandRefused]
            return
        before, self.status = self.status, status_in_words(self.status, command)
        assert outcomes == ([] if self.status is before else [StatusChanged(before, self.status)])

    @rule(commands=st.lists(st.sampled_from(StatusCommand), min_size=4, max_size=12))
    def command_status_in_a_row(self, commands: list[StatusCommand]) -> None:
        """By the one who may; so that every status meets every command in a run (XGV-21, XGV-25)."""
        for command in commands:
            self.command_status(self.holder or CLIENTS[0], None, command)
            assert self.component.status is self.status

    @rule()
    def finish_initialization(self) -> None:
        self.component.finish_initialization()
        if self.status is ComponentStatus.INITIALIZE:
            self.status = ComponentStatus.STANDBY

    @invariant()
    def agrees_with_the_model(self) -> None:
        """An illegal input changes nothing: neither controller, authority nor status."""
        assert self.component.controller == self.holder
        assert self.component.status is self.status
        if self.component.control is not None:
            assert self.component.control.authority == self.authority


TestComponentConversation = ComponentConversation.TestCase
TestComponentConversation.settings = settings(max_examples=60, stateful_step_count=40, deadline=None)


PLANTED = (
    (ComponentStatus.SHUTDOWN, StatusCommand.RESUME, ComponentStatus.READY),
    (ComponentStatus.EMERGENCY, StatusCommand.RESUME, ComponentStatus.READY),
    (ComponentStatus.FAILURE, StatusCommand.RESUME, ComponentStatus.READY),
    (ComponentStatus.READY, StatusCommand.SHUTDOWN, ComponentStatus.FAILURE),
    (ComponentStatus.READY, StatusCommand.STANDBY, ComponentStatus.READY),
    (ComponentStatus.STANDBY, StatusCommand.RESET, ComponentStatus.READY),
)
"""Wrong transitions: status, command, and what becomes of it."""


@pytest.mark.parametrize(("status", "command", "wrong"), PLANTED)
def test_the_machine_sees_wrong_transitions_xgv_21_xgv_25(
    status: ComponentStatus, command: StatusCommand, wrong: ComponentStatus, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The machine above must not be blind: each planted fault is found."""
    table: Mapping[object, object] = {**jaus_component.STATUS_TRANSITIONS, (status, command): wrong}
    monkeypatch.setattr(jaus_component, "STATUS_TRANSITIONS", MappingProxyType(table))
    seen = settings(
        max_examples=2000, deadline=None, derandomize=True, database=None, phases=[Phase.generate]
    )
    with pytest.raises(AssertionError):
        run_state_machine_as_test(ComponentConversation, settings=seen)
