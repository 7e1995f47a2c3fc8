"""Random conversations of three clients with one XGV: what must hold at every moment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule, run_state_machine_as_test

from jaus import component as jaus_component
from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from tests.jaus.test_component_machine import PLANTED, status_in_words
from xgv_cosim.actuation import Gear, LostFunction
from xgv_cosim.commands import DiscreteDevices, MotionProfile, MotionQueue, Signals, Turn, WrenchEffort
from xgv_cosim.endpoint import (
    CommandAccepted,
    CommandDropped,
    CommandStatus,
    DevicesCommanded,
    EndpointChanged,
    EndpointEvent,
    MessageRefused,
    ReleaseControl,
    RequestControl,
    SetAuthority,
    StackMessage,
)
from xgv_cosim.vehicles.xgv.endpoint import XgvEndpoint
from xgv_cosim.vehicles.xgv.errors import ERRORS
from xgv_cosim.vehicles.xgv.modes import PARTIAL_MODE_ACTS_IN, PAUSES
from xgv_cosim.vehicles.xgv.reasons import COMPONENT_NAMES
from xgv_cosim.vehicles.xgv.settings import XgvSettings

PD = ComponentId.PRIMITIVE_DRIVER
MPD = ComponentId.MOTION_PROFILE_DRIVER
MPD_ADDRESS = JausAddress(1, 1, MPD, 1)
clients = st.sampled_from([JausAddress(1, node, 4, 1) for node in (2, 3, 4)])
drivers = st.sampled_from([PD, MPD])


class Conversation(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        self.endpoint = XgvEndpoint(XgvSettings(motion_allow_many=True))
        self.now_s = 0.0
        self.expires_s = math.inf
        self.commander: JausAddress | None = None
        self.safety_mode = SafetyMode.SOFTWARE_PAUSE
        self.heard_s: dict[JausAddress, float] = {}
        self.lasting: set[int] = set()
        self.latched: set[int] = set()
        self.status = dict.fromkeys((PD, MPD), ComponentStatus.STANDBY)
        self.initialized_s: dict[ComponentId, float] = {}
        self.waiting: set[ComponentId] = set()
        self.shown = {"control_mode": "software_pause", "ready_mode": "software_pause", "signals": "off"}

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
        before, holders = self.state(), self.holders()
        events = self.endpoint.receive(message, sender, self.now_s)
        self.heard_s[sender] = self.now_s
        if any(isinstance(event, CommandAccepted) for event in events):
            self.commander = sender
        raised = {event.after for event in events if isinstance(event, EndpointChanged)}
        assert not raised & {"9157", "9158"}  # XGV-43, XGV-66: no message lets a command time out
        if any(isinstance(event, MessageRefused) for event in events):
            assert all(isinstance(event, MessageRefused | DevicesCommanded) for event in events)
            assert self.state() == before  # an illegal input changes nothing
        self.hear(events)
        self.follow_preemption(events, holders)
        if any(isinstance(event, CommandAccepted) for event in events):
            self.resume_waiting()
        return events

    def holders(self) -> dict[ComponentId, JausAddress | None]:
        """Return which client has each driver, itself or through the MPD."""
        held = self.endpoint.component_controller
        return {name: held[MPD] if client == MPD_ADDRESS else client for name, client in held.items()}

    def follow_preemption(
        self, events: list[EndpointEvent], before: Mapping[ComponentId, JausAddress | None]
    ) -> None:
        """XGV-66: a command that a pre-emption ends leaves the drivers in standby, unless all is paused."""
        after = self.holders()
        taken = any(None not in (before[name], after[name]) and before[name] != after[name] for name in after)
        dropped = any(isinstance(event, CommandDropped) for event in events)
        if taken and dropped and self.endpoint.control_mode is not ControlMode.SOFTWARE_PAUSE:
            ready = {name for name, status in self.status.items() if status is ComponentStatus.READY}
            self.status |= dict.fromkeys(ready, ComponentStatus.STANDBY)
            self.waiting |= ready

    def resume_waiting(self) -> None:
        """XGV-66: the first command ends what a pre-emption began, unless a client commanded the status."""
        for name in self.waiting:
            self.status[name] = status_in_words(self.status[name], StatusCommand.RESUME)
        self.waiting.clear()

    def may_command(self, sender: JausAddress, component: ComponentId, command: StatusCommand) -> bool:
        """XGV-10, XGV-25, XGV-63, in words."""
        held = self.endpoint.component_controller
        if held[component] is None:
            return command is not StatusCommand.CLEAR_EMERGENCY
        if held[component] == sender or command is StatusCommand.SET_EMERGENCY:
            return True
        drives_through_mpd = held[component] == MPD_ADDRESS and held[MPD] == sender
        return drives_through_mpd and command not in {StatusCommand.SHUTDOWN, StatusCommand.RESET}

    def state(self) -> tuple[object, ...]:
        endpoint = self.endpoint
        return (
            endpoint.control_mode,
            endpoint.ready_mode,
            endpoint.component_status,
            endpoint.component_controller,
            endpoint.component_authority,
            endpoint.errors,
            endpoint.signals,
        )

    @rule(sender=clients, component=drivers, authority=st.integers(0, 3))
    def set_authority(self, sender: JausAddress, component: ComponentId, authority: int) -> None:
        held = self.endpoint.component_controller[component] == sender
        events = self.say(SetAuthority(component, authority), sender)
        assert any(isinstance(event, MessageRefused) for event in events) is not held
        if held:
            assert self.endpoint.component_authority[component] == authority

    @rule(sender=clients, gear=st.sampled_from(Gear), engine_on=st.booleans())
    def devices(self, sender: JausAddress, gear: Gear, engine_on: bool) -> None:
        """XGV-09, XGV-34: only the PD's own controller shifts, and never in a pause."""
        events = self.say(DiscreteDevices(gear, engine_on), sender)
        commanded = [event for event in events if isinstance(event, DevicesCommanded)]
        shifts = any(event.gear is not None for event in commanded)
        assert shifts == (
            self.safety_mode is SafetyMode.DRIVE_BY_WIRE
            and self.endpoint.control_mode is ControlMode.WRENCH_EFFORTS
            and self.endpoint.component_controller[PD] == sender
        )
        switches = any(event.engine_on is not None for event in commanded)
        held = sender in self.endpoint.component_controller.values()
        if self.safety_mode in PAUSES:
            assert switches
        if self.safety_mode is SafetyMode.DRIVE_BY_WIRE and not held:
            assert not switches

    @rule(sender=clients, sets=st.booleans())
    def parking_brake(self, sender: JausAddress, sets: bool) -> None:
        """XGV-09, XGV-34: set in every pause, by anyone; released by a controller in drive-by-wire only."""
        events = self.say(DiscreteDevices(parking_brake=sets), sender)
        moves = any(isinstance(event, DevicesCommanded) for event in events)
        held = sender in self.endpoint.component_controller.values()
        assert moves or any(isinstance(event, MessageRefused) for event in events)
        if self.safety_mode in PAUSES:
            assert moves is sets
        elif self.safety_mode is not SafetyMode.DRIVE_BY_WIRE or not held:
            assert not moves

    @rule(sender=clients, turn=st.sampled_from(Turn))
    def signals(self, sender: JausAddress, turn: Turn) -> None:
        self.say(Signals(turn=turn), sender)
        if self.safety_mode in PARTIAL_MODE_ACTS_IN:
            assert self.endpoint.signals.turn is turn  # XGV-10: from anyone
        else:
            assert self.endpoint.signals.turn is Turn.OFF  # XGV-31

    @rule(mode=st.sampled_from(sorted(set(SafetyMode) - {SafetyMode.INACTIVE})))
    def enter(self, mode: SafetyMode) -> None:
        self.safety_mode = mode
        self.hear(self.endpoint.safety_mode_entered(mode, self.now_s))

    @rule(code=st.sampled_from([9109, 9106, 9150, 9138, 9175, 9156]))
    def raise_error(self, code: int) -> None:
        if code == 9156 and code not in self.lasting | self.latched:  # XGV-21: the MPD fails
            self.waiting.discard(MPD)
            self.initialized_s.pop(MPD, None)
            if self.status[MPD] is not ComponentStatus.SHUTDOWN:
                self.status[MPD] = ComponentStatus.FAILURE
        self.hear(self.endpoint.raise_error(code, self.now_s))
        self.lasting.add(code)
        self.latched.discard(code)

    @rule(code=st.sampled_from([9109, 9106, 9150, 9138, 9175, 9156]))
    def end_error(self, code: int) -> None:
        self.hear(self.endpoint.clear_error(code, self.now_s))
        if code in self.lasting and code not in {9138, 9175}:
            self.latched.add(code)
        self.lasting.discard(code)

    @rule()
    def operator_clears(self) -> None:
        self.hear(self.endpoint.clear_errors(self.now_s))
        self.latched.clear()

    @rule(sender=clients, component=drivers, authority=st.integers(0, 2))
    def request(self, sender: JausAddress, component: ComponentId, authority: int) -> None:
        self.say(RequestControl(component, authority), sender)

    @rule(sender=clients, component=drivers)
    def release(self, sender: JausAddress, component: ComponentId) -> None:
        self.say(ReleaseControl(component), sender)

    @rule(sender=clients, component=drivers, command=st.sampled_from(StatusCommand))
    def command_status(self, sender: JausAddress, component: ComponentId, command: StatusCommand) -> None:
        """XGV-21, XGV-25: one who may not, and a Resume that does not lead to ready, are told so."""
        allowed = self.may_command(sender, component, command)
        events = self.say(CommandStatus(component, command), sender)
        before = self.status[component]
        after = self.status[component] = status_in_words(before, command) if allowed else before
        is_idle_resume = command is StatusCommand.RESUME and after is not ComponentStatus.READY
        refused = any(isinstance(event, MessageRefused) for event in events)
        assert refused == (not allowed or is_idle_resume)
        changes = [event.after for event in self.statuses(events)]
        assert changes == ([] if after is before else [f"{COMPONENT_NAMES[component]}: {after.name.lower()}"])
        if not allowed:
            return
        self.waiting.discard(component)
        if command is StatusCommand.RESET:
            self.initialized_s.setdefault(component, self.now_s + 1.0)
        elif after is not ComponentStatus.INITIALIZE:
            self.initialized_s.pop(component, None)

    @rule(component=drivers, commands=st.lists(st.sampled_from(StatusCommand), min_size=8, max_size=20))
    def holder_commands_status(self, component: ComponentId, commands: list[StatusCommand]) -> None:
        """By whoever may, in a row, so that every status meets every command in a run."""
        sender = self.holders()[component] or JausAddress(1, 2, 4, 1)
        for command in commands:
            self.command_status(sender, component, command)
            self.status_is_what_commands_made_of_it()

    @staticmethod
    def statuses(events: list[EndpointEvent]) -> list[EndpointChanged]:
        return [e for e in events if isinstance(e, EndpointChanged) and e.kind == "component_status"]

    @rule(sender=clients)
    def motion(self, sender: JausAddress) -> None:
        held = self.endpoint.component_controller[MPD] == sender
        fits = self.endpoint.control_mode is ControlMode.MOTION_PROFILES
        events = self.say(MotionProfile(5.0, 1.0, 0.0, 0.1, 0.4), sender)
        assert isinstance(events[0], CommandAccepted) == (held and fits)  # XGV-10, XGV-16

    @rule(sender=clients, count=st.integers(2, 4))
    def queue(self, sender: JausAddress, count: int) -> None:
        self.say(MotionQueue((MotionProfile(5.0, 1.0, 0.0, 0.1, 0.2),) * count), sender)

    @rule(sender=clients)
    def wrench(self, sender: JausAddress) -> None:
        held = self.endpoint.component_controller[PD] == sender
        fits = self.endpoint.control_mode is ControlMode.WRENCH_EFFORTS
        events = self.say(WrenchEffort(0.1, 0.0, 0.0), sender)
        assert isinstance(events[0], CommandAccepted) == (held and fits)

    @rule(wait_s=st.sampled_from([0.1, 0.5, 1.0, 3.0]))
    def wait(self, wait_s: float) -> None:
        until_s = self.now_s + wait_s
        while min(self.endpoint.next_deadline_s, self.expires_s) <= until_s:
            if self.expires_s <= self.endpoint.next_deadline_s:
                self.now_s, self.expires_s = self.expires_s, math.inf
                events = self.endpoint.command_expired(self.now_s)
                assert len(events) == 1  # XGV-43: the next motion, or the error, every time
                self.hear(events)
            else:
                self.now_s = self.endpoint.next_deadline_s
                holders = self.holders()
                events = self.endpoint.handle_deadline(self.now_s)
                self.hear(events)
                self.initialise()
                self.follow_preemption(events, holders)
                assert self.endpoint.next_deadline_s > self.now_s
        self.now_s = until_s

    def initialise(self) -> None:
        """XGV-25: a driver that was reset is in standby a second later."""
        for name in [name for name, due_s in self.initialized_s.items() if due_s <= self.now_s + 1e-9]:
            del self.initialized_s[name]
            if self.status[name] is ComponentStatus.INITIALIZE:
                self.status[name] = ComponentStatus.STANDBY

    @invariant()
    def status_is_what_commands_made_of_it(self) -> None:
        """XGV-21, XGV-25, XGV-66: for both drivers; the endpoint is asked for nothing but the result."""
        assert self.endpoint.component_status == self.status

    @invariant()
    def only_a_controllers_command_is_in_force(self) -> None:
        """XGV-10, XGV-66, XGV-70: it ends with his control, however he loses it."""
        if self.expires_s < math.inf:
            assert self.commander in self.endpoint.component_controller.values()

    @invariant()
    def nobody_silent_controls_anything(self) -> None:
        """XGV-65."""
        for client in self.endpoint.component_controller.values():
            if client is not None and client != MPD_ADDRESS:
                assert self.now_s - self.heard_s[client] < 5.0

    @invariant()
    def errors_last_as_long_as_cause_or_latch(self) -> None:
        """XGV-38: and the bit, and what they take away, follow from them."""
        endpoint = self.endpoint
        assert endpoint.errors - {9143, 9144, 9157, 9158, 9178} == self.lasting | self.latched
        assert (endpoint.device_bits == 128) == any(ERRORS[code].pauses for code in endpoint.errors)
        lost = LostFunction.BRAKE if 9109 in endpoint.errors else 0
        lost |= LostFunction.THROTTLE if 9106 in endpoint.errors else 0
        assert endpoint.lost_functions == lost
        assert (9178 in endpoint.errors) == (endpoint.ready_mode is not ReadyMode.READY)

    @invariant()
    def mpd_holds_the_pd_with_its_own_authority(self) -> None:
        """XGV-19."""
        if self.endpoint.component_controller[PD] == MPD_ADDRESS:
            authority = self.endpoint.component_authority
            assert authority[PD] == authority[MPD]

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
        status = self.status
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


@pytest.mark.parametrize(("status", "command", "wrong"), PLANTED)
def test_the_conversation_sees_wrong_transitions_xgv_21_xgv_25(
    status: ComponentStatus, command: StatusCommand, wrong: ComponentStatus, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The machine above must not be blind to the status: each planted fault is found."""
    table: Mapping[object, object] = {**jaus_component.STATUS_TRANSITIONS, (status, command): wrong}
    monkeypatch.setattr(jaus_component, "STATUS_TRANSITIONS", MappingProxyType(table))
    # As many as may be needed: Hypothesis draws from constants of whatever modules are loaded, so that which
    # example finds the fault depends on the tests that ran before in this process.
    seen = settings(
        max_examples=2000, deadline=None, derandomize=True, database=None, phases=[Phase.generate]
    )
    with pytest.raises(AssertionError):
        run_state_machine_as_test(Conversation, settings=seen)
