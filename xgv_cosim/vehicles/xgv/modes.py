"""The XGV's control, ready and safety mode, and what each does to the axes, as the note tells it.

Each rule stands here once, as a scalar function that reads like the application note;
``tables.py`` calls them for every input and looks the fleet up.

The note's two figures are missing from its text; what is encoded is their best reading (figure A: the
three configurations of the control mode; figure B: the flowchart of the safety mode).
"""

from __future__ import annotations

from jaus.address import JausAddress
from jaus.component import ComponentStatus
from jaus.vehicle_mode import ControlMode, PartialOverrideBit, ReadyMode, SafetyDeviceBit, SafetyMode
from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.commands import CommandKind
from xgv_cosim.vehicles.xgv.settings import BothClients, PauseSteering

# Safety devices: bits of Report Vehicle Mode, field 6 (XGV-52).
MANUAL_OVERRIDE_ENGAGED = 1 << SafetyDeviceBit.MANUAL_OVERRIDE
SAFESTOP_PAUSE = 1 << SafetyDeviceBit.SAFESTOP_PAUSE
SAFESTOP_STOP = 1 << SafetyDeviceBit.SAFESTOP_STOP
LINK_STATUS_SHIFT = SafetyDeviceBit.LINK_BYPASS
LINK_GOOD = 2 << LINK_STATUS_SHIFT
"""SafeStop link status "good"; bits 3 and 4 never change the mode (XGV-42)."""
ESTOP_BUTTON = 1 << SafetyDeviceBit.EXTERNAL_ESTOP
DOOR_OPEN = 1 << SafetyDeviceBit.DOOR
ERRORS_DETECTED = 1 << SafetyDeviceBit.ERRORS
EMERGENCY_OVERRIDE_ENGAGED = 1 << SafetyDeviceBit.EMERGENCY_MANUAL_OVERRIDE
STEERING_UNINITIALISED = 1 << SafetyDeviceBit.STEERING_UNINITIALISED
STEERING_AWAITS_USER = 1 << SafetyDeviceBit.AWAITING_USER
STEERING_NOT_READY = STEERING_UNINITIALISED | STEERING_AWAITS_USER
"""Either bit: the wheel is not under control, since 0 means "initialized" for both (XGV-69)."""
DEVICE_WORDS = 1 << 11
"""Number of values of the device word; bits 11 to 15 are reserved."""

# Partial mode: bits of Report Vehicle Mode, field 5 (XGV-51).
MANUAL_STEERING = 1 << PartialOverrideBit.STEERING_MANUAL
MANUAL_SPEED = 1 << PartialOverrideBit.SPEED_MANUAL


PAUSES = frozenset({SafetyMode.SOFTWARE_PAUSE, SafetyMode.ESTOP_PAUSE})
"""Identical but for where they come from (XGV-28)."""
PARTIAL_MODE_ACTS_IN = PAUSES | {SafetyMode.DRIVE_BY_WIRE}
"""In all other safety modes the partial mode is ignored (XGV-39)."""

_COMMAND_KIND_OF = {
    ControlMode.WRENCH_EFFORTS: CommandKind.WRENCH_EFFORT,
    ControlMode.MOTION_PROFILES: CommandKind.MOTION_PROFILE,
}
_STEERING_WITHOUT_COMMAND = {
    PauseSteering.HOLD_CURVATURE: Lateral.CLOSED_LOOP,
    PauseSteering.CENTRE: Lateral.CLOSED_LOOP,
    PauseSteering.HOLD_ANGLE: Lateral.LATCH_LAST,
}


def resolve_control_mode(
    pd_controller: JausAddress | None,
    mpd_controller: JausAddress | None,
    *,
    mpd_address: JausAddress,
    both_clients: BothClients = BothClients.SOFTWARE_PAUSE,
) -> ControlMode:
    """Return the control mode, which depends only on who controls the two drivers (XGV-15, XGV-18).

    Figure A: a client controls the Primitive Driver (PD) alone: wrench efforts. A client controls the
    Motion Profile Driver (MPD), and the MPD the PD: motion profiles. All else is software pause, also
    one client in control of both, unless ``both_clients`` says otherwise.
    """
    pd_held_by_mpd = pd_controller == mpd_address
    if pd_controller is not None and not pd_held_by_mpd and mpd_controller is None:
        return ControlMode.WRENCH_EFFORTS
    if mpd_controller is not None and pd_held_by_mpd:
        return ControlMode.MOTION_PROFILES
    if (
        both_clients == BothClients.WRENCH_EFFORTS
        and pd_controller is not None
        and pd_controller == mpd_controller
    ):
        return ControlMode.WRENCH_EFFORTS
    return ControlMode.SOFTWARE_PAUSE


def resolve_ready_mode(
    control_mode: ControlMode, pd_status: ComponentStatus, mpd_status: ComponentStatus
) -> ReadyMode:
    """Return the ready mode: all components that the control mode needs must be ready.

    Wrench efforts need the Primitive Driver (XGV-22), motion profiles both drivers (XGV-23); all else is
    software pause (XGV-24).
    """
    pd_ready = pd_status is ComponentStatus.READY
    mpd_ready = mpd_status is ComponentStatus.READY
    if control_mode is ControlMode.WRENCH_EFFORTS and pd_ready:
        return ReadyMode.READY
    if control_mode is ControlMode.MOTION_PROFILES and pd_ready and mpd_ready:
        return ReadyMode.READY
    return ReadyMode.SOFTWARE_PAUSE


def is_software_ready(control_mode: ControlMode, ready_mode: ReadyMode) -> bool:
    """Return whether neither control mode nor ready mode is software pause (XGV-26)."""
    return (
        control_mode in {ControlMode.WRENCH_EFFORTS, ControlMode.MOTION_PROFILES}
        and ready_mode is ReadyMode.READY
    )


def resolve_safety_mode(devices: int, *, software_ready: bool, active: bool = True) -> SafetyMode:
    """Return the safety mode, the greatest of those that are asked for (XGV-26 to 32, figure B).

    Args:
        devices: Safety-device bits of Report Vehicle Mode, field 6; the link status never counts (XGV-42).
        software_ready: Neither control mode nor ready mode is software pause.
        active: The system is booted. Inactive outranks all, disable too (XGV-32).
    """
    if not active:
        return SafetyMode.INACTIVE
    asked_for = [SafetyMode.DRIVE_BY_WIRE]
    if not software_ready or devices & (DOOR_OPEN | ERRORS_DETECTED | STEERING_NOT_READY):
        asked_for.append(SafetyMode.SOFTWARE_PAUSE)
    if devices & SAFESTOP_PAUSE:
        asked_for.append(SafetyMode.ESTOP_PAUSE)
    if devices & MANUAL_OVERRIDE_ENGAGED:
        asked_for.append(SafetyMode.MANUAL_OVERRIDE)
    if devices & EMERGENCY_OVERRIDE_ENGAGED:
        asked_for.append(SafetyMode.EMERGENCY_MANUAL_OVERRIDE)
    if devices & (SAFESTOP_STOP | ESTOP_BUTTON):
        asked_for.append(SafetyMode.ESTOP_DISABLE)
    return max(asked_for)


def has_live_command(control_mode: ControlMode, command_kind: CommandKind) -> bool:
    """Return whether a live command of the control mode's own kind exists (XGV-16)."""
    return command_kind is _COMMAND_KIND_OF.get(control_mode)


def resolve_longitudinal(
    safety_mode: SafetyMode, control_mode: ControlMode, command_kind: CommandKind, partial_mode: int
) -> Longitudinal:
    """Return who governs speed (XGV-16, XGV-29 to 33, XGV-39).

    The three ways of operating: free for the human, open loop and closed loop (XGV-02).
    In drive-by-wire before the first accepted command the car stops and holds (XGV-70).
    """
    if safety_mode is SafetyMode.ESTOP_DISABLE:
        return Longitudinal.FULL_BRAKE
    if safety_mode not in PARTIAL_MODE_ACTS_IN or partial_mode & MANUAL_SPEED:
        return Longitudinal.FREE
    if safety_mode in PAUSES or not has_live_command(control_mode, command_kind):
        return Longitudinal.CONTROLLED_STOP
    return Longitudinal.CLOSED_LOOP if control_mode is ControlMode.MOTION_PROFILES else Longitudinal.OPEN_LOOP


def resolve_lateral(
    safety_mode: SafetyMode,
    control_mode: ControlMode,
    command_kind: CommandKind,
    partial_mode: int,
    *,
    steering_initialised: bool = True,
    without_command: PauseSteering = PauseSteering.HOLD_CURVATURE,
) -> Lateral:
    """Return who governs steering (XGV-29 to 35, XGV-39, XGV-69).

    Pauses go on executing the commands of the control mode, so that the car stays on its path.
    """
    if safety_mode not in PARTIAL_MODE_ACTS_IN or partial_mode & MANUAL_STEERING:
        return Lateral.FREE
    if not steering_initialised:
        return Lateral.FREE
    if not has_live_command(control_mode, command_kind):
        return _STEERING_WITHOUT_COMMAND[without_command]
    return Lateral.CLOSED_LOOP if control_mode is ControlMode.MOTION_PROFILES else Lateral.OPEN_LOOP


def is_driver_engaged(safety_mode: SafetyMode, partial_mode: int, manual_axis: int) -> bool:
    """Return whether the driver himself caused the release of an axis and has it at once (XGV-64).

    So it is under an override, in an inactive car, and for the axis that the partial mode leaves to him;
    a disable and steering that is not initialised come without his doing, whatever else he has.

    Args:
        safety_mode: In force now.
        partial_mode: Bits of Report Vehicle Mode, field 5.
        manual_axis: The axis asked for, as its bit of the partial mode.
    """
    if safety_mode in PARTIAL_MODE_ACTS_IN:
        return bool(partial_mode & manual_axis)
    return safety_mode is not SafetyMode.ESTOP_DISABLE


def is_run_state(safety_mode: SafetyMode, control_mode: ControlMode, command_kind: CommandKind) -> bool:
    """Return whether the car drives by wire with a live command, which ends ``bind.start = handover``."""
    return safety_mode is SafetyMode.DRIVE_BY_WIRE and has_live_command(control_mode, command_kind)


def is_stop_demanded(safety_mode: SafetyMode) -> bool:
    """Return whether an emergency stop device has the car stopped, also before the hand-over."""
    return safety_mode in {SafetyMode.ESTOP_PAUSE, SafetyMode.ESTOP_DISABLE}
