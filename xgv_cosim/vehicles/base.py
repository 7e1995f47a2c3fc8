"""The shape of a vehicle profile: the mode machine of one make, tabulated for the fleet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from xgv_cosim.actuation import Driver
from xgv_cosim.columns import BoolColumn, UInt8Column, UInt16Column
from xgv_cosim.endpoint import Endpoint
from xgv_cosim.injection import InjectionKind


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
    driver_engaged: BoolColumn
    """True: the driver caused the release himself and has the released axes at once (XGV-64)."""
    in_run_state: BoolColumn
    """True: the profile's run state with a live command, which ends ``bind.start = handover``."""
    stop_demanded: BoolColumn
    """True: an emergency stop device asks for a stop, which acts even before the hand-over."""


@dataclass(frozen=True, slots=True)
class InjectionEffect:
    """What an injection does to one make of vehicle; all fields empty means nothing."""

    device_bits: int = 0
    """Safety-device bits that are set while it lasts."""
    raises_error: bool = False
    """The injection's ``code`` is raised while it lasts."""
    blocks_link: bool = False
    """Messages from the stack are lost while it lasts."""


@dataclass(frozen=True, slots=True)
class StopSettings:
    """How the profile's controlled stop is done."""

    decel_mps2: float
    """Constant deceleration, positive (XGV-36)."""
    hold_brake: float
    """Brake effort held at standstill, share 0 to 1 (XGV-33)."""
    centres_without_command: bool
    """Closed-loop steering without a live command goes straight instead of staying (XGV-35)."""


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
    def effects(self) -> Mapping[InjectionKind, InjectionEffect]:
        """Return what each supported injection does; a kind that is absent is unsupported."""
        ...

    @property
    def base_device_bits(self) -> int:
        """Return the safety-device bits of a vehicle to which nothing happens."""
        ...

    @property
    def stop_settings(self) -> StopSettings:
        """Return how a controlled stop is done."""
        ...

    @property
    def controller_failure_code(self) -> int:
        """Return the error code that a vehicle raises when its own controller fails."""
        ...

    def new_endpoint(self, vehicle_id: str, now_s: float) -> Endpoint:
        """Return the endpoint of a vehicle that was just powered up."""
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

    def validate_partial_mode(self, bits: int, driver: Driver) -> None:
        """Refuse a partial mode that makes no sense for this profile (XGV-41).

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
