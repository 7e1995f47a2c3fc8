"""The status of both drivers: what commands, time, failures and stops make of it (XGV-21, XGV-25, XGV-37).

Who controls the drivers is another matter (``drivers.py``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from jaus.address import ComponentId, JausAddress
from jaus.component import (
    Component,
    ComponentStatus,
    Standing,
    StatusChanged,
    StatusCommand,
    StatusCommandRefused,
)
from xgv_cosim.endpoint import CommandStatus, EndpointChanged, EndpointEvent, MessageRefused
from xgv_cosim.vehicles.xgv.reasons import COMPONENT_NAMES, holder_name

_ROUNDING_S = 1e-9
"""Deadlines are sums of floats; one this near is due."""


class DriverStatus:
    """Changes the status of the drivers and says so.

    Args:
        by_id: The drivers.
        initialize_s: Time from Reset to standby.
    """

    def __init__(self, by_id: Mapping[ComponentId, Component], initialize_s: float) -> None:
        self._by_id = by_id
        self._initialize_s = initialize_s
        self._initialized_s: dict[ComponentId, float] = {}
        """When a component that was reset goes to standby."""
        self._await_command: set[ComponentId] = set()
        """Set to standby by a pre-emption, until the new controller's first command (XGV-66)."""
        self.resume_refusal = ""
        """Why Resume is refused, empty if it is not (XGV-37)."""
        self.standby_reason = ""
        """Why the car itself has set its drivers to standby, until a client commands anew."""

    @property
    def next_deadline_s(self) -> float:
        """Return when ``handle_deadline`` is due, ``inf`` for never."""
        return min(self._initialized_s.values(), default=math.inf)

    def delay(self, stopped_s: float) -> None:
        """Put every deadline off by a time in which the controller's clock stood still (XGV-67)."""
        self._initialized_s = {name: due_s + stopped_s for name, due_s in self._initialized_s.items()}

    def command(
        self, message: CommandStatus, sender: JausAddress, deputy: JausAddress | None, now_s: float
    ) -> list[EndpointEvent]:
        """Take a status command for one of the drivers (XGV-25, XGV-63).

        Args:
            message: What is asked of which driver.
            sender: Who asks.
            deputy: Who controls the driver that controls this one.
            now_s: Simulation time.
        """
        component, name = self._by_id[message.component], COMPONENT_NAMES[message.component]
        command, status = message.command.name.lower().replace("_", " "), component.status
        if message.command is StatusCommand.RESUME and self.resume_refusal:
            return [MessageRefused(message, self.resume_refusal)]
        outcomes = component.command_status(message.command, sender, deputy=deputy)
        if any(isinstance(outcome, StatusCommandRefused) for outcome in outcomes):
            standing = component.standing_of(sender, deputy=deputy)
            return [MessageRefused(message, self._why_not_permitted(component, command, sender, standing))]
        self._await_command.discard(message.component)
        self.standby_reason = ""
        if message.command is StatusCommand.RESET:
            # A repeat does not begin anew: clients repeat until they see what they want.
            self._initialized_s.setdefault(message.component, now_s + self._initialize_s)
        elif component.status is not ComponentStatus.INITIALIZE:
            self._initialized_s.pop(message.component, None)
        if message.command is StatusCommand.RESUME and component.status is not ComponentStatus.READY:
            reason = f"resume acts in standby only; the {name} is in {status.name.lower()}"
            return [MessageRefused(message, reason)]
        return _events(message.component, outcomes, f"{command} from {sender}")

    def fail(self, component_id: ComponentId, reason: str) -> list[EndpointEvent]:
        """Put a component into failure, from which Resume does not lead out (XGV-21)."""
        self._initialized_s.pop(component_id, None)
        self._await_command.discard(component_id)
        return _events(component_id, self._by_id[component_id].fail(), reason)

    def stand_by(self, reason: str) -> list[EndpointEvent]:
        """Set the drivers that are ready to standby, until somebody resumes them (XGV-37)."""
        self._await_command.clear()
        return self._enter_standby(reason)

    def stand_by_for_command(self, reason: str) -> list[EndpointEvent]:
        """Set the drivers that are ready to standby, until a command is accepted (XGV-66)."""
        self._await_command |= {
            name for name, component in self._by_id.items() if component.status is ComponentStatus.READY
        }
        return self._enter_standby(reason)

    def command_accepted(self, sender: JausAddress) -> list[EndpointEvent]:
        """End the wait for a first command after a pre-emption (XGV-66)."""
        events: list[EndpointEvent] = []
        for component_id in [name for name in self._by_id if name in self._await_command]:
            events += self._send(component_id, StatusCommand.RESUME, f"first command of {sender}")
        if events:
            self.standby_reason = ""
        self._await_command.clear()
        return events

    def handle_deadline(self, now_s: float) -> list[EndpointEvent]:
        """End the initialisations that are due."""
        events: list[EndpointEvent] = []
        for component_id, due_s in tuple(self._initialized_s.items()):
            if due_s <= now_s + _ROUNDING_S:
                del self._initialized_s[component_id]
                events += _events(
                    component_id, self._by_id[component_id].finish_initialization(), "initialised"
                )
        return events

    def _enter_standby(self, reason: str) -> list[EndpointEvent]:
        events: list[EndpointEvent] = []
        for component_id in self._by_id:
            events += self._send(component_id, StatusCommand.STANDBY, reason)
        if events:
            self.standby_reason = reason
        return events

    def _send(self, component_id: ComponentId, command: StatusCommand, reason: str) -> list[EndpointEvent]:
        """Let the car itself command the status, with its controller's right."""
        component = self._by_id[component_id]
        sender = component.controller or component.address
        return _events(component_id, component.command_status(command, sender), reason)

    def _why_not_permitted(
        self, component: Component, command: str, sender: JausAddress, standing: Standing
    ) -> str:
        name = COMPONENT_NAMES[ComponentId(component.address.component)]
        if standing is Standing.NOBODY_CONTROLS:
            return f"only its controller may send {command} to the {name}, and it has none"
        holder = holder_name(component.controller, self._by_id.values())
        way_out = f"; release the {holder} first" if standing is Standing.DEPUTY else ""
        return f"{sender} may not send {command}: {holder} controls the {name}{way_out}"


def _events(
    component: ComponentId, outcomes: list[StatusChanged | StatusCommandRefused], reason: str
) -> list[EndpointEvent]:
    name = COMPONENT_NAMES[component]
    return [
        EndpointChanged(
            "component_status",
            f"{name}: {outcome.before.name.lower()}",
            f"{name}: {outcome.after.name.lower()}",
            (reason,),
        )
        for outcome in outcomes
        if isinstance(outcome, StatusChanged)
    ]
