"""Random conversations of three clients with one XGV: what must hold at every moment."""

from __future__ import annotations

import math

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from xgv_cosim.commands import MotionProfile, WrenchEffort
from xgv_cosim.endpoint import (
    CommandAccepted,
    CommandDropped,
    CommandStatus,
    EndpointChanged,
    EndpointEvent,
    MessageRefused,
    ReleaseControl,
    RequestControl,
    StackMessage,
)
from xgv_cosim.vehicles.xgv.endpoint import XgvEndpoint
from xgv_cosim.vehicles.xgv.modes import ControlMode, ReadyMode
from xgv_cosim.vehicles.xgv.settings import XgvSettings

PD = ComponentId.PRIMITIVE_DRIVER
MPD = ComponentId.MOTION_PROFILE_DRIVER
MPD_ADDRESS = JausAddress(1, 1, MPD, 1)
clients = st.sampled_from([JausAddress(1, node, 4, 1) for node in (2, 3, 4)])
drivers = st.sampled_from([PD, MPD])


class Conversation(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        self.endpoint = XgvEndpoint(XgvSettings())
        self.now_s = 0.0
        self.expires_s = math.inf
        self.commander: JausAddress | None = None
        self.shown = {"control_mode": "software_pause", "ready_mode": "software_pause"}

    def hear(self, events: list[EndpointEvent]) -> None:
        """Follow the events as the simulation does."""
        for event in events:
            if isinstance(event, CommandAccepted):
                self.expires_s = event.expires_s
            elif isinstance(event, CommandDropped):
                self.expires_s = math.inf
            elif isinstance(event, EndpointChanged) and event.kind in self.shown:
                assert event.before == self.shown[event.kind] != event.after
                self.shown[event.kind] = event.after

    def say(self, message: StackMessage, sender: JausAddress) -> list[EndpointEvent]:
        before = self.state()
        events = self.endpoint.receive(message, sender, self.now_s)
        if any(isinstance(event, MessageRefused) for event in events):
            assert len(events) == 1
            assert self.state() == before  # an illegal input changes nothing
        self.hear(events)
        return events

    def state(self) -> tuple[object, ...]:
        endpoint = self.endpoint
        return (
            endpoint.control_mode,
            endpoint.ready_mode,
            endpoint.component_status,
            endpoint.component_controller,
            endpoint.errors,
            endpoint.next_deadline_s,
        )

    @rule(sender=clients, component=drivers, authority=st.integers(0, 2))
    def request(self, sender: JausAddress, component: ComponentId, authority: int) -> None:
        self.say(RequestControl(component, authority), sender)

    @rule(sender=clients, component=drivers)
    def release(self, sender: JausAddress, component: ComponentId) -> None:
        self.say(ReleaseControl(component), sender)

    @rule(sender=clients, component=drivers, command=st.sampled_from(StatusCommand))
    def command_status(self, sender: JausAddress, component: ComponentId, command: StatusCommand) -> None:
        self.say(CommandStatus(component, command), sender)

    @rule(sender=clients)
    def motion(self, sender: JausAddress) -> None:
        held = self.endpoint.component_controller[MPD] == sender
        fits = self.endpoint.control_mode is ControlMode.MOTION_PROFILES
        events = self.say(MotionProfile(5.0, 1.0, 0.0, 0.1, 0.4), sender)
        assert isinstance(events[0], CommandAccepted) == (held and fits)  # XGV-10, XGV-16

    @rule(sender=clients)
    def wrench(self, sender: JausAddress) -> None:
        held = self.endpoint.component_controller[PD] == sender
        fits = self.endpoint.control_mode is ControlMode.WRENCH_EFFORTS
        events = self.say(WrenchEffort(0.1, 0.0, 0.0), sender)
        assert isinstance(events[0], CommandAccepted) == (held and fits)

    @rule(wait_s=st.sampled_from([0.1, 0.5, 1.0]))
    def wait(self, wait_s: float) -> None:
        until_s = self.now_s + wait_s
        while min(self.endpoint.next_deadline_s, self.expires_s) <= until_s:
            if self.expires_s <= self.endpoint.next_deadline_s:
                self.now_s, self.expires_s = self.expires_s, math.inf
                assert self.endpoint.command_expired(self.now_s) != []  # XGV-43: raised, every time
            else:
                self.now_s = self.endpoint.next_deadline_s
                self.hear(self.endpoint.handle_deadline(self.now_s))
                assert self.endpoint.next_deadline_s > self.now_s
        self.now_s = until_s

    @invariant()
    def control_mode_follows_from_the_holders(self) -> None:
        """XGV-15, XGV-18: nothing but the holders decides."""
        pd, mpd = (self.endpoint.component_controller[name] for name in (PD, MPD))
        expected = ControlMode.SOFTWARE_PAUSE
        if mpd is None and pd is not None:
            expected = ControlMode.WRENCH_EFFORTS
        elif mpd is not None and pd == MPD_ADDRESS:
            expected = ControlMode.MOTION_PROFILES
        assert self.endpoint.control_mode is expected
        assert self.shown["control_mode"] == expected.name.lower()

    @invariant()
    def ready_mode_follows_from_the_status(self) -> None:
        """XGV-22 to XGV-24."""
        needed = {
            ControlMode.WRENCH_EFFORTS: {PD},
            ControlMode.MOTION_PROFILES: {PD, MPD},
        }.get(self.endpoint.control_mode)
        status = self.endpoint.component_status
        ready = needed is not None and all(status[name] is ComponentStatus.READY for name in needed)
        assert (self.endpoint.ready_mode is ReadyMode.READY) == ready
        assert self.shown["ready_mode"] == self.endpoint.ready_mode.name.lower()

    @invariant()
    def mpd_wants_the_pd_exactly_while_it_is_controlled(self) -> None:
        """XGV-17, XGV-19: it holds the PD, or waits for its next request; uncontrolled it has let go."""
        pd, mpd = (self.endpoint.component_controller[name] for name in (PD, MPD))
        if mpd is None:
            assert pd != MPD_ADDRESS
        elif pd != MPD_ADDRESS:
            assert self.now_s < self.endpoint.next_deadline_s <= self.now_s + 1.0


TestConversation = Conversation.TestCase
TestConversation.settings = settings(max_examples=60, stateful_step_count=40, deadline=None)
