"""Long random conversations with one component, against a model in a few lines."""

from __future__ import annotations

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

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

CLIENTS = [JausAddress(1, node, 4, 1) for node in (2, 3, 4)]


class ComponentConversation(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        self.component = Component(JausAddress(1, 1, 33, 1), ComponentStatus.STANDBY)
        self.holder: JausAddress | None = None
        self.authority = -1
        self.status = ComponentStatus.STANDBY

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

    @rule(sender=st.sampled_from(CLIENTS), command=st.sampled_from(StatusCommand))
    def command_status(self, sender: JausAddress, command: StatusCommand) -> None:
        outcomes = self.component.command_status(command, sender)
        if self.holder is None:
            allowed = command is not StatusCommand.CLEAR_EMERGENCY
        else:
            allowed = sender == self.holder or command is StatusCommand.SET_EMERGENCY
        if not allowed:
            assert [type(outcome) for outcome in outcomes] == [StatusCommandRefused]
            return
        changed = [outcome for outcome in outcomes if isinstance(outcome, StatusChanged)]
        assert [change.before for change in changed] == [self.status] * len(changed)
        self.status = self.component.status
        assert [change.after for change in changed] == [self.status] * len(changed)

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
