"""Commands as messages and back, through bytes; reports of made-up readings (XGV-46 to XGV-61)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaus.address import ComponentId, JausAddress
from jaus.codec import decode, encode
from jaus.component import ComponentStatus, StatusCommand
from jaus.messages import Message
from jaus.messages.core import (
    ClearEmergency,
    ReportComponentControl,
    ReportComponentStatus,
    ReportTime,
    Resume,
    SetEmergency,
)
from jaus.messages.platform import (
    ReportDiscreteDevices,
    ReportVelocityState,
    SetDiscreteDevices,
    SetWrenchEffort,
)
from jaus.messages.torc import (
    Lights,
    Motion,
    ReportCurvature,
    ReportErrorCount,
    ReportWheelsSpeed,
    SetMotionProfile,
    SetSignals,
)
from jaus.stamps import TimeStamp
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
from xgv_cosim.observation import DeviceReading
from xgv_cosim.vehicles.base import VehicleModeReport
from xgv_cosim.vehicles.xgv.partial_effort import PartialWrenchEffort
from xgv_cosim.vehicles.xgv.settings import Firmware
from xgv_cosim.vehicles.xgv.wire.commands import command_of, gear_code, gear_of, message_of
from xgv_cosim.vehicles.xgv.wire.node import XgvOnTheWire
from xgv_cosim.vehicles.xgv.wire.reports import XgvReporter, reports_of, time_stamp

ME = JausAddress(100, 1, 40, 1)
PD, MPD, SD = (
    ComponentId.PRIMITIVE_DRIVER,
    ComponentId.MOTION_PROFILE_DRIVER,
    ComponentId.SIGNALS_DRIVER,
)
drivers = st.sampled_from([PD, MPD])
motions = st.builds(
    MotionProfile,
    st.floats(-60.0, 60.0),
    st.floats(0.0, 100.0),
    st.floats(-5.0, 5.0),
    st.floats(0.0, 10.0),
    st.integers(0, 65535).map(lambda ms: ms / 1000.0),
)
commands = st.one_of(
    st.builds(RequestControl, drivers, st.integers(0, 255)),
    st.builds(ReleaseControl, drivers),
    st.builds(SetAuthority, drivers, st.integers(0, 255)),
    st.builds(CommandStatus, drivers, st.sampled_from(StatusCommand)),
    motions,
    st.builds(MotionQueue, st.lists(motions, min_size=2, max_size=4).map(tuple)),
    st.builds(WrenchEffort, st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(-1.0, 1.0)),
    st.builds(
        DiscreteDevices,
        st.none() | st.sampled_from(Gear),
        st.none() | st.booleans(),
        st.none() | st.booleans(),
    ),
    st.builds(
        Signals,
        st.none() | st.sampled_from(Turn),
        st.none() | st.booleans(),
        st.none() | st.sampled_from(Headlights),
    ),
)


def through_bytes(message: Message, component: ComponentId) -> Message:
    decoded = decode(encode(message.to(JausAddress(1, 1, component, 1), source=ME)))
    assert isinstance(decoded, Message)
    return decoded


def arrived(command: StackMessage) -> StackMessage | None:
    component, message = message_of(command)
    return command_of(through_bytes(message, component))


def assert_near(got: MotionProfile, sent: MotionProfile) -> None:
    assert got.speed_mps == pytest.approx(sent.speed_mps, abs=0.0021)
    assert got.max_accel_mps2 == pytest.approx(sent.max_accel_mps2, abs=0.0008)
    assert math.atan(got.curvature_per_m) == pytest.approx(math.atan(sent.curvature_per_m), abs=7.5e-5)
    assert got.max_curvature_rate_per_m_s == pytest.approx(sent.max_curvature_rate_per_m_s, abs=8e-5)
    assert got.duration_s == pytest.approx(sent.duration_s)


@given(commands)
def test_a_command_survives_the_wire(command: StackMessage) -> None:
    """XGV-57 to XGV-61, within one step of each scaled integer."""
    got = arrived(command)
    match command:
        case MotionProfile():
            assert isinstance(got, MotionProfile)
            assert_near(got, command)
        case MotionQueue():
            assert isinstance(got, MotionQueue)
            for one, other in zip(got.motions, command.motions, strict=True):
                assert_near(one, other)
        case WrenchEffort():
            assert isinstance(got, WrenchEffort)
            assert got.throttle == pytest.approx(command.throttle, abs=2e-5)
            assert got.steering == pytest.approx(command.steering, abs=4e-5)
            assert got.brake == pytest.approx(command.brake, abs=0.002)
        case _:
            assert got == command


def test_standstill_and_straight_on_are_exact() -> None:
    """The wire has neither 0 m/s nor 0 rad: its nearest are 1 mm/s and 2.4e-5 rad (jaus-wire, section 3)."""
    got = arrived(MotionProfile(0.0, 2.0, 0.0, 0.1, 0.4))
    assert isinstance(got, MotionProfile)
    assert (got.speed_mps, got.curvature_per_m) == (0.0, 0.0)


def test_the_bytes_of_torcs_client_turn_right_xgv_58() -> None:
    """XGV-58, jaus-wire 6.1: 5 m/s, 2 m/s2, atan 0.1, 0.06, 400 ms; inside, left is positive."""
    header = bytes.fromhex("860228e3010a010101280164 0c00 0000")
    message = decode(header + bytes.fromhex("0101C4891F05268889019001"))
    assert isinstance(message, SetMotionProfile)
    got = command_of(message)
    assert isinstance(got, MotionProfile)
    assert got.speed_mps == pytest.approx(5.0, abs=0.002)
    assert got.curvature_per_m == pytest.approx(-math.tan(0.1), abs=1e-4)
    assert got.duration_s == 0.4


@pytest.mark.parametrize(("version", "is_taken"), [(0, True), (1, True), (2, False), (77, False)])
def test_a_motion_profile_of_another_version_is_refused_xgv_58(version: int, is_taken: bool) -> None:
    """XGV-58: version 1; clients leave it out too."""
    message = SetMotionProfile(version=version, motions=(Motion(1.0, 1.0, 0.0, 0.1, 100),))
    if is_taken:
        assert command_of(through_bytes(message, MPD)) is not None
    else:
        with pytest.raises(CommandError, match=r"SetMotionProfile\.version: got .* expected 1"):
            command_of(through_bytes(message, MPD))


def test_an_axis_that_is_left_out_keeps_what_is_in_force_xgv_59() -> None:
    """XGV-59: not what somebody has sent, but what the car executes; nothing where it executes no effort."""
    message = through_bytes(SetWrenchEffort(resistive_linear_x_percent=50.0), PD)
    got = command_of(message)
    assert isinstance(got, PartialWrenchEffort)
    whole = got.completed(WrenchEffort(0.3, 0.2, -0.1))
    assert (type(whole), whole.throttle, whole.steering) == (WrenchEffort, 0.3, -0.1)
    assert whole.brake == pytest.approx(0.5, abs=0.002)
    for other in (None, MotionProfile(5.0, 2.0, 0.0, 0.1, 0.4)):
        assert got.completed(other) == WrenchEffort(0.0, whole.brake, 0.0)


@pytest.mark.parametrize("code", range(256))
def test_every_gear_code_means_a_gear_xgv_60(code: int) -> None:
    """XGV-60: 0 park, 1 low, 2 to 127 drive, 128 neutral, 129 to 255 reverse."""
    expected = {0: Gear.PARK, 1: Gear.LOW, 128: Gear.NEUTRAL}.get(
        code, Gear.DRIVE if code < 128 else Gear.REVERSE
    )
    assert gear_of(code) is expected
    got = command_of(through_bytes(SetDiscreteDevices(gear=code), PD))
    assert got == DiscreteDevices(gear=expected)


@pytest.mark.parametrize("gear", Gear)
def test_a_gear_is_reported_by_its_own_code(gear: Gear) -> None:
    assert gear_of(gear_code(gear)) is gear


@pytest.mark.parametrize("component", [c for c in ComponentId if c is not MPD])
def test_a_message_acts_on_its_own_component_only_xgv_09(component: ComponentId) -> None:
    """XGV-09, XGV-11."""
    profile = SetMotionProfile(motions=(Motion(1.0, 1.0, 0.0, 0.1, 100),))
    assert command_of(through_bytes(profile, component)) is None
    if component is not SD:
        assert command_of(through_bytes(SetSignals(turn_signal=1), component)) is None
    if component is not PD:
        assert command_of(through_bytes(Resume(), component)) is None


@pytest.mark.parametrize("kind", [SetEmergency, ClearEmergency])
@pytest.mark.parametrize(("bits", "acts"), [(0, False), (1, True), (2, False), (3, True)])
def test_emergency_needs_its_bit_xgv_63(
    kind: type[SetEmergency | ClearEmergency], bits: int, acts: bool
) -> None:
    """XGV-63: bit 0 of Set and Clear Emergency."""
    assert (command_of(through_bytes(kind(bits), MPD)) is not None) is acts


@pytest.mark.parametrize(("turn", "lights"), [(4, None), (255, None), (None, 3), (None, 7)])
def test_signals_that_mean_nothing_are_refused_xgv_61(turn: int | None, lights: int | None) -> None:
    """XGV-61: turn signals 0 to 3, headlights 0 to 2."""
    message = SetSignals(turn_signal=turn, lights=None if lights is None else Lights(lights))
    with pytest.raises(CommandError, match="SetSignals"):
        command_of(through_bytes(message, SD))


def test_high_beam_and_fog_are_headlights_that_are_on() -> None:
    got = command_of(through_bytes(SetSignals(lights=Lights(0b11010)), SD))
    assert got == Signals(headlights=Headlights.ON)


DEVICES = DeviceReading(Gear.REVERSE, Gear.REVERSE, engine_on=True, parking_brake=True)
SIGNALS = Signals(Turn.HAZARD, horn=True, headlights=Headlights.PARKING)
MODE = VehicleModeReport(0, 2, 2, 8, 1, 0x12)


@dataclass
class Made:
    """Readings as a test wants them."""

    time_s: float = 3723.25
    speed_mps: float = -3.5
    curvature_per_m: float = 0.1
    wheel_speeds_mps: tuple[float, float, float, float] = (1.0, 2.0, 3.0, 4.0)
    throttle: float = 0.25
    brake: float = 0.5
    steering: float = 0.2
    devices: DeviceReading = DEVICES
    signals: Signals = SIGNALS
    errors: frozenset[int] = frozenset({9158, 9101})
    vehicle_mode: VehicleModeReport = MODE
    secondary_status: int = 0x1234_0000
    component_status: dict[ComponentId, ComponentStatus] = field(
        default_factory=lambda: {PD: ComponentStatus.STANDBY, MPD: ComponentStatus.READY}
    )
    component_controller: dict[ComponentId, JausAddress | None] = field(
        default_factory=lambda: {PD: None, MPD: ME}
    )
    component_authority: dict[ComponentId, int] = field(default_factory=lambda: {PD: 0, MPD: 6})


def report(component: ComponentId, code: int, **readings: object) -> Message:
    made = XgvReporter(Made(**readings))(component, code)  # type: ignore[arg-type]
    return through_bytes(made, component)


def test_reports_say_what_the_readings_say() -> None:
    """XGV-46, XGV-57, XGV-60, XGV-61, and jaus-wire 6.2, 6.3: right is positive on the wire."""
    velocity = report(ComponentId.VELOCITY_STATE_SENSOR, ReportVelocityState.code)
    assert isinstance(velocity, ReportVelocityState)
    assert velocity.velocity_x_mps == pytest.approx(-3.5, abs=1e-6)
    assert velocity.time_stamp == TimeStamp(1, 1, 2, 3, 250).packed
    curvature = report(MPD, ReportCurvature.code)
    assert isinstance(curvature, ReportCurvature)
    assert curvature.atan_curvature_rad == pytest.approx(-math.atan(0.1), abs=5e-5)
    assert curvature.version == 1
    wheels = report(PD, ReportWheelsSpeed.code)
    assert isinstance(wheels, ReportWheelsSpeed)
    shown = [wheels.left_front_mps, wheels.right_front_mps, wheels.left_rear_mps, wheels.right_rear_mps]
    assert shown == pytest.approx([1.0, 2.0, 3.0, 4.0], abs=0.002)
    devices = report(PD, ReportDiscreteDevices.code)
    assert isinstance(devices, ReportDiscreteDevices)
    assert (devices.propulsion_bits, devices.brake_horn_bits, devices.gear) == (0x43, 0b11, 129)
    errors = report(ComponentId.ERROR_MANAGER, ReportErrorCount.code)
    assert isinstance(errors, ReportErrorCount)
    assert errors.errors == (9101, 9158)
    status = report(PD, ReportComponentStatus.code)
    assert isinstance(status, ReportComponentStatus)
    assert (status.primary_status, status.secondary_status) == (ComponentStatus.STANDBY, 0x1234_0000)
    held, free = report(MPD, ReportComponentControl.code), report(PD, ReportComponentControl.code)
    assert isinstance(held, ReportComponentControl)
    assert isinstance(free, ReportComponentControl)
    assert (held.controller, held.authority, free.controller) == (ME, 6, None)


def test_report_vehicle_mode_in_bytes_xgv_47_to_52() -> None:
    """XGV-47 to XGV-52, jaus-wire 6.7: control 2, ready 2, safety 8, partial 1, devices 0x12."""
    made = XgvReporter(Made())(ComponentId.NODE_MANAGER, 0xE456)  # type: ignore[arg-type]
    packet = encode(made.to(ME, source=JausAddress(1, 1, 1, 1)))
    assert packet[16:] == bytes.fromhex("00020208011200")


@pytest.mark.parametrize("firmware", Firmware)
def test_every_report_that_is_offered_can_be_made_and_sent(firmware: Firmware) -> None:
    for component, reports in reports_of(firmware).items():
        for code, supported in reports.items():
            made = report(ComponentId(component), code)
            assert made.code == code
            assert made.presence_vector == (supported or 0)


@pytest.mark.parametrize("firmware", Firmware)
def test_old_firmware_does_not_offer_report_vehicle_mode_xgv_53(firmware: Firmware) -> None:
    """XGV-53: 1.0 and 1.1 lack it; everything else is there."""
    offered = {code for reports in reports_of(firmware).values() for code in reports}
    assert (0xE456 in offered) is (firmware is Firmware.V1_2)
    assert len(offered) == 12 - (firmware is not Firmware.V1_2)


def test_time_goes_on_over_midnight_and_the_end_of_a_month() -> None:
    assert time_stamp(0.0) == TimeStamp(1, 0, 0, 0, 0).packed
    assert time_stamp(86_400.0) == TimeStamp(2, 0, 0, 0, 0).packed
    assert time_stamp(31 * 86_400.0 - 0.001) == TimeStamp(31, 23, 59, 59, 999).packed
    assert time_stamp(31 * 86_400.0) == TimeStamp(1, 0, 0, 0, 0).packed
    stamp = report(ComponentId.NODE_MANAGER, ReportTime.code)
    assert isinstance(stamp, ReportTime)
    assert stamp.time_stamp == TimeStamp(1, 1, 2, 3, 250).packed


def test_six_components_say_what_they_take_and_send_xgv_08() -> None:
    """XGV-07, XGV-08: the six components of the controller, and that they are simulated."""
    car = XgvOnTheWire("xgv_7", 7, Made(), Firmware.V1_2, 0.0)  # type: ignore[arg-type]
    described = car.node.description
    assert described.name == "SIMULATED XGV xgv_7"
    assert [each.component for each in described.components] == [1, 33, 10, 42, 11, 12]
    assert all(each.name.startswith("SIMULATED") for each in described.components)
    sent = {
        (component.component, message.command_code)
        for component in described.components
        for service in component.services
        for message in service.outputs
    }
    offered = {(c, code) for c, reports in reports_of(Firmware.V1_2).items() for code in reports}
    assert sent == offered
