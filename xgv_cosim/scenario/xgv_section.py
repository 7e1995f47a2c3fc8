"""The section ``xgv`` of a scenario: the XGV's settings under the keys that the requirements give them."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field

from xgv_cosim.scenario.section import Section
from xgv_cosim.scenario.sections import known_error_code
from xgv_cosim.vehicles.xgv.rearm import Rearm, RearmPreset, RearmSettings
from xgv_cosim.vehicles.xgv.settings import BothClients, ErrorLatch, Firmware, PauseSteering, XgvSettings

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


def _quoted(value: object) -> object:
    """Take 1.2 for "1.2": YAML reads a bare version as a number."""
    return str(value) if isinstance(value, float) else value


_Codes = tuple[Annotated[int, AfterValidator(known_error_code)], ...]


class ControlSection(Section):
    """Control of the components."""

    controller_timeout_s: Annotated[float, Field(ge=0, le=3600)] = _DEFAULT.controller_timeout_s
    """A controller that is silent for so long loses control, 0: never (XGV-65)."""


class NonmotionSection(Section):
    """Commands that cause no motion."""

    needs_control: bool = _DEFAULT.nonmotion_needs_control
    """The engine is switched in a pause only by a controller (XGV-34)."""


class MotionSection(Section):
    """Set Motion Profile."""

    allow_many: bool = _DEFAULT.motion_allow_many
    """One message may carry several motions, driven one after the other (XGV-70)."""


class DisableSection(Section):
    """E-stop disable."""

    engine_off: bool = _DEFAULT.disable_engine_off
    """It switches the engine off (XGV-31)."""


class EngineSection(Section):
    """The engine."""

    brake_assist_lost: bool = _DEFAULT.engine_brake_assist_lost
    """With the engine off the brake has lost its assistance; false: brake authority does not depend on it."""


class ErrorEffectSection(Section):
    """Which errors take which function away, by their codes (XGV-38)."""

    brake: _Codes = _DEFAULT.errors_effect_brake
    """Errors without brake."""
    steering: _Codes = _DEFAULT.errors_effect_steering
    """Errors without steering."""
    throttle: _Codes = _DEFAULT.errors_effect_throttle
    """Errors without throttle."""
    speed_feedback: _Codes = _DEFAULT.errors_effect_speed_feedback
    """Errors without measured speed."""


class ErrorsSection(Section):
    """Errors that the car detects in itself."""

    latch: ErrorLatch = _DEFAULT.errors_latch
    """hardware: errors of the car stay until the operator clears them; none: each goes with its cause."""
    effect: ErrorEffectSection = ErrorEffectSection()
    """Which errors take which function away."""


class RearmSection(Section):
    """What a car needs before it moves again once its stop demand is gone (XGV-37)."""

    preset: RearmPreset = RearmPreset.LITERAL
    """literal: nothing, the source's text; conservative: a fresh Resume, after a disable the operator too."""
    estop_pause: Rearm | None = None
    """After an e-stop pause; without it, as the preset says."""
    disable: Rearm | None = None
    """After an e-stop disable; without it, as the preset says."""
    link_loss: Rearm | None = None
    """After a loss of the SafeStop's link; without it, as the preset says."""
    override: Rearm | None = None
    """After a manual override; without it, as the preset says."""
    error: Rearm | None = None
    """After an internal error; without it, as the preset says."""
    door: Rearm | None = None
    """After an open door; without it, as the preset says."""
    preemption: Rearm | None = None
    """After another has taken control; without it, as the preset says (XGV-66)."""

    def settings(self) -> RearmSettings:
        """Return the settings as the XGV profile takes them."""
        return RearmSettings(**{name: getattr(self, name) for name in type(self).model_fields})


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
    control: ControlSection = ControlSection()
    """Control of the components."""
    nonmotion: NonmotionSection = NonmotionSection()
    """Commands that cause no motion."""
    motion: MotionSection = MotionSection()
    """Set Motion Profile."""
    disable: DisableSection = DisableSection()
    """E-stop disable."""
    engine: EngineSection = EngineSection()
    """The engine (XGV-31)."""
    errors: ErrorsSection = ErrorsSection()
    """Errors that the car detects in itself."""
    firmware: Annotated[Firmware, BeforeValidator(_quoted)] = _DEFAULT.firmware
    """Firmware of the controller; 1.0 and 1.1 lack Report Vehicle Mode (XGV-53)."""
    wrench_timeout_s: _Period = _DEFAULT.wrench_timeout_s
    """Wrench efforts end this long after the last one (XGV-43)."""
    initialize_s: Annotated[float, Field(ge=0, le=60)] = _DEFAULT.initialize_s
    """A component goes to standby this long after Reset."""

    rearm: RearmSection = RearmSection()
    """What a car needs before it moves again once its stop demand is gone."""

    def settings(self) -> XgvSettings:
        """Return the settings as the XGV profile takes them."""
        return XgvSettings(
            rearm=self.rearm.settings(),
            pause_decel_mps2=self.pause.decel_mps2,
            pause_hold_brake=self.pause.hold_brake,
            pause_no_command_steering=self.pause.no_command_steering,
            control_mode_both_clients=self.control_mode.both_clients,
            wrench_timeout_s=self.wrench_timeout_s,
            partial_allow_both=self.partial.allow_both,
            mpd_request_period_s=self.mpd.request_period_s,
            initialize_s=self.initialize_s,
            controller_timeout_s=self.control.controller_timeout_s,
            nonmotion_needs_control=self.nonmotion.needs_control,
            motion_allow_many=self.motion.allow_many,
            disable_engine_off=self.disable.engine_off,
            engine_brake_assist_lost=self.engine.brake_assist_lost,
            errors_latch=self.errors.latch,
            errors_effect_brake=self.errors.effect.brake,
            errors_effect_steering=self.errors.effect.steering,
            errors_effect_throttle=self.errors.effect.throttle,
            errors_effect_speed_feedback=self.errors.effect.speed_feedback,
            firmware=self.firmware,
        )
