"""Messages of RA 3.3 and of TORC, and the bytes that an independent implementation made of the same values.

It cuts negative scaled integers off towards zero, where this library rounds: those may differ by one.
"""

from __future__ import annotations

from typing import NamedTuple

from jaus.address import ComponentId, JausAddress
from jaus.codec import Decoded
from jaus.header import Acknowledgement, Header
from jaus.messages import Ack, Message
from jaus.messages.core import (
    ActivateServiceConnection,
    ClearEmergency,
    ConfirmComponentControl,
    ConfirmServiceConnection,
    CreateServiceConnection,
    QueryComponentAuthority,
    QueryComponentControl,
    QueryComponentStatus,
    QueryHeartbeatPulse,
    QueryTime,
    RejectComponentControl,
    ReleaseComponentControl,
    ReportComponentAuthority,
    ReportComponentControl,
    ReportComponentStatus,
    ReportHeartbeatPulse,
    ReportTime,
    RequestComponentControl,
    Reset,
    Resume,
    SetComponentAuthority,
    SetEmergency,
    Shutdown,
    Standby,
    SuspendServiceConnection,
    TerminateServiceConnection,
)
from jaus.messages.discovery import QueryConfiguration, QueryIdentification, QueryServices, QuerySubsystemList
from jaus.messages.events import CancelEvent, CreateEvent, QueryEvents, RejectEventRequest
from jaus.messages.platform import (
    QueryDiscreteDevices,
    QueryGlobalPose,
    QueryLocalPose,
    QueryPlatformSpecifications,
    QueryVelocityState,
    QueryWrenchEffort,
    ReportDiscreteDevices,
    ReportPlatformSpecifications,
    ReportVelocityState,
    ReportWrenchEffort,
    SetDiscreteDevices,
    SetTravelSpeed,
    SetWrenchEffort,
)
from jaus.messages.torc import (
    Horn,
    Lights,
    Motion,
    ReportCurvature,
    ReportErrorCount,
    ReportSignals,
    ReportVehicleMode,
    SetMotionProfile,
    SetSignals,
)
from jaus.stamps import DateStamp, TimeStamp

CLIENT = JausAddress(2, 2, 4, 1)
SEQUENCE = 263
REQUESTED = Acknowledgement.REQUESTED
NM, PD, MPD, SD, EM, VSS = (
    ComponentId.NODE_MANAGER,
    ComponentId.PRIMITIVE_DRIVER,
    ComponentId.MOTION_PROFILE_DRIVER,
    ComponentId.SIGNALS_DRIVER,
    ComponentId.ERROR_MANAGER,
    ComponentId.VELOCITY_STATE_SENSOR,
)


class Golden(NamedTuple):
    message: Decoded
    data: bytes


def to(
    component: int, message: Message, text: str, acknowledgement: Acknowledgement = Acknowledgement.NONE
) -> Golden:
    """Return a message of the client to the vehicle, and its bytes: header and body."""
    vehicle = JausAddress(2, 1, component, 1)
    message.to(vehicle, source=CLIENT, sequence=SEQUENCE, acknowledgement=acknowledgement)
    return Golden(message, bytes.fromhex(text))


def by(component: int, message: Message | Ack, text: str) -> Golden:
    """Return a message of the vehicle to the client, and its bytes: header and body."""
    vehicle = JausAddress(2, 1, component, 1)
    if isinstance(message, Ack):
        message.header = Header(CLIENT, vehicle, SEQUENCE).with_acknowledgement(Acknowledgement.POSITIVE)
    else:
        message.to(CLIENT, source=vehicle, sequence=SEQUENCE)
    return Golden(message, bytes.fromhex(text))


GOLDEN = [
    to(PD, SetComponentAuthority(authority=127), "06020100012101020104020201000701 7f"),
    to(PD, Shutdown(), "06020200012101020104020200000701"),
    to(PD, Standby(), "06020300012101020104020200000701"),
    to(PD, Resume(), "06020400012101020104020200000701"),
    to(PD, Resume(), "16020400012101020104020200000701 ", acknowledgement=REQUESTED),
    by(PD, Ack(code=4, sequence=263), "36020400010402020121010200000701"),
    to(PD, Reset(), "06020500012101020104020200000701"),
    to(PD, SetEmergency(emergency_bits=1), "06020600012101020104020202000701 0100"),
    to(PD, ClearEmergency(emergency_bits=1), "06020700012101020104020202000701 0100"),
    to(
        PD,
        CreateServiceConnection(command_code=0x4002, rate_hz=5.0, requested_presence_vector=0),
        "46020800012101020104020208000701 02402c0100000000",
    ),
    to(
        VSS,
        CreateServiceConnection(command_code=0x4404, rate_hz=50.0, requested_presence_vector=0x1),
        "46020800012a01020104020208000701 0444b90b01000000",
    ),
    to(
        NM,
        CreateServiceConnection(command_code=0xE456, rate_hz=5.0, requested_presence_vector=0xFF),
        "46020800010101020104020208000701 56e42c01ff000000",
    ),
    by(
        PD,
        ConfirmServiceConnection(command_code=0x4405, instance_id=3, rate_hz=20.0, response=0),
        "46020900010402020121010206000701 054403b00400",
    ),
    to(
        PD,
        ActivateServiceConnection(command_code=0x4405, instance_id=3),
        "46020a00012101020104020203000701 054403",
    ),
    to(
        PD,
        SuspendServiceConnection(command_code=0x4405, instance_id=3),
        "46020b00012101020104020203000701 054403",
    ),
    to(
        PD,
        TerminateServiceConnection(command_code=0x4405, instance_id=3),
        "46020c00012101020104020203000701 054403",
    ),
    to(PD, RequestComponentControl(authority=6), "06020d00012101020104020201000701 06"),
    to(PD, ReleaseComponentControl(), "06020e00012101020104020200000701"),
    by(PD, ConfirmComponentControl(response=0), "06020f00010402020121010201000701 00"),
    by(PD, RejectComponentControl(), "06021000010402020121010200000701"),
    to(PD, QueryComponentAuthority(), "06020120012101020104020200000701"),
    to(PD, QueryComponentStatus(), "06020220012101020104020200000701"),
    to(PD, QueryComponentControl(), "06020d20012101020104020200000701"),
    to(NM, QueryTime(requested_presence_vector=0x3), "06021120010101020104020201000701 03"),
    by(PD, ReportComponentAuthority(authority=6), "06020140010402020121010201000701 06"),
    by(
        PD,
        ReportComponentStatus(primary_status=1, secondary_status=0x0000),
        "06020240010402020121010205000701 0100000000",
    ),
    by(
        MPD,
        ReportComponentStatus(primary_status=2, secondary_status=0x1110000),
        "0602024001040202010a010205000701 0200001101",
    ),
    by(
        PD,
        ReportComponentControl(subsystem=2, node=2, component=4, instance=1, authority=6),
        "06020d40010402020121010205000701 0202040106",
    ),
    by(
        NM,
        ReportTime(time_stamp=TimeStamp(31, 23, 2, 1, 999).packed, date_stamp=DateStamp(2026, 12, 31).packed),
        "06021140010402020101010207000701 03e707c2fd9f35",
    ),
    to(NM, QueryHeartbeatPulse(), "06020222010101020104020200000701"),
    by(NM, ReportHeartbeatPulse(), "06020242010402020101010200000701"),
    to(NM, QueryIdentification(query_type=2), "0602002b010101020104020201000701 02"),
    to(PD, QueryIdentification(query_type=4), "0602002b012101020104020201000701 04"),
    to(NM, QueryConfiguration(query_type=2), "0602012b010101020104020201000701 02"),
    to(NM, QueryConfiguration(query_type=3), "0602012b010101020104020201000701 03"),
    to(NM, QuerySubsystemList(), "0602022b010101020104020200000701"),
    to(PD, QueryServices(), "0602032b012101020104020200000701"),
    to(
        PD,
        QueryPlatformSpecifications(requested_presence_vector=0x1FFFFF),
        "06020024012101020104020204000701 ffff1f00",
    ),
    by(
        PD,
        ReportPlatformSpecifications(max_velocity_x_mps=35.0),
        "06020044010402020121010206000701 00800000b888",
    ),
    to(VSS, QueryVelocityState(requested_presence_vector=0x1FF), "06020424012a01020104020202000701 ff01"),
    by(VSS, ReportVelocityState(velocity_x_mps=12.5), "0602044401040202012a010206000701 0100d4306a18"),
    by(VSS, ReportVelocityState(velocity_x_mps=-3.25), "0602044401040202012a010206000701 01004ff3a6f9"),
    to(PD, QueryWrenchEffort(requested_presence_vector=0x61), "06020524012101020104020202000701 6100"),
    to(
        PD,
        SetWrenchEffort(
            propulsive_linear_x_percent=25.0,
            propulsive_rotational_z_percent=-40.0,
            resistive_linear_x_percent=10.0,
        ),
        "06020504012101020104020207000701 61000020cecc1a",
    ),
    to(PD, SetWrenchEffort(propulsive_linear_x_percent=100.0), "06020504012101020104020204000701 0100ff7f"),
    by(
        PD,
        ReportWrenchEffort(
            propulsive_linear_x_percent=25.0,
            propulsive_rotational_z_percent=-40.0,
            resistive_linear_x_percent=10.0,
        ),
        "06020544010402020121010207000701 61000020cecc1a",
    ),
    to(PD, QueryDiscreteDevices(requested_presence_vector=0xF), "06020624012101020104020201000701 0f"),
    to(PD, SetDiscreteDevices(gear=2), "06020604012101020104020202000701 0402"),
    to(PD, SetDiscreteDevices(gear=129), "06020604012101020104020202000701 0481"),
    to(PD, SetDiscreteDevices(propulsion_bits=0x43), "06020604012101020104020202000701 0143"),
    by(
        PD,
        ReportDiscreteDevices(propulsion_bits=0x83, brake_horn_bits=0x1, gear=128, transfer_case=1),
        "06020644010402020121010205000701 0f83018001",
    ),
    to(38, QueryGlobalPose(requested_presence_vector=0x1FF), "06020224012601020104020202000701 ff01"),
    to(41, QueryLocalPose(requested_presence_vector=0x43), "06020324012901020104020202000701 4300"),
    to(34, SetTravelSpeed(speed_mps=13.4), "06020a04012201020104020202000701 5800"),
    to(
        PD,
        CreateEvent(request_id=9, command_code=0x4002, event_type=0, rate_hz=10.0),
        "0602f001012101020104020207000701 40090240005802",
    ),
    to(
        PD,
        CancelEvent(request_id=9, command_code=0x4002, event_id=1),
        "0602f201012101020104020205000701 0309024001",
    ),
    by(PD, RejectEventRequest(request_id=9, response=5), "0602f401010402020121010203000701 000905"),
    to(PD, QueryEvents(command_code=0x4002, event_id=1), "0602f021012101020104020204000701 05024001"),
    to(
        MPD,
        SetMotionProfile(motions=(Motion(5.0, 2.0, 0.1, 0.06, 400),)),
        "860228e3010a0102010402020c000701 0101c4891f05268889019001",
    ),
    to(
        SD,
        SetSignals(turn_signal=1, horn=Horn(1), lights=Lights(10)),
        "860222e3010b01020104020209000701 0007010100000a0000",
    ),
    by(
        SD,
        ReportSignals(turn_signal=2, horn=Horn(0), lights=Lights(18)),
        "860245e401040202010b010209000701 000702000000120000",
    ),
    by(
        MPD,
        ReportCurvature(version=1, atan_curvature_rad=0.12345, time_stamp=TimeStamp(8, 7, 6, 45, 123).packed),
        "860255e401040202010a010207000701 010f8a7bb4c641",
    ),
    by(EM, ReportErrorCount(version=1, reserved=0, errors=()), "860251e401040202010c010203000701 010000"),
    by(
        NM,
        ReportVehicleMode(
            version=0,
            control_mode=3,
            ready_mode=2,
            safety_mode=1,
            partial_override_bits=0,
            safety_device_bits=0x0010,
        ),
        "860256e4010402020101010207000701 00030201001000",
    ),
]
