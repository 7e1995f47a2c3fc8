"""Short stories of clients and one XGV's endpoint, for several test modules."""

from __future__ import annotations

from jaus.address import ComponentId, JausAddress
from jaus.component import StatusCommand
from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from xgv_cosim.commands import MotionProfile, WrenchEffort
from xgv_cosim.endpoint import (
    CommandStatus,
    EndpointChanged,
    EndpointEvent,
    MessageRefused,
    ReleaseControl,
    RequestControl,
    StackMessage,
)
from xgv_cosim.vehicles.xgv.endpoint import XgvEndpoint
from xgv_cosim.vehicles.xgv.settings import XgvSettings

PD = ComponentId.PRIMITIVE_DRIVER
MPD = ComponentId.MOTION_PROFILE_DRIVER
ALICE = JausAddress(1, 2, 4, 1)
BOB = JausAddress(1, 3, 4, 1)
MOTION = MotionProfile(10.0, 2.0, 0.0, 0.1, 0.4)
WRENCH = WrenchEffort(0.2, 0.0, 0.1)
RESUME_PD = CommandStatus(PD, StatusCommand.RESUME)
RESUME_MPD = CommandStatus(MPD, StatusCommand.RESUME)
TO_MOTION = (ReleaseControl(PD), RequestControl(MPD), RESUME_PD, RESUME_MPD)
"""What the maker's own client sends for motion profiles, again at each of its 50 Hz ticks."""
TO_WRENCH = (ReleaseControl(MPD), RequestControl(PD), RESUME_PD)


class Story:
    """An endpoint, its time, and everything that it said."""

    def __init__(self, **settings: object) -> None:
        self.endpoint = XgvEndpoint(XgvSettings(**settings))  # type: ignore[arg-type]
        self.now_s = 0.0
        self.log: list[EndpointEvent] = []

    def say(self, *messages: StackMessage, sender: JausAddress = ALICE) -> list[EndpointEvent]:
        heard: list[EndpointEvent] = []
        for message in messages:
            heard += self.endpoint.receive(message, sender, self.now_s)
        self.log += heard
        return heard

    def wait_until(self, now_s: float) -> list[EndpointEvent]:
        heard: list[EndpointEvent] = []
        while self.endpoint.next_deadline_s <= now_s:
            heard += self.endpoint.handle_deadline(self.endpoint.next_deadline_s)
        self.now_s = now_s
        self.log += heard
        return heard

    def enter(self, mode: SafetyMode) -> list[EndpointEvent]:
        heard = self.endpoint.safety_mode_entered(mode, self.now_s)
        self.log += heard
        return heard

    @property
    def modes(self) -> tuple[ControlMode, ReadyMode]:
        return self.endpoint.control_mode, self.endpoint.ready_mode

    def changes(self, kind: str) -> list[tuple[str, str]]:
        return [
            (event.before, event.after)
            for event in self.log
            if isinstance(event, EndpointChanged) and event.kind == kind
        ]


def refusal(events: list[EndpointEvent]) -> str:
    assert len(events) == 1
    assert isinstance(events[0], MessageRefused)
    return events[0].reason
