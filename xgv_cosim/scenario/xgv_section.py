"""The section ``xgv`` of a scenario: the XGV's settings under the keys that the requirements give them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from xgv_cosim.scenario.section import Section
from xgv_cosim.vehicles.xgv.settings import BothClients, PauseSteering, XgvSettings

_DEFAULT = XgvSettings()
_Period = Annotated[float, Field(gt=0, le=60)]


class PauseSection(Section):
    """What both pauses do."""

    decel_mps2: Annotated[float, Field(gt=0, le=20)] = _DEFAULT.pause_decel_mps2
    """Constant deceleration of both pauses (XGV-12, XGV-36)."""
    hold_brake: Annotated[float, Field(ge=0, le=1)] = _DEFAULT.pause_hold_brake
    """Brake effort held after the stop, share 0 to 1 (XGV-33)."""
    no_command_steering: PauseSteering = _DEFAULT.pause_no_command_steering
    """What the wheels do without a live steering command (XGV-35)."""


class ControlModeSection(Section):
    """How the control mode is read from who controls which driver."""

    both_clients: BothClients = _DEFAULT.control_mode_both_clients
    """Control mode when one client controls both drivers (XGV-18)."""


class PartialSection(Section):
    """What partial mode permits."""

    allow_both: bool = _DEFAULT.partial_allow_both
    """Both axes may be manual at once (XGV-41)."""


class MotionProfileDriverSection(Section):
    """The Motion Profile Driver."""

    request_period_s: _Period = _DEFAULT.mpd_request_period_s
    """How often it asks for control of the Primitive Driver (XGV-19)."""


class XgvSection(Section):
    """Settings of all vehicles with profile xgv."""

    pause: PauseSection = PauseSection()
    """What both pauses do."""
    control_mode: ControlModeSection = ControlModeSection()
    """How the control mode is read from who controls which driver."""
    partial: PartialSection = PartialSection()
    """What partial mode permits."""
    mpd: MotionProfileDriverSection = MotionProfileDriverSection()
    """The Motion Profile Driver."""
    wrench_timeout_s: _Period = _DEFAULT.wrench_timeout_s
    """Wrench efforts end this long after the last one (XGV-43)."""
    initialize_s: Annotated[float, Field(ge=0, le=60)] = _DEFAULT.initialize_s
    """A component goes to standby this long after Reset."""

    def settings(self) -> XgvSettings:
        """Return the settings as the XGV profile takes them."""
        return XgvSettings(
            pause_decel_mps2=self.pause.decel_mps2,
            pause_hold_brake=self.pause.hold_brake,
            pause_no_command_steering=self.pause.no_command_steering,
            control_mode_both_clients=self.control_mode.both_clients,
            wrench_timeout_s=self.wrench_timeout_s,
            partial_allow_both=self.partial.allow_both,
            mpd_request_period_s=self.mpd.request_period_s,
            initialize_s=self.initialize_s,
        )
