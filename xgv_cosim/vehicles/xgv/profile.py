"""The XGV as a vehicle profile: what the rest of the program needs to know of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from jaus.vehicle_mode import SafetyMode
from xgv_cosim.actuation import Driver
from xgv_cosim.errors import ScenarioError
from xgv_cosim.injection import InjectionKind
from xgv_cosim.vehicles.base import (
    Assumption,
    InjectionEffect,
    ModeInputs,
    Resolution,
    StopSettings,
    VehicleModeReport,
    VehicleReadings,
)
from xgv_cosim.vehicles.transmitter import Transmitter
from xgv_cosim.vehicles.xgv import modes, reports, tables
from xgv_cosim.vehicles.xgv.assumptions import ledger
from xgv_cosim.vehicles.xgv.devices import EFFECTS, XgvDevices
from xgv_cosim.vehicles.xgv.endpoint import XgvEndpoint
from xgv_cosim.vehicles.xgv.errors import CONTROLLER_FAILED, ERRORS
from xgv_cosim.vehicles.xgv.settings import PauseSteering, XgvSettings

if TYPE_CHECKING:
    from xgv_cosim.vehicles.xgv.wire.node import XgvOnTheWire

BOTH_MANUAL = modes.MANUAL_STEERING | modes.MANUAL_SPEED


class XgvProfile:
    """One group of XGVs with the same settings. Implements ``vehicles.base.VehicleProfile``.

    Args:
        settings: Settings of the group.
        seed: Seed of the run; which frames of the SafeStop's radio are lost follows from it.
    """

    def __init__(self, settings: XgvSettings | None = None, seed: int = 1) -> None:
        self.settings = XgvSettings() if settings is None else settings
        self.seed = seed

    @property
    def name(self) -> str:
        """Return ``xgv``."""
        return "xgv"

    @property
    def effects(self) -> Mapping[InjectionKind, InjectionEffect]:
        """Return what each supported injection does."""
        return EFFECTS

    @property
    def base_device_bits(self) -> int:
        """Return the safety devices of a car to which nothing happens: SafeStop link good (XGV-42)."""
        return modes.LINK_GOOD

    @property
    def hardware_override_bits(self) -> int:
        """Return bit 8: only the emergency manual override acts without the controller (XGV-30, XGV-67)."""
        return modes.EMERGENCY_OVERRIDE_ENGAGED

    @property
    def stop_settings(self) -> StopSettings:
        """Return how both pauses stop the car (XGV-33, XGV-35, XGV-36)."""
        return StopSettings(
            decel_mps2=self.settings.pause_decel_mps2,
            hold_brake=self.settings.pause_hold_brake,
            centres_without_command=self.settings.pause_no_command_steering is PauseSteering.CENTRE,
            brake_needs_engine=self.settings.engine_brake_assist_lost,
        )

    @property
    def controller_failure_code(self) -> int:
        """Return 9156, module communication: the nearest code to a controller without valid numbers."""
        return CONTROLLER_FAILED

    def new_endpoint(
        self,
        vehicle_id: str,  # noqa: ARG002 - the protocol's
        now_s: float,  # noqa: ARG002 - likewise
        subsystem: int = 1,
    ) -> XgvEndpoint:
        """Return the endpoint of a car that was just bound: nobody in control, both drivers in standby."""
        return XgvEndpoint(self.settings, subsystem)

    def on_the_wire(
        self, vehicle_id: str, subsystem: int, readings: VehicleReadings, now_s: float
    ) -> XgvOnTheWire:
        """Return the car as a node with its six components (XGV-08)."""
        from xgv_cosim.vehicles.xgv.wire.node import XgvOnTheWire  # noqa: PLC0415 - dear to import

        return XgvOnTheWire(vehicle_id, subsystem, readings, self.settings.firmware, now_s)

    def new_devices(
        self, vehicle_id: str, now_s: float, transmitter: Transmitter | None = None
    ) -> XgvDevices:
        """Return the safety devices of a car to which nothing but its transmitter happens."""
        key = f"{self.seed}/{vehicle_id}"
        return XgvDevices(self.settings, key, now_s, transmitter, vehicle_id)

    def resolve(self, inputs: ModeInputs) -> Resolution:
        """Return safety mode and axis control of all slots by table look-up."""
        return tables.resolve(inputs, self.settings.pause_no_command_steering)

    def vehicle_mode_report(
        self, control_mode: int, ready_mode: int, safety_mode: int, partial_mode: int, safety_devices: int
    ) -> VehicleModeReport | None:
        """Return the fields of Report Vehicle Mode, None where the firmware lacks it (XGV-45, XGV-53)."""
        return reports.vehicle_mode_report(
            control_mode,
            ready_mode,
            safety_mode,
            partial_mode,
            safety_devices,
            firmware=self.settings.firmware,
        )

    def secondary_status(self, partial_mode: int, safety_devices: int) -> int:
        """Return the secondary status of both drivers (XGV-46)."""
        return reports.secondary_status(partial_mode, safety_devices)

    def safety_mode_name(self, code: int) -> str:
        """Return for example ``estop_pause``; the reserved codes 3 to 7 are software pause too (XGV-50).

        Raises:
            ValueError: No safety mode has this code.
        """
        if SafetyMode.SOFTWARE_PAUSE <= code < SafetyMode.ESTOP_PAUSE:
            return SafetyMode.SOFTWARE_PAUSE.name.lower()
        return SafetyMode(code).name.lower()

    def is_pause(self, safety_mode: int) -> bool:
        """Return whether a safety mode is one of the two pauses (XGV-28); 2 to 7 are one of them (XGV-50)."""
        return SafetyMode.SOFTWARE_PAUSE <= safety_mode <= SafetyMode.ESTOP_PAUSE

    def validate_injection(self, kind: InjectionKind, code: int | None) -> None:
        """Check that an error comes with a code of the XGV, and nothing else with any (XGV-38).

        Raises:
            ScenarioError: The two do not fit together.
        """
        if kind is not InjectionKind.ERROR and code is not None:
            raise ScenarioError(f"{kind.value}: got code {code!r}, expected none; only error has one")
        if kind is InjectionKind.ERROR and code not in ERRORS:
            known = ", ".join(map(str, sorted(ERRORS)))
            raise ScenarioError(f"error: got code {code!r}, expected one that the XGV has: {known}")

    def validate_partial_mode(self, bits: int, driver: Driver, *, forced: bool = False) -> None:
        """Check a partial mode that the operator wants to set (XGV-40, XGV-41).

        Args:
            bits: Bit 0 manual steering, bit 1 manual speed.
            driver: Who sits in the car.
            forced: Allow a manual axis with nobody aboard.

        Raises:
            ScenarioError: Both axes manual without ``partial_allow_both``, a manual axis with nobody
                aboard, or other bits.
        """
        if bits & ~BOTH_MANUAL:
            raise ScenarioError(
                f"partial mode: got {bits!r}, expected 0 (full), 1 (manual steering), 2 (manual speed) "
                "or 3 (both)"
            )
        if bits == BOTH_MANUAL and not self.settings.partial_allow_both:
            raise ScenarioError(
                "partial mode: both axes manual is none of the three modes of the XGV; "
                "set xgv.partial.allow_both to allow it"
            )
        if bits and driver is Driver.NONE and not forced:
            raise ScenarioError(
                "partial mode: a manual axis with nobody aboard (bind.driver = none) leaves the car without "
                "anybody in control of it, and a pause without effect; put a driver aboard, or force it"
            )

    def assumptions(self) -> tuple[Assumption, ...]:
        """Return the ledger with the values in force."""
        return ledger(self.settings)
