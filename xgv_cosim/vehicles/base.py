"""The shape of a vehicle profile: the mode machine of one make, tabulated for the fleet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from xgv_cosim.actuation import Driver
from xgv_cosim.columns import BoolColumn, UInt8Column, UInt16Column
from xgv_cosim.commands import Signals
from xgv_cosim.endpoint import Endpoint, EndpointChanged, StackMessage
from xgv_cosim.injection import InjectionKind, OperatorAction
from xgv_cosim.observation import DeviceReading
from xgv_cosim.vehicles.transmitter import Transmitter

if TYPE_CHECKING:  # every message of JAUS is made when they are imported
    from jaus.messages import Message
    from jaus.node import Node


class ModeInputs(NamedTuple):
    """What the mode machine reads of each slot; every column has shape ``(n,)``."""

    safety_devices: UInt16Column
    control_mode: UInt8Column
    ready_mode: UInt8Column
    partial_mode: UInt8Column
    command_kind: UInt8Column
    """``commands.CommandKind`` of the live command."""


class Resolution(NamedTuple):
    """What the mode machine answers for each slot; every column has shape ``(n,)``."""

    safety_mode: UInt8Column
    longitudinal: UInt8Column
    """``actuation.Longitudinal``; FREE means released, whoever then takes the axis."""
    lateral: UInt8Column
    """``actuation.Lateral``; FREE means released, whoever then takes the axis."""
    speed_engaged: BoolColumn
    """True: the driver himself caused the release of the speed and has it at once (XGV-64)."""
    steering_engaged: BoolColumn
    """True: likewise the steering; one axis says nothing about the other."""
    in_run_state: BoolColumn
    """True: the profile's run state with a live command, which ends ``bind.start = handover``."""
    stop_demanded: BoolColumn
    """True: an emergency stop device asks for a stop, which acts even before the hand-over."""
    pausing: BoolColumn
    """True: the mode is a pause; where the speed is manual, whether it stops is up to a human (XGV-41)."""


@dataclass(frozen=True, slots=True)
class InjectionEffect:
    """What an injection does to one make of vehicle."""

    text: str
    """What it does, in words."""
    device_bits: int = 0
    """Safety-device bits that it sets while it lasts, unless something stands between (a radio, a fault)."""
    raises_error: bool = False
    """The injection's ``code`` is raised while it lasts."""


class VehicleModeReport(NamedTuple):
    """What a vehicle reports of its modes: the fields of Report Vehicle Mode (XGV-47 to XGV-52)."""

    version: int
    control_mode: int
    ready_mode: int
    safety_mode: int
    partial_mode: int
    """Bit 0 manual steering, bit 1 manual speed."""
    safety_devices: int


class VehicleReadings(Protocol):
    """What a vehicle measures and computes of itself, read when a report is made of it."""

    @property
    def time_s(self) -> float:
        """Return the simulation time."""
        ...

    @property
    def speed_mps(self) -> float:
        """Return the measured forward speed (XGV-03)."""
        ...

    @property
    def curvature_per_m(self) -> float:
        """Return the curvature of the rear axle's path, positive counter-clockwise."""
        ...

    @property
    def wheel_speeds_mps(self) -> tuple[float, float, float, float]:
        """Return the speeds of front left, front right, rear left and rear right wheel."""
        ...

    @property
    def throttle(self) -> float:
        """Return the throttle in effect, share 0 to 1."""
        ...

    @property
    def brake(self) -> float:
        """Return the brake effort in effect, share 0 to 1."""
        ...

    @property
    def steering(self) -> float:
        """Return the share of the greatest road-wheel angle, positive counter-clockwise."""
        ...

    @property
    def devices(self) -> DeviceReading:
        """Return gear, engine and parking brake."""
        ...

    @property
    def signals(self) -> Signals:
        """Return lights and horn as the computer has them."""
        ...

    @property
    def errors(self) -> frozenset[int]:
        """Return the codes that are raised, warnings included."""
        ...

    @property
    def vehicle_mode(self) -> VehicleModeReport:
        """Return the fields of Report Vehicle Mode."""
        ...

    @property
    def secondary_status(self) -> int:
        """Return the vehicle-specific word of Report Component Status (XGV-46)."""
        ...

    @property
    def component_status(self) -> Mapping[ComponentId, ComponentStatus]:
        """Return the status of each component that has one of its own."""
        ...

    @property
    def component_controller(self) -> Mapping[ComponentId, JausAddress | None]:
        """Return who controls each of them, None: nobody."""
        ...

    @property
    def component_authority(self) -> Mapping[ComponentId, int]:
        """Return with which authority each of them is controlled, 0: nobody controls it."""
        ...


class VehicleOnTheWire(Protocol):
    """One vehicle as a node of a JAUS network."""

    node: Node

    def command_of(self, message: Message) -> StackMessage | None:
        """Return what a message commands, None if it is no command of this make.

        Raises:
            CommandError: Its values mean nothing.
        """
        ...

    def clears_errors(self, message: Message) -> bool:
        """Return whether a message asks for latched errors to be cleared (XGV-38)."""
        ...


class SafetyDevices(Protocol):
    """The safety devices of one vehicle: what is pressed, open, lost or broken. Reads no clock (sans-IO).

    It also knows the faults of the controller itself, and what those stops need before the vehicle may
    move again. The simulation brings it injections and the time, and writes what it answers.
    """

    @property
    def bits(self) -> int:
        """Return the device word, without the bits that the endpoint sets (XGV-52)."""
        ...

    @property
    def errors(self) -> frozenset[int]:
        """Return the error codes that devices and injections raise now."""
        ...

    @property
    def is_active(self) -> bool:
        """Return whether the vehicle's system is booted (XGV-01)."""
        ...

    @property
    def is_frozen(self) -> bool:
        """Return whether the controller is frozen: booted, but nothing is computed (XGV-67)."""
        ...

    @property
    def hears_stack(self) -> bool:
        """Return whether messages from the stack reach the vehicle."""
        ...

    @property
    def next_deadline_s(self) -> float:
        """Return when ``handle_deadline`` is due, ``inf`` for never."""
        ...

    @property
    def resume_refusal(self) -> str:
        """Return why Resume is refused now, empty if it is not (XGV-37)."""
        ...

    def apply(
        self, kind: InjectionKind, code: int | None, now_s: float, *, begins: bool
    ) -> list[EndpointChanged]:
        """Let a supported injection begin or end; return what changed, for the event log."""
        ...

    def handle_deadline(self, now_s: float) -> list[EndpointChanged]:
        """Do what is due, for example open a relay because the radio has fallen silent."""
        ...

    def operate(self, action: OperatorAction, now_s: float) -> list[EndpointChanged]:
        """Let the operator do something at the vehicle."""
        ...

    def follow_stops(self, endpoint_bits: int) -> str:
        """Take note of the stops in force; return why the vehicle goes to standby, or nothing (XGV-37).

        Args:
            endpoint_bits: Device bits that the endpoint sets, such as "errors detected".
        """
        ...

    def control_preempted(self) -> str:
        """Take note of a pre-emption; the answer is that of ``follow_stops`` (XGV-66)."""
        ...

    def masked_stops(self, safety_mode: int, *, handed_over: bool = True) -> Mapping[str, str]:
        """Return each stop demand that has no effect in this mode, and what masks it (XGV-68).

        Args:
            safety_mode: In force now.
            handed_over: False: the world's driver still has both axes, and no pause brakes.
        """
        ...

    def masked_override(self, safety_mode: int) -> str:
        """Return why an override that is engaged has no effect in this mode, empty if it has (XGV-13)."""
        ...

    def reasons(self, computed: tuple[str, ...]) -> tuple[str, ...]:
        """Return why the safety mode is what it is, given what the endpoint says of its computation."""
        ...


@dataclass(frozen=True, slots=True)
class StopSettings:
    """How the profile's controlled stop is done."""

    decel_mps2: float
    """Constant deceleration, positive (XGV-36)."""
    hold_brake: float
    """Brake effort held at standstill, share 0 to 1 (XGV-33)."""
    centres_without_command: bool
    """Closed-loop steering without a live command goes straight instead of staying (XGV-35)."""
    brake_needs_engine: bool = False
    """With the engine off a brake effort gives ``unassisted_brake_share`` of its deceleration (XGV-31)."""


@dataclass(frozen=True, slots=True)
class Assumption:
    """One reading that the sources leave open, for the ledger of every report."""

    rule: str
    """Rule id, for example ``XGV-43``."""
    key: str
    """Configuration key, or empty for a reading without one."""
    value: str
    evidence: str
    """``D`` derived, ``E`` external evidence, ``proposed``."""
    text: str
    facts: tuple[str, ...]
    """Facts of the event log (``kind`` or ``kind:after``) any of which shows that it was exercised."""


class VehicleProfile(Protocol):
    """One make of vehicle. A fourth profile is a new folder and nothing else."""

    @property
    def name(self) -> str:
        """Return the profile's name in scenarios."""
        ...

    @property
    def seed(self) -> int:
        """Return the seed of the run, from which a vehicle's own draws follow."""
        ...

    @property
    def effects(self) -> Mapping[InjectionKind, InjectionEffect]:
        """Return what each supported injection does; a kind that is absent is unsupported."""
        ...

    @property
    def base_device_bits(self) -> int:
        """Return the safety-device bits of a vehicle to which nothing happens."""
        ...

    def is_pause(self, safety_mode: int) -> bool:
        """Return whether a safety mode is a controlled stop, as ``Resolution.pausing`` of the fleet."""
        ...

    @property
    def hardware_override_bits(self) -> int:
        """Return the device bits that act with no software in the loop, frozen controller or not (XGV-67)."""
        ...

    @property
    def stop_settings(self) -> StopSettings:
        """Return how a controlled stop is done."""
        ...

    @property
    def controller_failure_code(self) -> int:
        """Return the error code that a vehicle raises when its own controller fails."""
        ...

    def new_endpoint(self, vehicle_id: str, now_s: float, subsystem: int = 1) -> Endpoint:
        """Return the endpoint of a vehicle that was just powered up.

        Args:
            vehicle_id: The vehicle.
            now_s: When that was.
            subsystem: Of its JAUS addresses, 1 to 254.
        """
        ...

    def on_the_wire(
        self, vehicle_id: str, subsystem: int, readings: VehicleReadings, now_s: float
    ) -> VehicleOnTheWire | None:
        """Return a vehicle as others on a JAUS network see it, None if it speaks no JAUS.

        Args:
            vehicle_id: The vehicle.
            subsystem: Its subsystem number, 1 to 254.
            readings: What it knows of itself, always of the moment at which it is read.
            now_s: When it appears.
        """
        ...

    def new_devices(
        self, vehicle_id: str, now_s: float, transmitter: Transmitter | None = None
    ) -> SafetyDevices:
        """Return the safety devices of a vehicle that was just bound: nothing pressed, open or broken.

        Args:
            vehicle_id: The vehicle; under its id it holds the controls of its transmitter.
            now_s: When it is bound.
            transmitter: Of the wireless stop, where several vehicles share one; None: one of its own.
        """
        ...

    def resolve(self, inputs: ModeInputs) -> Resolution:
        """Return modes and axis control for all slots by table look-up."""
        ...

    def validate_injection(self, kind: InjectionKind, code: int | None) -> None:
        """Refuse an error without a code that this profile has, and a code where none belongs.

        Raises:
            ScenarioError: The two do not fit together.
        """
        ...

    def vehicle_mode_report(
        self, control_mode: int, ready_mode: int, safety_mode: int, partial_mode: int, safety_devices: int
    ) -> VehicleModeReport | None:
        """Return what the vehicle reports of its modes; None: it has no such report, or is silent."""
        ...

    def secondary_status(self, partial_mode: int, safety_devices: int) -> int:
        """Return the vehicle-specific word of Report Component Status (XGV-46)."""
        ...

    def validate_partial_mode(self, bits: int, driver: Driver, *, forced: bool = False) -> None:
        """Refuse a partial mode that makes no sense for this profile (XGV-41).

        ``forced`` allows a manual axis with nobody aboard.

        Raises:
            ScenarioError: Both axes manual where that is not allowed, or a manual axis without a driver.
        """
        ...

    def safety_mode_name(self, code: int) -> str:
        """Return the name of a safety mode code in events and reports."""
        ...

    def assumptions(self) -> tuple[Assumption, ...]:
        """Return every open reading with its value in force."""
        ...
