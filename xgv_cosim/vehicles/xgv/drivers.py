"""Primitive Driver and Motion Profile Driver: who controls them. Their status: ``status.py``.

The Motion Profile Driver (MPD), once controlled, wants the Primitive Driver (PD) for itself: it asks
with its controller's authority, at once and then periodically, and gives the PD back when it loses its
own controller (XGV-17, XGV-19). A controller that falls silent loses control (XGV-65).
"""

from __future__ import annotations

import math

from jaus.address import ComponentId, JausAddress
from jaus.component import (
    Component,
    ComponentStatus,
    ControlChanged,
    ControlOutcome,
    ControlRejected,
    Standing,
)
from jaus.errors import LocalProtocolError
from xgv_cosim.endpoint import (
    CommandStatus,
    ControlPreempted,
    EndpointChanged,
    EndpointEvent,
    MessageRefused,
    ReleaseControl,
    RequestControl,
    SetAuthority,
)
from xgv_cosim.vehicles.xgv.reasons import COMPONENT_NAMES, holder_name
from xgv_cosim.vehicles.xgv.silence import SilenceWatch
from xgv_cosim.vehicles.xgv.status import DriverStatus

_ROUNDING_S = 1e-9
"""Deadlines are sums of floats; one this near is due."""


class Drivers:
    """The two components that take motion commands; they begin in standby.

    Args:
        subsystem: Subsystem number of their JAUS addresses.
        request_period_s: Time between two requests of the MPD for the PD (XGV-19).
        initialize_s: Time from Reset to standby.
        controller_timeout_s: Silence after which a controller loses control, 0: never (XGV-65).
    """

    def __init__(
        self,
        subsystem: int,
        request_period_s: float,
        initialize_s: float,
        controller_timeout_s: float = 0.0,
    ) -> None:
        self._request_period_s = request_period_s
        self.primitive = Component(
            JausAddress(subsystem, 1, ComponentId.PRIMITIVE_DRIVER, 1), ComponentStatus.STANDBY
        )
        self.profile = Component(
            JausAddress(subsystem, 1, ComponentId.MOTION_PROFILE_DRIVER, 1), ComponentStatus.STANDBY
        )
        self.by_id = {
            ComponentId.PRIMITIVE_DRIVER: self.primitive,
            ComponentId.MOTION_PROFILE_DRIVER: self.profile,
        }
        self._ask_s = math.inf
        """When the MPD asks for the PD next."""
        self.status = DriverStatus(self.by_id, initialize_s)
        self._silence = SilenceWatch(controller_timeout_s)
        self.loss = ""
        """Who lost control for another reason than a release, until somebody gets control anew."""

    @property
    def next_deadline_s(self) -> float:
        """Return when ``handle_deadline`` is due, ``inf`` for never."""
        return min(self._ask_s, self._silence.next_deadline_s, self.status.next_deadline_s)

    def delay(self, stopped_s: float) -> None:
        """Put every deadline off by a time in which the controller's clock stood still (XGV-67)."""
        self._ask_s += stopped_s
        self._silence.delay(stopped_s)
        self.status.delay(stopped_s)

    def heard(self, sender: JausAddress, now_s: float) -> None:
        """Take note of traffic of any kind (XGV-65)."""
        self._silence.heard(sender, now_s)
        self._silence.keep(self._clients)

    def standing(self, sender: JausAddress) -> Standing:
        """Return how ``sender`` stands to the Primitive Driver."""
        return self.primitive.standing_of(sender, deputy=self._deputy_of(self.primitive))

    def holder_name(self, controller: JausAddress | None) -> str:
        """Return who ``controller`` is, in words."""
        return holder_name(controller, self.by_id.values())

    def request_control(
        self, message: RequestControl, sender: JausAddress, now_s: float
    ) -> list[EndpointEvent]:
        """Take Request Component Control (XGV-20); a preempted controller has lost it by then."""
        component = self.by_id.get(message.component)
        if component is None:
            return [_refuse_component(message, message.component)]
        try:
            outcomes = component.request_control(sender, message.authority)
        except LocalProtocolError as error:
            return [MessageRefused(message, str(error))]
        if ControlRejected(sender) in outcomes and component.control is not None:
            return [
                MessageRefused(
                    message,
                    f"the {COMPONENT_NAMES[message.component]} is controlled by "
                    f"{self.holder_name(component.controller)} with authority {component.control.authority}; "
                    f"{message.authority} is not higher",
                )
            ]
        events = self._control_events(
            message.component, outcomes, f"requested with authority {message.authority}"
        )
        return events + self._follow(outcomes, component, now_s)

    def release_control(
        self, message: ReleaseControl, sender: JausAddress, now_s: float
    ) -> list[EndpointEvent]:
        """Take Release Component Control; from one who has no control it is a mere repeat (XGV-20)."""
        component = self.by_id.get(message.component)
        if component is None:
            return [_refuse_component(message, message.component)]
        outcomes = component.release_control(sender)
        return self._control_events(message.component, outcomes, "released") + self._follow(
            outcomes, component, now_s
        )

    def set_authority(self, message: SetAuthority, sender: JausAddress, now_s: float) -> list[EndpointEvent]:
        """Take Set Component Authority of the controller; the MPD tells the PD the same (XGV-19, XGV-20)."""
        component = self.by_id.get(message.component)
        if component is None:
            return [_refuse_component(message, message.component)]
        if component.controller != sender:
            holder = self.holder_name(component.controller)
            name = COMPONENT_NAMES[message.component]
            return [MessageRefused(message, f"{holder} controls the {name}, not {sender}")]
        try:
            outcomes = component.set_authority(sender, message.authority)
        except LocalProtocolError as error:
            return [MessageRefused(message, str(error))]
        if component is self.profile:
            self.primitive.set_authority(self.profile.address, message.authority)
            return self._follow(outcomes, component, now_s)
        return []

    def command_status(
        self, message: CommandStatus, sender: JausAddress, now_s: float
    ) -> list[EndpointEvent]:
        """Take a status command (XGV-25); the PD takes some also from the MPD's controller (XGV-63)."""
        component = self.by_id.get(message.component)
        if component is None:
            return [_refuse_component(message, message.component)]
        return self.status.command(message, sender, self._deputy_of(component), now_s)

    def handle_deadline(self, now_s: float) -> list[EndpointEvent]:
        """End initialisations that are due, and let the MPD ask for the PD again (XGV-19)."""
        events = self.status.handle_deadline(now_s)
        for silent in self._silence.silent(now_s):
            events += self._take_control_from(silent, now_s)
        if self._ask_s <= now_s + _ROUNDING_S:
            events += self._ask_for_primitive(now_s)
        self._silence.keep(self._clients)
        return events

    @property
    def _clients(self) -> set[JausAddress]:
        """Return who controls a driver from outside."""
        holders = {self.primitive.controller, self.profile.controller} - {self.profile.address}
        return {holder for holder in holders if holder is not None}

    def _take_control_from(self, controller: JausAddress, now_s: float) -> list[EndpointEvent]:
        """End the control of one who has fallen silent, over both drivers (XGV-65)."""
        reason = f"{controller} was silent for {self._silence.timeout_s:g} s and lost control"
        events: list[EndpointEvent] = []
        for component_id in (ComponentId.MOTION_PROFILE_DRIVER, ComponentId.PRIMITIVE_DRIVER):
            component = self.by_id[component_id]
            outcomes = component.release_control(controller)
            events += self._control_events(component_id, outcomes, reason)
            events += self._follow(outcomes, component, now_s)
        self.loss = reason
        return events

    def _deputy_of(self, component: Component) -> JausAddress | None:
        """Return who may resume ``component`` because he controls the MPD that controls it."""
        mpd_holds_it = component is self.primitive and component.controller == self.profile.address
        return self.profile.controller if mpd_holds_it else None

    def _follow(
        self, outcomes: list[ControlOutcome], component: Component, now_s: float
    ) -> list[EndpointEvent]:
        """Let the MPD draw the consequences of a change of control."""
        changes = [outcome for outcome in outcomes if isinstance(outcome, ControlChanged)]
        if not changes:
            return []
        self.loss = ""
        if component is self.profile:
            if self.profile.control is not None:
                return self._ask_for_primitive(now_s)
            self._ask_s = math.inf
            given_back = self.primitive.release_control(self.profile.address)
            return self._control_events(
                ComponentId.PRIMITIVE_DRIVER,
                given_back,
                "released: the Motion Profile Driver lost its controller",
            )
        # The PD changed hands under the MPD: whoever took it asked with more authority, or the
        # MPD waits for it and asks again at its own pace.
        if self.profile.control is not None and math.isinf(self._ask_s):
            self._ask_s = now_s + self._request_period_s
        return []

    def _ask_for_primitive(self, now_s: float) -> list[EndpointEvent]:
        """Let the MPD request the PD with its own controller's authority (XGV-17, XGV-19)."""
        self._ask_s = math.inf
        if self.profile.control is None:
            return []
        authority = self.profile.control.authority
        outcomes = self.primitive.request_control(self.profile.address, authority)
        if self.primitive.controller != self.profile.address:
            self._ask_s = now_s + self._request_period_s
        return self._control_events(
            ComponentId.PRIMITIVE_DRIVER, outcomes, f"requested with authority {authority}"
        )

    def _control_events(
        self, component: ComponentId, outcomes: list[ControlOutcome], reason: str
    ) -> list[EndpointEvent]:
        """Return an event if another one controls ``component`` now; a mere rise of authority is none."""
        events: list[EndpointEvent] = []
        for outcome in outcomes:
            if not isinstance(outcome, ControlChanged):
                continue
            before, after = (
                self.holder_name(None if control is None else control.controller)
                for control in (outcome.before, outcome.after)
            )
            if before != after:
                name = COMPONENT_NAMES[component]
                events.append(
                    EndpointChanged("component_control", f"{name}: {before}", f"{name}: {after}", (reason,))
                )
                if self._is_preemption(outcome):
                    events.append(ControlPreempted(f"{name}: {before}", f"{name}: {after}", (reason,)))
        return events

    def _is_preemption(self, change: ControlChanged) -> bool:
        """Return whether another client has the component now; the MPD has it for its own controller."""
        before, after = (
            None if control is None else self._client_of(control.controller)
            for control in (change.before, change.after)
        )
        return before is not None and after is not None and before != after

    def _client_of(self, controller: JausAddress) -> JausAddress | None:
        return self.profile.controller if controller == self.profile.address else controller


def _refuse_component(
    message: RequestControl | ReleaseControl | CommandStatus | SetAuthority, component: ComponentId
) -> MessageRefused:
    return MessageRefused(
        message,
        f"the {COMPONENT_NAMES[component]} takes no {type(message).__name__}; "
        "only the Primitive Driver and the Motion Profile Driver do",
    )
