"""Cars on a JAUS network, over the loopback transport: who is heard, who is answered, what they are told."""

from __future__ import annotations

import math

import pytest

from jaus.address import JausAddress
from jaus.component import ComponentStatus
from jaus.messages import Ack
from jaus.messages.core import (
    ConfirmComponentControl,
    ConfirmServiceConnection,
    CreateServiceConnection,
    QueryComponentControl,
    QueryComponentStatus,
    QueryTime,
    RejectComponentControl,
    ReleaseComponentControl,
    ReportComponentControl,
    ReportComponentStatus,
    ReportHeartbeatPulse,
    ReportTime,
    RequestComponentControl,
    Resume,
    SetEmergency,
    Standby,
    TerminateServiceConnection,
)
from jaus.messages.discovery import (
    QueryConfiguration,
    QueryIdentification,
    QueryServices,
    ReportConfiguration,
    ReportIdentification,
    ReportServices,
)
from jaus.messages.platform import (
    QueryDiscreteDevices,
    QueryVelocityState,
    QueryWrenchEffort,
    ReportDiscreteDevices,
    ReportVelocityState,
    ReportWrenchEffort,
    SetDiscreteDevices,
    SetWrenchEffort,
)
from jaus.messages.torc import (
    ClearErrors,
    QueryErrorCount,
    QuerySignals,
    QueryVehicleMode,
    QueryWheelsSpeed,
    ReportErrorCount,
    ReportSignals,
    ReportVehicleMode,
    ReportWheelsSpeed,
    SetMotionProfile,
    SetSignals,
)
from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from tests.xgv_cosim.simulation.bare_world import Car, injection
from tests.xgv_cosim.simulation.wire_client import (
    CARS,
    EM,
    MPD,
    NM,
    OTHER,
    OWN,
    PD,
    SD,
    VSS,
    WireClient,
    motion,
    reachable,
)
from xgv_cosim.commands import CommandKind
from xgv_cosim.errors import LinkError
from xgv_cosim.injection import InjectionKind
from xgv_cosim.links.jaus_network import JausNetwork
from xgv_cosim.simulation import Simulation
from xgv_cosim.simulation.addresses import stack_address
from xgv_cosim.vehicles.xgv.settings import Firmware, XgvSettings

ONE = {"car": Car(speed_mps=0.0)}


def refusals(run: Simulation) -> list[str]:
    return [event.reasons[0] for event in run.state.journal.events if event.kind == "command_refused"]


def drive(run: Simulation, client: WireClient, seconds: float, speed_mps: float = 5.0) -> None:
    """Repeat control and a profile in every step, as TORC's client does."""
    until_s = run.now_s + seconds
    while run.now_s < until_s - 1e-9:
        client.take_control()
        client.say(motion(speed_mps), MPD)
        run.step()


def test_a_client_takes_control_and_drives_xgv_20_58() -> None:
    """XGV-20, XGV-58: Request, Resume both, profiles; positive curvature turns right on the wire."""
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    drive(run, client, 3.0)
    assert [answer.response for answer in client.listen(ConfirmComponentControl)] == [0] * 30
    assert run.vehicle("car").speed_mps == pytest.approx(5.0, abs=0.3)
    for _ in range(20):
        client.say(motion(5.0, atan_curvature_rad=0.05), MPD)
        run.step()
    slot = run.fleet.slot_of("car")
    assert run.fleet.motion.curvature_per_m[slot] == pytest.approx(-math.tan(0.05), abs=1e-3)
    client.say(QueryVelocityState(0xFFFF), VSS)
    client.say(QueryWheelsSpeed(), PD)
    run.step()
    (velocity,), (wheels,) = client.listen(ReportVelocityState), client.listen(ReportWheelsSpeed)
    assert velocity.presence_vector == 0x0101
    assert velocity.velocity_x_mps == pytest.approx(run.vehicle("car").speed_mps, abs=0.3)
    assert wheels.left_front_mps > wheels.right_front_mps  # it turns right
    assert wheels.left_rear_mps > wheels.right_rear_mps


def test_what_one_has_the_other_does_not_get_and_more_authority_takes_it_xgv_66() -> None:
    """XGV-66: a higher authority preempts, and the loser is told by a Reject."""
    run, loopback = reachable(ONE)
    first, second = WireClient(loopback), WireClient(loopback, "second", OTHER)
    drive(run, first, 0.3)
    second.say(RequestComponentControl(6), MPD)
    run.step()
    assert len(second.listen(RejectComponentControl)) == 1
    assert first.listen(RejectComponentControl) == []
    second.say(RequestComponentControl(7), MPD)
    run.step()
    (confirmed,) = second.listen(ConfirmComponentControl)
    assert confirmed.header.sequence == 7
    assert [told.header.source.component for told in first.listen(RejectComponentControl)] == [MPD]
    first.say(QueryComponentControl(), MPD)
    run.step()
    (held,) = first.listen(ReportComponentControl)
    assert (held.controller, held.authority) == (OTHER, 7)


def test_who_gives_control_back_is_told_nothing() -> None:
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    drive(run, client, 0.3)
    client.listen(ConfirmComponentControl)
    client.say(ReleaseComponentControl(), MPD)
    run.step()
    assert client.listen(RejectComponentControl) == []
    client.say(QueryComponentControl(), MPD)
    client.say(QueryComponentControl(), PD)
    run.step()
    assert [held.controller for held in client.listen(ReportComponentControl)] == [None, None]


def test_a_forged_source_neither_commands_nor_releases_xgv_65() -> None:
    """XGV-65: a controller is its JAUS id and its address."""
    run, loopback = reachable(ONE)
    client, forger = WireClient(loopback), WireClient(loopback, "forger")  # the same JAUS id
    drive(run, client, 1.0)
    speed_mps = run.vehicle("car").speed_mps
    for message in (motion(30.0), ReleaseComponentControl(), RequestComponentControl(255), Standby()):
        forger.say(message, MPD)
        client.say(motion(speed_mps), MPD)
        run.step()
    assert run.vehicle("car").speed_mps == pytest.approx(speed_mps, abs=0.2)
    assert run.state.vehicles["car"].endpoint.component_controller[MPD] == OWN
    assert set(refusals(run)) == {"100.2.40.1 speaks from elsewhere than forger"}
    assert forger.listen(ConfirmComponentControl) == []


def test_nobody_on_the_network_speaks_as_a_stack_of_this_process_xgv_65() -> None:
    """XGV-65: the reference stack's address, used from outside."""
    run, loopback = reachable({"car": Car(speed_mps=5.0)}, with_stacks=True)
    run.run_until(1.0)
    stack = run.state.vehicles["car"].endpoint.component_controller[MPD]
    assert stack is not None
    forger = WireClient(loopback, address=stack)
    forger.say(ReleaseComponentControl(), MPD)
    run.step()
    assert run.state.vehicles["car"].endpoint.component_controller[MPD] == stack
    assert len(refusals(run)) == 1


def test_without_control_nothing_moves_the_car_xgv_10() -> None:
    """XGV-10: profiles, efforts and gears of one who has not asked."""
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    for _ in range(10):
        client.say(Resume(), PD)
        client.say(Resume(), MPD)
        client.say(motion(10.0), MPD)
        client.say(SetWrenchEffort(propulsive_linear_x_percent=100.0), PD)
        run.step()
    assert run.vehicle("car").speed_mps == 0.0
    assert len(refusals(run)) == 2  # a profile, efforts; each told once


def test_an_axis_that_a_message_leaves_out_keeps_its_effort_xgv_59() -> None:
    """XGV-59: throttle, steering to the right, and brake, each by itself."""
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    client.say(RequestComponentControl(6), PD)
    client.say(Resume(), PD)
    client.say(SetWrenchEffort(propulsive_linear_x_percent=40.0), PD)
    run.step()
    for _ in range(10):
        client.say(SetWrenchEffort(propulsive_rotational_z_percent=20.0), PD)
        run.step()
    client.say(QueryWrenchEffort(0xFFFF), PD)
    run.step()
    (efforts,) = client.listen(ReportWrenchEffort)
    assert efforts.presence_vector == 0x61
    assert efforts.propulsive_linear_x_percent == pytest.approx(40.0, abs=2.0)  # what is in effect lags
    assert efforts.propulsive_rotational_z_percent == pytest.approx(20.0, abs=1.0)
    assert efforts.resistive_linear_x_percent == 0.0
    assert run.fleet.motion.steer_rad[run.fleet.slot_of("car")] < 0.0


def test_modes_and_devices_are_reported_as_they_are_xgv_45_46_57() -> None:
    """XGV-45 Report Vehicle Mode, XGV-46 secondary status, XGV-57 devices."""
    run, loopback = reachable(ONE, [injection(50, InjectionKind.DOOR, "car")])
    client = WireClient(loopback)
    drive(run, client, 0.4)
    client.say(QueryVehicleMode(), NM)
    client.say(QueryComponentStatus(), MPD)
    client.say(QueryComponentStatus(), VSS)
    client.say(QueryDiscreteDevices(0xFF), PD)
    run.step()
    (mode,), (driver, sensor) = client.listen(ReportVehicleMode), client.listen(ReportComponentStatus)
    assert mode.control_mode == ControlMode.MOTION_PROFILES
    assert mode.ready_mode == ReadyMode.READY
    assert mode.safety_mode == SafetyMode.DRIVE_BY_WIRE
    assert mode.safety_device_bits == 0x10
    assert (driver.primary_status, driver.secondary_status) == (ComponentStatus.READY, 0x0010_0000)
    assert (sensor.primary_status, sensor.secondary_status) == (ComponentStatus.READY, 0)
    (devices,) = client.listen(ReportDiscreteDevices)
    assert devices.presence_vector == 0x07
    assert (devices.propulsion_bits, devices.brake_horn_bits, devices.gear) == (0x43, 0, 2)
    drive(run, client, 0.4)
    client.say(QueryVehicleMode(), NM)
    client.say(QueryErrorCount(), EM)
    run.step()
    (mode,), (errors,) = client.listen(ReportVehicleMode), client.listen(ReportErrorCount)
    assert mode.safety_mode == SafetyMode.SOFTWARE_PAUSE
    assert mode.safety_device_bits == 0x50
    assert 9176 in errors.errors


def test_firmware_that_lacks_report_vehicle_mode_ignores_query_and_connection_xgv_53() -> None:
    """XGV-53: 1.0 and 1.1 do not answer at all; the standard way works (XGV-44)."""
    run, loopback = reachable(ONE, settings=XgvSettings(firmware=Firmware.V1_1))
    client = WireClient(loopback)
    client.say(QueryVehicleMode(), NM)
    client.say(CreateServiceConnection(ReportVehicleMode.code, 5.0, 0xFF), NM)
    client.say(CreateServiceConnection(ReportComponentStatus.code, 5.0, 0), MPD)
    run.run_until(0.5)
    assert client.listen(ReportVehicleMode) == []
    assert [c.command_code for c in client.listen(ConfirmServiceConnection)] == [ReportComponentStatus.code]
    assert len(client.listen(ReportComponentStatus)) >= 2


def test_signals_and_devices_by_message_xgv_60_61() -> None:
    """XGV-60, XGV-61: Set Signals of anyone; a gear and an engine; what is no code is refused."""
    run, loopback = reachable(ONE)
    client, stranger = WireClient(loopback), WireClient(loopback, "stranger", OTHER)
    stranger.say(SetSignals(turn_signal=1), SD)
    client.say(RequestComponentControl(6), PD)
    client.say(Resume(), PD)
    run.step()
    for _ in range(20):
        client.say(SetWrenchEffort(resistive_linear_x_percent=50.0), PD)
        client.say(SetDiscreteDevices(gear=200), PD)
        run.step()
    client.say(QuerySignals(), SD)
    client.say(QueryDiscreteDevices(0xFF), PD)
    client.say(SetDiscreteDevices(propulsion_bits=0), PD)
    run.step()
    (reported,), (devices,) = client.listen(ReportSignals), client.listen(ReportDiscreteDevices)
    assert reported.turn_signal == 1
    assert (devices.gear, devices.propulsion_bits) == (129, 0x43)
    changes = [(e.kind, e.after) for e in run.state.journal.events if e.kind in {"gear", "engine", "signals"}]
    assert changes[:3] == [("signals", "turn left"), ("gear", "reverse"), ("engine", "off")]
    client.say(SetSignals(turn_signal=9), SD)
    run.step()
    assert any("SetSignals" in reason for reason in refusals(run))


def test_a_command_of_one_component_sent_to_another_does_nothing_xgv_09() -> None:
    """XGV-09: efforts to the Motion Profile Driver, profiles to the Primitive Driver, control of a sensor."""
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    client.take_control()
    run.step()
    client.listen(ConfirmComponentControl)
    client.say(motion(5.0), PD)
    client.say(SetWrenchEffort(propulsive_linear_x_percent=50.0), MPD)
    client.say(RequestComponentControl(6), VSS)
    run.run_until(1.0)
    assert run.vehicle("car").speed_mps == 0.0
    assert client.listen(ConfirmComponentControl) == []


def test_no_motion_at_all_is_refused_with_its_reason() -> None:
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    client.take_control()
    client.say(SetMotionProfile(motions=()), MPD)
    run.step()
    assert any("expected one or more" in reason for reason in refusals(run))


def test_a_refusal_has_one_name_wherever_it_is_found() -> None:
    """The command's: of a message without meaning, of a stranger, of a forger; accepted, it is forgotten."""
    run, loopback = reachable(ONE)
    client, stranger = WireClient(loopback), WireClient(loopback, "stranger", OTHER)
    forger = WireClient(loopback, "forger")
    for _ in range(2):
        client.take_control()
        for bad in (SetMotionProfile(motions=()), SetMotionProfile(version=9, motions=motion().motions)):
            client.say(bad, MPD)
        client.say(motion(), MPD)
        run.step()
    profiles = [e.after for e in run.state.journal.events if e.kind == "command_refused"]
    assert profiles == ["MotionProfile"] * 4
    stranger.say(efforts(brake=10.0), PD)
    stranger.say(SetSignals(turn_signal=9), SD)
    forger.say(efforts(brake=10.0), PD)
    forger.say(SetDiscreteDevices(gear=2), PD)
    run.step()
    others = [e.after for e in run.state.journal.events if e.kind == "command_refused"][4:]
    assert others == ["WrenchEffort", "Signals", "WrenchEffort", "DiscreteDevices"]


def test_a_lost_link_lets_nothing_through_either_way() -> None:
    """The stack's link: no datagram of the client arrives, and the car is silent on the network."""
    run, loopback = reachable(ONE, [injection(50, InjectionKind.CMD_LOSS, "car", end_tick=150)])
    client = WireClient(loopback)
    client.say(CreateServiceConnection(ReportVelocityState.code, 10.0, 0xFFFF), VSS)
    drive(run, client, 0.5)
    client.listen(ReportVelocityState)
    client.listen(ConfirmComponentControl)
    client.listen(ReportHeartbeatPulse)
    drive(run, client, 0.9)
    assert client.listen(ReportVelocityState) == []
    assert client.listen(ConfirmComponentControl) == []
    assert client.listen(ReportHeartbeatPulse) == []
    drive(run, client, 1.0)
    assert len(client.listen(ReportVelocityState)) >= 4
    assert len(client.listen(ReportHeartbeatPulse)) >= 1


@pytest.mark.parametrize("kind", [InjectionKind.FROZEN, InjectionKind.INACTIVE])
def test_a_controller_that_computes_nothing_is_silent_xgv_32_67(kind: InjectionKind) -> None:
    """XGV-32, XGV-67: no answer, no acknowledgement, no heartbeat."""
    run, loopback = reachable(ONE, [injection(20, kind, "car")])
    client = WireClient(loopback)
    run.run_until(0.5)
    client.listen(ReportHeartbeatPulse)
    client.say(QueryComponentStatus(), MPD)
    client.say(motion(), MPD, wants_ack=True)
    run.run_until(3.0)
    assert client.listen(object) == []


def test_commands_are_acknowledged_on_arrival_where_that_is_asked_for() -> None:
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    client.say(motion(), MPD, wants_ack=True)
    run.communicate()
    (ack,) = client.listen(Ack)
    assert (ack.code, ack.sequence, ack.positive) == (SetMotionProfile.code, 7, True)


def test_a_request_that_is_under_way_is_answered_when_it_has_arrived() -> None:
    """With latency on commands (``bind.plant.imperfections``) the answer comes as late."""
    run, loopback = reachable(ONE, command_latency_s=0.25)
    client = WireClient(loopback)
    client.say(RequestComponentControl(6), MPD)
    answered_s = None
    while answered_s is None and run.now_s < 1.0:
        run.step()
        if client.listen(ConfirmComponentControl):
            answered_s = run.now_s
    assert answered_s == pytest.approx(0.3)
    assert client.listen(RejectComponentControl) == []


def test_a_controller_is_not_silent_as_long_as_anything_comes_from_it_xgv_65() -> None:
    """XGV-65: queries count; after five seconds without anything control is lost, and he is told."""
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    client.take_control()
    while run.now_s < 8.0:
        client.say(QueryComponentStatus(), MPD)
        run.step()
    assert run.state.vehicles["car"].endpoint.component_controller[MPD] == OWN
    client.listen(RejectComponentControl)
    run.run_until(14.0)
    assert run.state.vehicles["car"].endpoint.component_controller[MPD] is None
    assert {told.header.source.component for told in client.listen(RejectComponentControl)} == {MPD}


def test_set_emergency_of_anyone_pauses_the_car_xgv_63() -> None:
    """XGV-63; without bit 0 the message says nothing."""
    run, loopback = reachable(ONE)
    client, stranger = WireClient(loopback), WireClient(loopback, "stranger", OTHER)
    drive(run, client, 0.5)
    stranger.say(SetEmergency(0), MPD)
    run.step()
    assert run.vehicle("car").mode == "drive_by_wire"
    stranger.say(SetEmergency(), MPD)
    run.step()
    run.step()
    assert run.vehicle("car").mode == "software_pause"


def test_errors_are_cleared_by_the_error_manager_xgv_38() -> None:
    """XGV-38: latched errors whose cause is gone; the message is proposed (jaus-wire, 6.11)."""
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    run.vehicle("car").inject("error", code=9109)
    run.step()
    run.vehicle("car").inject("error", code=9109, begins=False)
    run.step()
    assert 9109 in run.state.vehicles["car"].endpoint.errors
    client.say(ClearErrors(), EM)  # nobody who controls the car
    client.take_control()
    client.say(ClearErrors(), PD)  # not the Error Manager
    run.run_until(0.5)
    assert 9109 in run.state.vehicles["car"].endpoint.errors
    assert "100.2.40.1 controls no component of the car" in refusals(run)
    client.say(ClearErrors(), EM)
    run.run_until(0.8)
    assert 9109 not in run.state.vehicles["car"].endpoint.errors


def test_errors_are_cleared_by_who_has_control_at_that_moment_xgv_38_65() -> None:
    """XGV-38, XGV-65: control has gone over between two looks at the network; a forger is told as one."""
    run, loopback = reachable(ONE, lockstep=False, command_latency_s=0.05)
    first, second = WireClient(loopback), WireClient(loopback, "second", OTHER)
    forger = WireClient(loopback, "forger")
    first.say(RequestComponentControl(6), MPD)
    run.communicate(0.0)
    run.step()
    run.communicate(0.1)
    forger.say(ClearErrors(), EM)
    second.say(RequestComponentControl(7), MPD)
    run.communicate(0.15)
    assert refusals(run) == ["100.2.40.1 speaks from elsewhere than forger"]
    run.step()  # the request acts in it
    assert run.state.vehicles["car"].endpoint.component_controller[MPD] == OTHER
    first.say(ClearErrors(), EM)
    run.communicate(0.2)
    assert run.state.errors_to_clear == []
    assert refusals(run)[1:] == ["100.2.40.1 controls no component of the car"]


def test_a_new_controller_clears_errors_at_once_xgv_38() -> None:
    """XGV-38: he has control since the last look at the network."""
    run, loopback = reachable(ONE, lockstep=False, command_latency_s=0.05)
    client = WireClient(loopback)
    client.say(RequestComponentControl(6), MPD)
    run.communicate(0.0)
    run.step()
    assert run.state.vehicles["car"].endpoint.component_controller[MPD] == OWN
    client.say(ClearErrors(), EM)
    run.communicate(0.1)
    assert run.state.errors_to_clear == ["car"]
    assert refusals(run) == []


def test_a_vehicle_says_that_it_is_simulated_and_what_it_is_made_of() -> None:
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    client.say(QueryIdentification(2), NM)
    client.say(QueryIdentification(4), PD)
    client.say(QueryConfiguration(2), NM)
    client.say(QueryServices(), MPD)
    client.say(QueryTime(1), NM)
    run.step()
    names = [answer.identification for answer in client.listen(ReportIdentification)]
    assert names == ["SIMULATED XGV car", "SIMULATED Primitive Driver"]
    (configuration,) = client.listen(ReportConfiguration)
    assert {each.component for each in configuration.nodes[0].components} == {1, 10, 11, 12, 33, 42}
    (services,) = client.listen(ReportServices)
    taken = {each.command_code for service in services.services for each in service.inputs}
    assert {SetMotionProfile.code, Resume.code, QueryComponentStatus.code} <= taken
    assert len(client.listen(ReportTime)) == 1


def test_cars_come_and_go_with_the_subsystem_of_their_slot() -> None:
    """A client with service connections is told when a car leaves; the next one has its number."""
    cars = {
        "first": Car(5.0, leaves_s=1.0),
        "second": Car(5.0, enters_s=0.5),
        "third": Car(5.0, enters_s=1.5),
    }
    run, loopback = reachable(cars)
    client = WireClient(loopback)
    client.say(CreateServiceConnection(ReportVelocityState.code, 10.0, 0xFFFF), VSS)
    run.run_until(1.3)
    assert len(client.listen(TerminateServiceConnection)) == 1
    run.run_until(2.0)
    told = [(e.vehicle, e.after) for e in run.state.journal.events if e.kind == "jaus_subsystem"]
    assert told == [("first", "1"), ("second", "2"), ("third", "1")]
    client.say(QueryIdentification(2), NM)
    run.step()
    assert [a.identification for a in client.listen(ReportIdentification)] == ["SIMULATED XGV third"]


def test_who_is_past_254_is_behind_a_second_port() -> None:
    run, loopback = reachable({f"car{number}": Car(0.0) for number in range(256)})
    places = {
        event.vehicle: (event.after, event.reasons)
        for event in run.state.journal.events
        if event.kind == "jaus_subsystem"
    }
    assert places["car253"] == ("254", ("at cars:0",))
    assert places["car254"] == ("1", ("at cars:1",))
    assert places["car255"] == ("2", ("at cars:1",))
    client = WireClient(loopback, car=("cars", 1))
    client.say(QueryIdentification(2), NM, 2)
    run.step()
    assert [a.identification for a in client.listen(ReportIdentification)] == ["SIMULATED XGV car255"]


def test_junk_is_counted_and_nothing_else() -> None:
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    wire = run._wire
    assert wire is not None
    for junk in (b"", b"\x01", b"\xff" * 50, b"JAUS01.0" + b"\x00" * 7):
        client.transport.send([(junk, ("cars", 0))])
    run.step()
    counts = wire.network.counts
    assert counts.datagrams_received == 4
    assert counts.refused >= 3
    assert counts.first_refusal.startswith("client: ")
    assert client.listen(object) == []


def test_what_a_stranger_was_refused_acts_in_no_later_message_xgv_10_59() -> None:
    """XGV-10, XGV-59: a controller who leaves an axis out gets his own, never a stranger's."""
    run, loopback = reachable(ONE)
    client, stranger = WireClient(loopback), WireClient(loopback, "stranger", OTHER)
    client.say(RequestComponentControl(6), PD)
    client.say(Resume(), PD)
    for _ in range(20):
        stranger.say(
            SetWrenchEffort(propulsive_linear_x_percent=100.0, propulsive_rotational_z_percent=50.0), PD
        )
        client.say(SetWrenchEffort(resistive_linear_x_percent=0.0), PD)
        run.step()
    slot = run.fleet.slot_of("car")
    command = run.fleet.command
    assert (command.throttle[slot], command.steering[slot]) == (0.0, 0.0)
    assert abs(run.fleet.motion.heading_rad[slot]) < 1e-9


def efforts(
    throttle: float | None = None, to_right: float | None = None, brake: float | None = None
) -> SetWrenchEffort:
    return SetWrenchEffort(
        propulsive_linear_x_percent=throttle,
        propulsive_rotational_z_percent=to_right,
        resistive_linear_x_percent=brake,
    )


def executed(run: Simulation) -> tuple[float, float, float]:
    """Return throttle, brake and steering of the efforts in force."""
    command, slot = run.fleet.command, run.fleet.slot_of("car")
    assert command.kind[slot] == CommandKind.WRENCH_EFFORT
    return float(command.throttle[slot]), float(command.brake[slot]), float(command.steering[slot])


def test_an_axis_that_is_left_out_keeps_what_is_in_force_when_the_message_acts_xgv_59() -> None:
    """XGV-59, with latency: braking is under way when the message that steers only arrives."""
    run, loopback = reachable(ONE, command_latency_s=0.25)
    client = WireClient(loopback)
    client.say(RequestComponentControl(6), PD)
    client.say(Resume(), PD)
    client.say(efforts(100.0, 0.0, 0.0), PD)
    run.run_until(0.5)
    assert executed(run) == (1.0, 0.0, 0.0)
    client.say(efforts(throttle=0.0, brake=60.0), PD)
    client.say(efforts(to_right=20.0), PD)
    run.run_until(1.0)
    assert executed(run) == pytest.approx((0.0, 0.6, -0.2), abs=0.003)


def test_nothing_of_a_former_controllers_efforts_comes_back_xgv_59_66() -> None:
    """XGV-59, XGV-66, with latency: the new controller's brake is under way while the former one drives."""
    run, loopback = reachable(ONE, command_latency_s=0.25)
    first, second = WireClient(loopback), WireClient(loopback, "second", OTHER)
    first.say(RequestComponentControl(6), PD)
    first.say(Resume(), PD)
    first.say(efforts(100.0, 50.0, 0.0), PD)
    run.run_until(0.5)
    assert executed(run) == pytest.approx((1.0, 0.0, -0.5), abs=0.003)
    second.say(RequestComponentControl(7), PD)
    second.say(Resume(), PD)
    second.say(efforts(brake=30.0), PD)
    run.run_until(1.0)
    assert executed(run) == pytest.approx((0.0, 0.3, 0.0), abs=0.003)


@pytest.mark.parametrize("asks_too", [False, True])
def test_a_forged_source_is_one_with_latency_too_xgv_65(asks_too: bool) -> None:
    """XGV-65: between a request's arrival and the moment at which it acts."""
    run, loopback = reachable(ONE, command_latency_s=0.25)
    client, forger = WireClient(loopback), WireClient(loopback, "forger")
    client.take_control()
    run.communicate()
    if asks_too:
        forger.say(RequestComponentControl(6), MPD)
    forger.say(motion(20.0, duration_ms=5000), MPD)
    run.run_until(1.0)
    assert run.vehicle("car").speed_mps == 0.0
    assert len(client.listen(ConfirmComponentControl)) == 1
    assert client.listen(RejectComponentControl) == []
    assert len(forger.listen(RejectComponentControl)) == asks_too


def test_the_stack_of_this_process_is_nobody_elses_even_before_it_asks_xgv_65() -> None:
    """XGV-65: its address is claimed from outside in the very first step."""
    run, loopback = reachable({"car": Car(5.0)}, with_stacks=True)
    forger = WireClient(loopback, address=stack_address(run.fleet.slot_of("car")))
    forger.take_control()
    run.run_until(1.0)
    assert len(forger.listen(RejectComponentControl)) == 1
    assert forger.listen(ConfirmComponentControl) == []
    assert run.vehicle("car").mode == "drive_by_wire"


def test_a_strangers_release_does_not_hide_that_control_is_lost() -> None:
    run, loopback = reachable(ONE, lockstep=False)
    first, second = WireClient(loopback), WireClient(loopback, "second", OTHER)
    first.take_control()
    run.communicate(0.1)
    second.say(ReleaseComponentControl(), MPD)
    second.say(RequestComponentControl(9), MPD)
    second.say(ReleaseComponentControl(), PD)
    run.step()
    run.communicate(0.2)
    assert len(first.listen(RejectComponentControl)) == 1


@pytest.mark.parametrize("latency_s", [0.0, 0.25])
def test_who_gave_back_one_component_is_told_that_he_has_lost_the_other_xgv_66(latency_s: float) -> None:
    """XGV-66: he controls both himself, and releases the Primitive Driver only."""
    run, loopback = reachable(ONE, command_latency_s=latency_s)
    first, second = WireClient(loopback), WireClient(loopback, "second", OTHER)
    for component in (PD, MPD):
        first.say(RequestComponentControl(6), component)
    run.run_until(0.5)
    holders = run.state.vehicles["car"].endpoint.component_controller
    assert holders == {PD: OWN, MPD: OWN}
    first.say(ReleaseComponentControl(), PD)
    second.say(RequestComponentControl(9), MPD)
    run.run_until(1.0)
    assert [told.header.source.component for told in first.listen(RejectComponentControl)] == [MPD]
    assert len(second.listen(ConfirmComponentControl)) == 1


@pytest.mark.parametrize("latency_s", [0.0, 0.25])
def test_a_release_of_what_one_does_not_hold_hides_no_later_loss_xgv_66(latency_s: float) -> None:
    """XGV-66: neither of the same component nor of the other one."""
    run, loopback = reachable(ONE, command_latency_s=latency_s)
    first, second = WireClient(loopback), WireClient(loopback, "second", OTHER)
    first.say(ReleaseComponentControl(), MPD)
    first.say(RequestComponentControl(6), MPD)
    first.say(ReleaseComponentControl(), PD)  # which the Motion Profile Driver has
    second.say(RequestComponentControl(9), MPD)
    run.run_until(0.5)
    assert len(first.listen(ConfirmComponentControl)) == (1 if latency_s == 0.0 else 0)
    assert len(second.listen(ConfirmComponentControl)) == 1
    second.say(ReleaseComponentControl(), PD)
    first.say(RequestComponentControl(10), MPD)
    run.run_until(1.0)
    assert [told.header.source.component for told in second.listen(RejectComponentControl)] == [MPD]


def test_through_a_lost_link_nobody_is_told_that_he_has_lost_control() -> None:
    """Nor does traffic to another car keep the control of this one (XGV-65)."""
    run, loopback = reachable(
        {"car": Car(0.0), "other": Car(0.0)}, [injection(50, InjectionKind.CMD_LOSS, "car")]
    )
    client = WireClient(loopback)
    client.take_control()
    run.run_until(0.4)
    client.listen(object)
    while run.now_s < 8.0:
        client.say(QueryComponentStatus(), MPD, 2)
        run.step()
    assert run.state.vehicles["car"].endpoint.component_controller[MPD] is None
    assert client.listen(RejectComponentControl) == []


def test_a_command_to_more_than_one_car_moves_none() -> None:
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    for _ in range(5):
        client.say(RequestComponentControl(6), MPD, 255)
        client.say(Resume(), PD, 255)
        client.say(Resume(), MPD, 255)
        client.say(motion(), MPD, 255)
        run.step()
    assert run.state.vehicles["car"].endpoint.component_controller[MPD] is None


def test_every_one_of_a_hundred_clients_is_served() -> None:
    """Each car has a client of its own, at a place of its own."""
    run, loopback = reachable({f"car{number}": Car(0.0) for number in range(100)})
    addresses = [JausAddress(number + 1, 3, 40, 1) for number in range(100)]
    clients = [WireClient(loopback, f"client{n}", address) for n, address in enumerate(addresses)]
    for number, client in enumerate(clients):
        client.say(RequestComponentControl(6), MPD, number + 1)
    run.step()
    assert [len(client.listen(ConfirmComponentControl)) for client in clients] == [1] * 100


def test_a_report_asked_of_the_wrong_component_is_refused_with_its_response() -> None:
    run, loopback = reachable(ONE)
    client = WireClient(loopback)
    client.say(CreateServiceConnection(ReportVehicleMode.code, 5.0, 0xFF), PD)
    run.step()
    assert [answer.response for answer in client.listen(ConfirmServiceConnection)] == [2]


def test_a_simulation_is_on_one_network() -> None:
    run, loopback = reachable(ONE)
    with pytest.raises(LinkError, match="on a network already"):
        run.connect(JausNetwork(lambda _: loopback.open("elsewhere")))


def test_a_record_that_cannot_be_written_ends_the_run_and_closes_the_world() -> None:
    """And gives the ports back, though the client of a service connection cannot be told."""

    class Full:
        fails = False

        def record(self, *_: object) -> None:
            if self.fails:
                raise OSError(28, "No space left on device")

        def close(self) -> None:
            raise OSError(28, "No space left on device")

    record = Full()
    run, loopback = reachable(ONE)
    assert run._wire is not None
    run._wire.network.record_with(record)  # type: ignore[arg-type]
    client = WireClient(loopback)
    client.say(CreateServiceConnection(ReportVelocityState.code, 10.0, 0xFFFF), VSS)
    run.step()
    assert len(client.listen(ReportVelocityState)) == 1
    record.fails = True
    client.say(QueryComponentStatus(), MPD)
    with pytest.raises(LinkError, match="--jaus-record: No space left on device"):
        run.step()
    closed: list[bool] = []
    run.world.close = lambda: closed.append(True)  # type: ignore[method-assign]
    with pytest.raises(LinkError, match="No space left on device"):
        run.close()
    assert closed == [True]
    loopback.open(CARS).close()  # the place is free again
