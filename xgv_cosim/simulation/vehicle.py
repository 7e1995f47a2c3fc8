"""A handle on one bound vehicle: reads its row, and turns operator verbs into requests."""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

from jaus.address import JausAddress
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.errors import CommandError, ScenarioError
from xgv_cosim.injection import InjectionKind, OperatorAction
from xgv_cosim.observation import DeviceReading
from xgv_cosim.simulation.drivetrain import reading_of
from xgv_cosim.simulation.reporting import reasons_of
from xgv_cosim.simulation.requests import PARTIAL_NAMES
from xgv_cosim.simulation.state import RunState
from xgv_cosim.vehicles.base import VehicleModeReport

OPERATOR_CONSOLE = JausAddress(254, 254, 1, 1)
"""Address under which messages from Python are sent; no stack has it."""


class Pose(NamedTuple):
    """Rear-axle pose; frame east-north-up, heading counter-clockwise from east."""

    x_m: float
    y_m: float
    heading_rad: float


class VehicleHandle:
    """What an operator sees and does. Verbs act at the start of the next step."""

    def __init__(self, state: RunState, vehicle_id: str) -> None:
        self._state = state
        self.vehicle_id = vehicle_id

    def __repr__(self) -> str:
        return f"<vehicle {self.vehicle_id!r}: {self.mode}, {self.speed_mps:.2f} m/s>"

    @property
    def mode(self) -> str:
        """Return the safety mode in force, for example ``"estop_pause"``."""
        vehicle = self._state.vehicle(self.vehicle_id)
        return vehicle.binding.profile.safety_mode_name(int(self._state.fleet.safety_mode[vehicle.slot]))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why the safety mode is what it is, strongest cause first."""
        return reasons_of(self._state, self._state.vehicle(self.vehicle_id))

    @property
    def speed_mps(self) -> float:
        """Return the measured forward speed."""
        fleet = self._state.fleet
        return float(fleet.motion.speed_mps[fleet.slot_of(self.vehicle_id)])

    @property
    def accel_mps2(self) -> float:
        """Return the measured longitudinal acceleration."""
        fleet = self._state.fleet
        return float(fleet.motion.accel_mps2[fleet.slot_of(self.vehicle_id)])

    @property
    def pose(self) -> Pose:
        """Return the measured pose of the rear axle."""
        fleet = self._state.fleet
        slot = fleet.slot_of(self.vehicle_id)
        motion = fleet.motion
        return Pose(float(motion.x_m[slot]), float(motion.y_m[slot]), float(motion.heading_rad[slot]))

    @property
    def devices(self) -> DeviceReading:
        """Return gear, engine and parking brake as they are now (XGV-60)."""
        return reading_of(self._state.fleet, self._state.fleet.slot_of(self.vehicle_id))

    def estop(self, state: Literal["pause", "stop", "run"]) -> None:
        """Use the SafeStop transmitter: ask for pause or stop, or for neither (XGV-12, XGV-28, XGV-31).

        Raises:
            ScenarioError: An unknown state.
        """
        if state not in {"pause", "stop", "run"}:
            raise ScenarioError(f"estop: got {state!r}, expected 'pause', 'stop' or 'run'")
        self._state.request(self.vehicle_id, InjectionKind.ESTOP_PAUSE, begins=state == "pause")
        self._state.request(self.vehicle_id, InjectionKind.ESTOP_DISABLE, begins=state == "stop")

    def override(self, *, engaged: bool = True) -> None:
        """Engage or disengage manual override (XGV-29)."""
        self._state.request(self.vehicle_id, InjectionKind.OVERRIDE, begins=engaged)

    def door(self, *, is_open: bool = True) -> None:
        """Open or close a door (XGV-27)."""
        self._state.request(self.vehicle_id, InjectionKind.DOOR, begins=is_open)

    def clear_errors(self) -> None:
        """Clear the latched errors whose cause is gone, as the car's operator does (XGV-38)."""
        self._state.errors_to_clear.append(self._state.vehicle(self.vehicle_id).vehicle_id)

    def send(self, message: StackMessage, sender: JausAddress = OPERATOR_CONSOLE) -> None:
        """Send a message to the vehicle's components, as a stack does; it arrives with the next step.

        A controller that sends nothing for ``xgv.control.controller_timeout_s`` loses control (XGV-65).

        Raises:
            CommandError: It is no message of the protocol.
        """
        if not isinstance(message, get_args(StackMessage)):
            known = ", ".join(kind.__name__ for kind in get_args(StackMessage))
            raise CommandError(f"send: got {message!r}, expected one of {known}")
        self._state.posted.append((self._state.vehicle(self.vehicle_id).vehicle_id, sender, message))

    def vehicle_mode_report(self) -> VehicleModeReport | None:
        """Return the fields of Report Vehicle Mode, None if the car does not report (XGV-45, XGV-53)."""
        vehicle, fleet = self._state.vehicle(self.vehicle_id), self._state.fleet
        slot = vehicle.slot
        if not vehicle.is_computing:  # silent (XGV-32, XGV-67)
            return None
        return vehicle.binding.profile.vehicle_mode_report(
            int(fleet.control_mode[slot]),
            int(fleet.ready_mode[slot]),
            int(fleet.safety_mode[slot]),
            int(fleet.partial_mode[slot]),
            int(fleet.safety_devices[slot]),
        )

    def inject(self, kind: str, *, begins: bool = True, code: int | None = None) -> None:
        """Begin or end anything of the injection vocabulary.

        Raises:
            ScenarioError: An unknown kind, an error without a known code, or a code that does not belong.
        """
        try:
            known = InjectionKind(kind)
        except ValueError:
            kinds = ", ".join(member.value for member in InjectionKind)
            raise ScenarioError(f"inject: got kind {kind!r}, expected one of {kinds}") from None
        self._state.vehicle(self.vehicle_id).binding.profile.validate_injection(known, code)
        self._state.request(self.vehicle_id, known, code, begins=begins)

    def rearm(self) -> None:
        """Allow Resume again after stops whose key says ``operator``, where their cause is gone (XGV-37)."""
        self._operate(OperatorAction.REARM)

    def initialise_steering(self) -> None:
        """Initialise the steering and press OK (XGV-69)."""
        self._operate(OperatorAction.INITIALISE_STEERING)

    def _operate(self, action: OperatorAction) -> None:
        self._state.operated.append((self._state.vehicle(self.vehicle_id).vehicle_id, action))

    def set_coupling(self, coupling: CouplingKind | Literal["free", "lane", "auto"]) -> None:
        """Choose how the vehicle is written into the world from the next step on.

        Raises:
            ScenarioError: An unknown coupling.
        """
        try:
            kind = CouplingKind(coupling)
        except ValueError:
            kinds = ", ".join(member.value for member in CouplingKind)
            raise ScenarioError(f"coupling: got {coupling!r}, expected one of {kinds}") from None
        self._state.couplings_requested.append((self._state.vehicle(self.vehicle_id).vehicle_id, kind))

    def set_partial_mode(
        self, mode: Literal["full", "manual_steering", "manual_speed", "both_manual"], *, force: bool = False
    ) -> None:
        """Choose at the vehicle's display which axes the computer controls (XGV-39, XGV-40).

        Args:
            mode: Which axes the computer controls.
            force: Allow a manual axis with nobody aboard (XGV-41).

        Raises:
            ScenarioError: An unknown mode, both manual where that is not allowed, or one that needs a
                driver where there is none (XGV-41).
        """
        if mode not in PARTIAL_NAMES:
            raise ScenarioError(f"partial mode: got {mode!r}, expected one of {', '.join(PARTIAL_NAMES)}")
        bits = PARTIAL_NAMES.index(mode)
        vehicle = self._state.vehicle(self.vehicle_id)
        vehicle.binding.profile.validate_partial_mode(bits, vehicle.binding.driver, forced=force)
        self._state.partial_requested.append((self.vehicle_id, bits))
