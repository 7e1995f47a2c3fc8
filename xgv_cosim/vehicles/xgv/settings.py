"""Settings of the XGV: what its user may set, and which reading of an open rule is in force."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from enum import StrEnum

from xgv_cosim.errors import ScenarioError


class PauseSteering(StrEnum):
    """What the wheels do in a pause without a live steering command (XGV-35)."""

    HOLD_CURVATURE = "hold_curvature"
    """Keep the path curvature."""
    HOLD_ANGLE = "hold_angle"
    """Keep the road-wheel angle."""
    CENTRE = "centre"
    """Go straight."""


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

    def __post_init__(self) -> None:
        problems = tuple(self._problems())
        if problems:
            raise ScenarioError("the XGV's settings are wrong:", problems)
        # Plain strings, as scenario files carry them, become members.
        object.__setattr__(self, "pause_no_command_steering", PauseSteering(self.pause_no_command_steering))
        object.__setattr__(self, "control_mode_both_clients", BothClients(self.control_mode_both_clients))

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
        for name, kind in (
            ("pause_no_command_steering", PauseSteering),
            ("control_mode_both_clients", BothClients),
        ):
            value = getattr(self, name)
            if value not in list(kind):
                problems.append(f"{name}: got {value!r}, expected one of {', '.join(kind)}")
        return problems

    def as_text(self) -> dict[str, str]:
        """Return each key with its value in force, for the ledger."""
        return {field.name: str(getattr(self, field.name)) for field in fields(self)}
