"""Why a mode is what it is, in words for the event log and the reports."""

from __future__ import annotations

from collections.abc import Collection

from jaus.address import ComponentId, JausAddress
from jaus.component import Component, ComponentStatus
from jaus.vehicle_mode import ControlMode
from xgv_cosim.vehicles.xgv.errors import ERRORS
from xgv_cosim.vehicles.xgv.modes import (
    DOOR_OPEN,
    EMERGENCY_OVERRIDE_ENGAGED,
    ERRORS_DETECTED,
    ESTOP_BUTTON,
    MANUAL_OVERRIDE_ENGAGED,
    SAFESTOP_PAUSE,
    SAFESTOP_STOP,
    STEERING_AWAITS_USER,
    STEERING_UNINITIALISED,
)

COMPONENT_NAMES = {
    ComponentId.NODE_MANAGER: "Node Manager",
    ComponentId.MOTION_PROFILE_DRIVER: "Motion Profile Driver",
    ComponentId.SIGNALS_DRIVER: "Signals Driver",
    ComponentId.ERROR_MANAGER: "Error Manager",
    ComponentId.PRIMITIVE_DRIVER: "Primitive Driver",
    ComponentId.VELOCITY_STATE_SENSOR: "Velocity State Sensor",
}
"""The six components on the controller (XGV-08)."""

_DEVICE_REASONS = (
    (SAFESTOP_STOP, "SafeStop stop relay"),
    (ESTOP_BUTTON, "emergency stop button"),
    (EMERGENCY_OVERRIDE_ENGAGED, "emergency manual override"),
    (MANUAL_OVERRIDE_ENGAGED, "manual override"),
    (SAFESTOP_PAUSE, "SafeStop pause relay"),
    (DOOR_OPEN, "door or liftgate open"),
)
_STEERING_REASONS = (
    (STEERING_UNINITIALISED, "steering requires initialisation"),
    (STEERING_AWAITS_USER, "steering initialisation awaits the user"),
)


def holder_name(controller: JausAddress | None, own: Collection[Component] = ()) -> str:
    """Return who ``controller`` is: nobody, one of the vehicle's ``own`` components, or an address."""
    if controller is None:
        return "nobody"
    for component in own:
        if controller == component.address:
            return COMPONENT_NAMES[ComponentId(component.address.component)]
    return str(controller)


def mode_name(mode: ControlMode) -> str:
    """Return the note's words for a control mode."""
    return mode.name.lower().replace("_", " ")


def control_mode_reason(mode: ControlMode, primitive_driver: Component, profile_driver: Component) -> str:
    """Return why the control mode is what it is, by who controls the two drivers (XGV-18)."""
    own = (primitive_driver, profile_driver)
    pd_holder = holder_name(primitive_driver.controller, own)
    mpd_holder = holder_name(profile_driver.controller, own)
    if mode is ControlMode.WRENCH_EFFORTS:
        return f"{pd_holder} controls the Primitive Driver"
    if mode is ControlMode.MOTION_PROFILES:
        return f"{mpd_holder} controls the Motion Profile Driver, which controls the Primitive Driver"
    if profile_driver.controller is None:
        if primitive_driver.controller is None:
            return "nobody controls the Motion Profile Driver or the Primitive Driver"
        return "nobody controls the Motion Profile Driver, which still holds the Primitive Driver"
    if primitive_driver.controller is None:
        return (
            f"{mpd_holder} controls the Motion Profile Driver, which has not taken the Primitive Driver yet"
        )
    return f"{mpd_holder} controls the Motion Profile Driver, but {pd_holder} controls the Primitive Driver"


def ready_mode_reasons(
    control_mode: ControlMode,
    primitive_driver: Component,
    profile_driver: Component,
    standby_reason: str = "",
) -> tuple[str, ...]:
    """Return which of the needed components are not ready; empty when all are (XGV-22, XGV-23, XGV-24).

    ``standby_reason`` says why the car itself has set them to standby, if it has (XGV-37, XGV-66).
    """
    if control_mode not in {ControlMode.WRENCH_EFFORTS, ControlMode.MOTION_PROFILES}:
        return ("neither wrench efforts nor motion profiles",)
    needed = [primitive_driver]
    if control_mode is ControlMode.MOTION_PROFILES:
        needed.append(profile_driver)
    reasons = [
        f"{COMPONENT_NAMES[ComponentId(component.address.component)]} is in {component.status.name.lower()}"
        for component in needed
        if component.status is not ComponentStatus.READY
    ]
    if standby_reason and any(component.status is ComponentStatus.STANDBY for component in needed):
        reasons.append(standby_reason)
    return tuple(reasons)


def safety_mode_reasons(
    devices: int,
    errors: Collection[int],
    control_mode: ControlMode,
    control_reason: str,
    not_ready: Collection[str],
    *,
    has_command: bool = True,
) -> tuple[str, ...]:
    """Return everything that speaks against drive-by-wire, strongest first (figure B).

    Args:
        devices: Safety-device bits of Report Vehicle Mode, field 6.
        errors: Codes that are raised.
        control_mode: In force now.
        control_reason: Why it is in force.
        not_ready: Why the ready mode is software pause; nothing where it is not.
        has_command: Something commands the car; without it stands or stops in drive-by-wire too (XGV-70).
    """
    reasons = [text for bit, text in _DEVICE_REASONS if devices & bit]
    if devices & ERRORS_DETECTED:
        pausing = [ERRORS[code].label for code in sorted(errors) if ERRORS[code].pauses]
        reasons += pausing or ["errors detected"]
    reasons += [text for bit, text in _STEERING_REASONS if devices & bit]
    if control_mode is ControlMode.SOFTWARE_PAUSE:
        reasons.append(f"control mode software pause: {control_reason}")
    elif not_ready:
        reasons.append(f"ready mode software pause: {', '.join(not_ready)}")
    command = "" if has_command else ", but without a live command"
    return tuple(reasons) or (
        f"no device, error or pause in force; control mode {mode_name(control_mode)}, ready{command}",
    )
