"""Settings of the XGV: what its user may set, and which reading of an open rule is in force."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, is_dataclass
from enum import StrEnum

from xgv_cosim.actuation import LostFunction
from xgv_cosim.errors import ScenarioError
from xgv_cosim.vehicles.xgv.errors import ERRORS, near_codes
from xgv_cosim.vehicles.xgv.rearm import RearmCause, RearmSettings
from xgv_cosim.vehicles.xgv.safestop import SafeStopSettings

EFFECT_FIELDS = {
    "errors_effect_brake": LostFunction.BRAKE,
    "errors_effect_steering": LostFunction.STEERING,
    "errors_effect_throttle": LostFunction.THROTTLE,
    "errors_effect_speed_feedback": LostFunction.SPEED_FEEDBACK,
}
"""Fields of ``XgvSettings`` that name the errors which take a function away (``xgv.errors.effect``)."""


class PauseSteering(StrEnum):
    """What the wheels do in a pause without a live steering command (XGV-35)."""

    HOLD_CURVATURE = "hold_curvature"
    """Keep the path curvature."""
    HOLD_ANGLE = "hold_angle"
    """Keep the road-wheel angle."""
    CENTRE = "centre"
    """Go straight."""


class ErrorLatch(StrEnum):
    """Which errors outlast their cause (XGV-38)."""

    HARDWARE = "hardware"
    """Those of the car's own hardware, until the operator clears them."""
    NONE = "none"
    """None: each goes with its cause."""


class Firmware(StrEnum):
    """Firmware of the controller; 1.0 and 1.1 lack Report Vehicle Mode (XGV-53)."""

    V1_0 = "1.0"
    V1_1 = "1.1"
    V1_2 = "1.2"


class BothClients(StrEnum):
    """Control mode when one client controls both drivers (XGV-18, figure A)."""

    SOFTWARE_PAUSE = "software_pause"
    WRENCH_EFFORTS = "wrench_efforts"


@dataclass(frozen=True, slots=True)
class XgvSettings:
    """Settings of one group of XGVs.

    Raises:
        ScenarioError: A value is not a finite number, or outside its range.
    """

    pause_decel_mps2: float = 2.5
    """Constant deceleration of both pauses (XGV-12, XGV-36)."""
    pause_hold_brake: float = 0.5
    """Brake effort held after a pause has stopped the car, share 0 to 1 (XGV-33)."""
    pause_no_command_steering: PauseSteering = PauseSteering.HOLD_CURVATURE
    """Steering of a pause without a live command (XGV-35)."""
    control_mode_both_clients: BothClients = BothClients.SOFTWARE_PAUSE
    """Control mode when one client controls both drivers (XGV-18)."""
    wrench_timeout_s: float = 0.5
    """Wrench efforts end this long after the last one (XGV-43)."""
    partial_allow_both: bool = False
    """Both axes may be manual (XGV-41)."""
    mpd_request_period_s: float = 1.0
    """The Motion Profile Driver asks for the Primitive Driver this often (XGV-19)."""
    initialize_s: float = 1.0
    """A component goes to standby this long after Reset."""
    controller_timeout_s: float = 5.0
    """A controller that is silent for so long loses control, 0: never (XGV-65)."""
    nonmotion_needs_control: bool = False
    """The engine is switched in a pause only by a controller (XGV-34)."""
    motion_allow_many: bool = False
    """Set Motion Profile may carry several motions (XGV-70)."""
    disable_engine_off: bool = False
    """E-stop disable switches the engine off (XGV-31)."""
    engine_brake_assist_lost: bool = False
    """With the engine off the brake has lost its assistance (XGV-31)."""
    errors_latch: ErrorLatch = ErrorLatch.HARDWARE
    """Which errors outlast their cause (XGV-38)."""
    errors_effect_brake: tuple[int, ...] = (9109, 9110, 9111)
    """Errors that take the brake away (XGV-38)."""
    errors_effect_steering: tuple[int, ...] = (9103, 9104)
    """Errors that take the steering away (XGV-38)."""
    errors_effect_throttle: tuple[int, ...] = (9106,)
    """Errors that take the throttle away (XGV-38)."""
    errors_effect_speed_feedback: tuple[int, ...] = (9107, 9108)
    """Errors that take the measured speed away (XGV-38)."""
    firmware: Firmware = Firmware.V1_2
    """Firmware of the controller (XGV-53)."""
    safestop: SafeStopSettings = field(default_factory=SafeStopSettings)
    """Radio and receivers of the SafeStop (XGV-42)."""
    rearm: RearmSettings = field(default_factory=RearmSettings)
    """What the car needs before it moves again after a stop (XGV-37)."""

    def __post_init__(self) -> None:
        problems = tuple(self._problems())
        if problems:
            raise ScenarioError("the XGV's settings are wrong:", problems)
        # Plain strings, as scenario files carry them, become members.
        object.__setattr__(self, "pause_no_command_steering", PauseSteering(self.pause_no_command_steering))
        object.__setattr__(self, "control_mode_both_clients", BothClients(self.control_mode_both_clients))
        object.__setattr__(self, "errors_latch", ErrorLatch(self.errors_latch))
        object.__setattr__(self, "firmware", Firmware(self.firmware))

    def _problems(self) -> list[str]:
        problems = []
        for name, above, limit in (
            ("pause_decel_mps2", 0.0, 20.0),
            ("wrench_timeout_s", 0.0, 60.0),
            ("mpd_request_period_s", 0.0, 60.0),
        ):
            value = getattr(self, name)
            if not (math.isfinite(value) and above < value <= limit):
                problems.append(f"{name}: got {value!r}, expected more than {above:g} and at most {limit:g}")
        if not 0.0 <= self.pause_hold_brake <= 1.0:
            problems.append(f"pause_hold_brake: got {self.pause_hold_brake!r}, expected a share from 0 to 1")
        if not 0.0 <= self.initialize_s <= 60.0:
            problems.append(f"initialize_s: got {self.initialize_s!r}, expected 0 to 60")
        if not 0.0 <= self.controller_timeout_s <= 3600.0:
            problems.append(f"controller_timeout_s: got {self.controller_timeout_s!r}, expected 0 to 3600")
        for name in EFFECT_FIELDS:
            problems += [
                f"{name}: got {code!r}, expected codes that the XGV has, for example {near_codes(code)}"
                for code in getattr(self, name)
                if code not in ERRORS
            ]
        for name, kind in (
            ("pause_no_command_steering", PauseSteering),
            ("control_mode_both_clients", BothClients),
            ("errors_latch", ErrorLatch),
            ("firmware", Firmware),
        ):
            value = getattr(self, name)
            if value not in list(kind):
                problems.append(f"{name}: got {value!r}, expected one of {', '.join(kind)}")
        return problems

    @property
    def error_effects(self) -> dict[int, int]:
        """Return bits of ``actuation.LostFunction`` by error code (XGV-38)."""
        effects: dict[int, int] = {}
        for name, function in EFFECT_FIELDS.items():
            for code in getattr(self, name):
                effects[code] = effects.get(code, 0) | function
        return effects

    def as_text(self) -> dict[str, str]:
        """Return each key with its value in force, for the ledger; those of a group as ``group.key``."""
        values: dict[str, str] = {}
        for own in fields(self):
            value = getattr(self, own.name)
            if is_dataclass(value):
                parts = (part.name for part in fields(value))
                values |= {f"{own.name}.{name}": str(getattr(value, name)) for name in parts}
            else:
                values[own.name] = str(value)
        return values | {f"rearm.{cause}": str(self.rearm.of(cause)) for cause in RearmCause}
