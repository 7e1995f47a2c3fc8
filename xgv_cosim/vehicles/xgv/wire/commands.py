"""Messages of JAUS to the XGV as commands, and commands as messages (XGV-57 to XGV-61).

Here the two frames meet: on the wire positive curvature and steering turn right, inside they turn left.
"""

from __future__ import annotations

import math

from jaus.address import ComponentId
from jaus.component import StatusCommand
from jaus.messages import Message
from jaus.messages.core import (
    ClearEmergency,
    ReleaseComponentControl,
    RequestComponentControl,
    Reset,
    Resume,
    SetComponentAuthority,
    SetEmergency,
    Shutdown,
    Standby,
)
from jaus.messages.platform import BrakeHornBit, GearCode, PropulsionBit, SetDiscreteDevices, SetWrenchEffort
from jaus.messages.torc import Horn, Lights, Motion, SetMotionProfile, SetSignals
from xgv_cosim.actuation import Gear
from xgv_cosim.commands import (
    DiscreteDevices,
    Headlights,
    MotionProfile,
    MotionQueue,
    Signals,
    Turn,
    WrenchEffort,
)
from xgv_cosim.endpoint import CommandStatus, ReleaseControl, RequestControl, SetAuthority, StackMessage
from xgv_cosim.errors import CommandError
from xgv_cosim.vehicles.xgv.partial_effort import PartialWrenchEffort

STANDS_MPS = 0.002
"""Less than this is a stop: the wire has no 0 m/s, its nearest speeds are 1 mm/s (jaus-wire, section 3)."""
STRAIGHT_PER_M = 5e-5
"""Likewise a smaller curvature is none: the wire's nearest are 2.4e-5 rad."""
_PERCENT = 100.0
_MOTION_VERSIONS = frozenset({0, 1})
"""1 by the manual; 0 is taken too, since clients leave it out."""
_LAST_FORWARD_GEAR = 127
_HEADLIGHT_BITS = 0b111
_ENGINE_RUNS = (PropulsionBit.MAIN_PROPULSION, PropulsionBit.MAIN_FUEL, PropulsionBit.AUTOMATIC_START)
_ENGINE_ON = sum(1 << bit for bit in _ENGINE_RUNS)
_EMERGENCY = 1
"""Bit 0 of Set and Clear Emergency; without it they say nothing (jaus-wire, section 4)."""
_DRIVERS = frozenset({ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER})
_STATUS_COMMANDS: dict[type[Message], StatusCommand] = {
    Resume: StatusCommand.RESUME,
    Standby: StatusCommand.STANDBY,
    Shutdown: StatusCommand.SHUTDOWN,
    Reset: StatusCommand.RESET,
    SetEmergency: StatusCommand.SET_EMERGENCY,
    ClearEmergency: StatusCommand.CLEAR_EMERGENCY,
}
_ACTS_ON: dict[type[Message], ComponentId] = {
    SetMotionProfile: ComponentId.MOTION_PROFILE_DRIVER,
    SetWrenchEffort: ComponentId.PRIMITIVE_DRIVER,
    SetDiscreteDevices: ComponentId.PRIMITIVE_DRIVER,
    SetSignals: ComponentId.SIGNALS_DRIVER,
}
"""Which component a message acts on (XGV-09, XGV-11); sent to another one it does nothing."""
_STATUS_MESSAGES = {command: kind for kind, command in _STATUS_COMMANDS.items()}
_GEAR_CODES = {
    Gear.PARK: GearCode.PARK,
    Gear.LOW: GearCode.LOW,
    Gear.DRIVE: GearCode.DRIVE,
    Gear.NEUTRAL: GearCode.NEUTRAL,
    Gear.REVERSE: GearCode.REVERSE,
}


def _efforts_of(message: SetWrenchEffort) -> WrenchEffort:
    """Return the efforts of a message; axes that it leaves out are filled when it acts (XGV-59).

    Backward throttle, which no car has, is none.
    """
    throttle, brake = message.propulsive_linear_x_percent, message.resistive_linear_x_percent
    to_right = message.propulsive_rotational_z_percent
    efforts = (
        0.0 if throttle is None else max(0.0, throttle) / _PERCENT,
        0.0 if brake is None else brake / _PERCENT,
        0.0 if to_right is None else -to_right / _PERCENT,
    )
    gives = throttle is not None, brake is not None, to_right is not None
    return WrenchEffort(*efforts) if all(gives) else PartialWrenchEffort(*efforts, *gives)


def command_of(message: Message) -> StackMessage | None:
    """Return what a message commands, None if it is no command that the XGV knows.

    Args:
        message: From whomever, addressed to one of the car's components.

    Raises:
        CommandError: Its values mean nothing, for example no motion at all.
    """
    component = message.header.destination.component
    acts_on = _ACTS_ON.get(type(message))
    if acts_on is not None:
        return _own_command(message) if component == acts_on else None
    if component in _DRIVERS:
        return _driver_command(message, ComponentId(component))
    return None


def _own_command(message: Message) -> StackMessage | None:
    """Return the command of a message that only one component takes."""
    match message:
        case SetMotionProfile():
            return _motion_of(message)
        case SetWrenchEffort():
            return _efforts_of(message)
        case SetDiscreteDevices():
            return _devices_of(message)
        case SetSignals():
            return _signals_of(message)
        case _:
            return None


def _driver_command(message: Message, driver: ComponentId) -> StackMessage | None:
    """Return the command of a message about status or control of one of the two drivers."""
    match message:
        case RequestComponentControl():
            return RequestControl(driver, message.authority)
        case ReleaseComponentControl():
            return ReleaseControl(driver)
        case SetComponentAuthority():
            return SetAuthority(driver, message.authority)
    command = _STATUS_COMMANDS.get(type(message))
    bits = getattr(message, "emergency_bits", _EMERGENCY)
    return CommandStatus(driver, command) if command is not None and bits & _EMERGENCY else None


def message_of(command: StackMessage) -> tuple[ComponentId, Message]:
    """Return the component that a command goes to, and the message: what a client of the car sends."""
    message: Message
    match command:
        case RequestControl():
            return command.component, RequestComponentControl(command.authority)
        case ReleaseControl():
            return command.component, ReleaseComponentControl()
        case SetAuthority():
            return command.component, SetComponentAuthority(command.authority)
        case CommandStatus():
            return command.component, _STATUS_MESSAGES[command.command]()
        case MotionProfile():
            message = SetMotionProfile(motions=(_wire_motion(command),))
        case MotionQueue():
            message = SetMotionProfile(motions=tuple(map(_wire_motion, command.motions)))
        case WrenchEffort():
            message = _wire_efforts(command)
        case DiscreteDevices():
            message = _wire_devices(command)
        case Signals():
            message = _wire_signals(command)
    return _ACTS_ON[type(message)], message


def gear_code(gear: Gear) -> GearCode:
    """Return the gear's code on the wire (XGV-60)."""
    return _GEAR_CODES[gear]


def propulsion_bits(*, engine_on: bool) -> int:
    """Return the propulsion byte of an engine that runs or stands (jaus-wire, 6.9)."""
    return _ENGINE_ON if engine_on else 0


def wire_signals(signals: Signals) -> tuple[int | None, Horn | None, Lights | None]:
    """Return turn signals, horn and lights as the messages of the Signals Driver have them."""
    turn = None if signals.turn is None else int(signals.turn)
    horn = None if signals.horn is None else Horn(int(signals.horn))
    lights = None if signals.headlights is None else Lights(int(signals.headlights))
    return turn, horn, lights


def _motion_of(message: SetMotionProfile) -> MotionProfile | MotionQueue:
    if message.version not in _MOTION_VERSIONS:
        raise CommandError(f"SetMotionProfile.version: got {message.version}, expected 1 (XGV-58)")
    motions = tuple(
        MotionProfile(
            speed_mps=0.0 if abs(motion.speed_mps) < STANDS_MPS else motion.speed_mps,
            max_accel_mps2=motion.max_acceleration_mps2,
            curvature_per_m=_to_left_per_m(motion.atan_curvature_rad),
            max_curvature_rate_per_m_s=motion.max_curvature_rate_per_m_s,
            duration_s=motion.duration_ms / 1000.0,
        )
        for motion in message.motions
    )
    return motions[0] if len(motions) == 1 else MotionQueue(motions)


def _to_left_per_m(atan_to_right_rad: float) -> float:
    curvature_per_m = -math.tan(atan_to_right_rad)
    return 0.0 if abs(curvature_per_m) < STRAIGHT_PER_M else curvature_per_m


def _wire_motion(motion: MotionProfile) -> Motion:
    return Motion(
        motion.speed_mps,
        motion.max_accel_mps2,
        -math.atan(motion.curvature_per_m),
        motion.max_curvature_rate_per_m_s,
        round(1000.0 * motion.duration_s),
    )


def _wire_efforts(efforts: WrenchEffort) -> SetWrenchEffort:
    return SetWrenchEffort(
        propulsive_linear_x_percent=_PERCENT * efforts.throttle,
        propulsive_rotational_z_percent=-_PERCENT * efforts.steering,
        resistive_linear_x_percent=_PERCENT * efforts.brake,
    )


def gear_of(code: int) -> Gear:
    """Return the gear that a code means: 2 to 127 drive forward, 129 to 255 backward (XGV-60)."""
    if code == GearCode.PARK:
        return Gear.PARK
    if code == GearCode.LOW:
        return Gear.LOW
    if code <= _LAST_FORWARD_GEAR:
        return Gear.DRIVE
    return Gear.NEUTRAL if code == GearCode.NEUTRAL else Gear.REVERSE


def _devices_of(message: SetDiscreteDevices) -> DiscreteDevices:
    propulsion, brake_horn = message.propulsion_bits, message.brake_horn_bits
    return DiscreteDevices(
        gear=None if message.gear is None else gear_of(message.gear),
        engine_on=None if propulsion is None else bool(propulsion >> PropulsionBit.MAIN_PROPULSION & 1),
        parking_brake=None if brake_horn is None else bool(brake_horn >> BrakeHornBit.PARKING_BRAKE & 1),
    )


def _wire_devices(devices: DiscreteDevices) -> SetDiscreteDevices:
    return SetDiscreteDevices(
        propulsion_bits=None if devices.engine_on is None else propulsion_bits(engine_on=devices.engine_on),
        brake_horn_bits=None
        if devices.parking_brake is None
        else devices.parking_brake << BrakeHornBit.PARKING_BRAKE,
        gear=None if devices.gear is None else gear_code(devices.gear),
    )


def _signals_of(message: SetSignals) -> Signals:
    try:
        return Signals(
            turn=None if message.turn_signal is None else Turn(message.turn_signal),
            horn=None if message.horn is None else bool(message.horn.on & 1),
            headlights=None
            if message.lights is None
            else Headlights(message.lights.headlights & _HEADLIGHT_BITS),
        )
    except ValueError as error:
        raise CommandError(f"SetSignals: {error}") from None


def _wire_signals(signals: Signals) -> SetSignals:
    turn, horn, lights = wire_signals(signals)
    return SetSignals(turn_signal=turn, horn=horn, lights=lights)
