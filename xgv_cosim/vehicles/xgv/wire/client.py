"""The other end of the wire: a stack whose commands go out as datagrams, and who knows its car from reports.

What it sees of the road comes with the observation, as from sensors of its own; speed, modes, components and
devices are replaced by what the car has reported (XGV-44, XGV-45). In lockstep over the loopback transport
it drives as in the process, within the wire's quantisation.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from jaus.controller import Controller
from jaus.messages import Message
from jaus.messages.core import ReportComponentControl, ReportComponentStatus
from jaus.messages.platform import BrakeHornBit, PropulsionBit, ReportDiscreteDevices, ReportVelocityState
from jaus.messages.torc import ReportVehicleMode
from jaus.port import MessageReceived
from jaus.vehicle_mode import SafetyMode, safety_mode_of
from xgv_cosim.observation import DeviceReading, Observation, Stack
from xgv_cosim.vehicles.xgv.wire.commands import gear_of, message_of

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable

_PD, _MPD = ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER
REPORTS: tuple[tuple[type[Message], ComponentId], ...] = (
    (ReportVelocityState, ComponentId.VELOCITY_STATE_SENSOR),
    (ReportVehicleMode, ComponentId.NODE_MANAGER),
    (ReportComponentStatus, _PD),
    (ReportComponentStatus, _MPD),
    (ReportComponentControl, _PD),
    (ReportComponentControl, _MPD),
    (ReportDiscreteDevices, _PD),
)
"""What it asks the car for."""


class Line(Protocol):
    """Carries datagrams; ``jaus.transports`` has two."""

    def receive(self) -> list[tuple[bytes, Hashable]]:
        """Return the datagrams that have arrived, each with where it came from."""
        ...

    def send(self, datagrams: Iterable[tuple[bytes, Hashable]]) -> None:
        """Send datagrams, each to its place."""
        ...

    def close(self) -> None:
        """Give the place back."""
        ...


class StackOverTheWire:
    """A stack as a client of one car. Implements ``links.base.Link``: its commands arrive by the network.

    Args:
        stack: The driver.
        address: The JAUS address under which it speaks.
        subsystem: Of the car.
        line: Its transport.
        car: Where the car is, for that transport.
        period_s: How often it is asked to act.
    """

    def __init__(
        self,
        stack: Stack,
        address: JausAddress,
        subsystem: int,
        line: Line,
        car: Hashable,
        period_s: float,
    ) -> None:
        self._stack = stack
        self._subsystem = subsystem
        self._line = line
        self._client = Controller(address, car)
        self._latest: dict[tuple[type[Message], int], Message] = {}
        for report, component in REPORTS:
            # Twice as often as it looks: the wire rounds rates, and a trifle late would be a whole look late.
            self._client.subscribe(report, self._component(component), 2.0 / period_s, 0.0)
        self._line.send(self._client.datagrams_to_send(0.0))

    def poll(self) -> list[object]:
        """Return nothing: what it sends arrives by the network."""
        return []

    def take_faults(self) -> list[str]:
        """Return nothing: a stack that fails here fails the run."""
        return []

    def send(self, observation: Observation) -> None:
        """Let the stack act on what the car has reported, and send its commands."""
        now_s = observation.time_s
        self._read(now_s)
        for command in self._stack.act(self.reported(observation)):
            component, message = message_of(command)
            self._client.command(message, self._component(component), now_s)
        self._line.send(self._client.datagrams_to_send(now_s))

    def close(self) -> None:
        """Give the place back."""
        self._line.close()

    def reported(self, observation: Observation) -> Observation:
        """Return an observation with what the car has reported instead of what it is; unknown at first."""
        latest = self._latest
        velocity = latest.get((ReportVelocityState, ComponentId.VELOCITY_STATE_SENSOR))
        speed_mps = velocity.velocity_x_mps if isinstance(velocity, ReportVelocityState) else None
        mode = latest.get((ReportVehicleMode, ComponentId.NODE_MANAGER))
        devices = latest.get((ReportDiscreteDevices, _PD))
        return replace(
            observation,
            speed_mps=observation.speed_mps if speed_mps is None else speed_mps,
            safety_mode=_mode_name(mode),
            reasons=(),
            component_status={component: self._status(component) for component in (_PD, _MPD)},
            component_controller={component: self._controller(component) for component in (_PD, _MPD)},
            devices=_reading(devices) if isinstance(devices, ReportDiscreteDevices) else observation.devices,
        )

    def _component(self, component: ComponentId) -> JausAddress:
        return JausAddress(self._subsystem, 1, component, 1)

    def _read(self, now_s: float) -> None:
        for datagram, source in self._line.receive():
            self._client.receive_datagram(datagram, source, now_s)
        while (event := self._client.next_event()) is not None:
            if isinstance(event, MessageReceived) and isinstance(event.message, Message):
                self._latest[type(event.message), event.message.header.source.component] = event.message

    def _status(self, component: ComponentId) -> ComponentStatus:
        report = self._latest.get((ReportComponentStatus, component))
        if isinstance(report, ReportComponentStatus):
            return ComponentStatus(report.primary_status)
        return ComponentStatus.INITIALIZE

    def _controller(self, component: ComponentId) -> JausAddress | None:
        report = self._latest.get((ReportComponentControl, component))
        return report.controller if isinstance(report, ReportComponentControl) else None


def _mode_name(report: Message | None) -> str:
    code = report.safety_mode if isinstance(report, ReportVehicleMode) else SafetyMode.INACTIVE
    return safety_mode_of(code).name.lower()


def _reading(report: ReportDiscreteDevices) -> DeviceReading:
    """Return gear, engine and parking brake; where a shift is under way to, the wire does not tell."""
    gear = gear_of(report.gear or 0)
    return DeviceReading(
        gear=gear,
        gear_wanted=gear,
        engine_on=bool((report.propulsion_bits or 0) >> PropulsionBit.MAIN_PROPULSION & 1),
        parking_brake=bool((report.brake_horn_bits or 0) >> BrakeHornBit.PARKING_BRAKE & 1),
    )
