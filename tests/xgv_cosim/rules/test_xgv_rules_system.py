"""The XGV as a system: who may drive it in which way, through the whole simulation on scenario hello."""

from __future__ import annotations

from collections.abc import Callable
from typing import get_args

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.component import StatusCommand
from jaus.errors import LocalProtocolError
from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from tests.xgv_cosim.simulation.conftest import Opener
from xgv_cosim.commands import MotionProfile, WrenchEffort
from xgv_cosim.endpoint import CommandStatus, ReleaseControl, RequestControl, StackMessage
from xgv_cosim.injection import InjectionKind
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.observation import Observation
from xgv_cosim.simulation import Simulation
from xgv_cosim.simulation.addresses import stack_address
from xgv_cosim.vehicles.xgv.profile import XgvProfile

PD, MPD = ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER
RESUME_BOTH: list[StackMessage] = [CommandStatus(driver, StatusCommand.RESUME) for driver in (PD, MPD)]
CLOSED_LOOP: list[StackMessage] = [RequestControl(MPD), *RESUME_BOTH]
OPEN_LOOP: list[StackMessage] = [RequestControl(PD), CommandStatus(PD, StatusCommand.RESUME)]


class Script:
    """A stack that sends what a test tells it to, and keeps what it has seen."""

    def __init__(self) -> None:
        self.next: list[StackMessage] = []
        self.repeated: list[StackMessage] = []
        self.seen: list[Observation] = []

    def act(self, observation: Observation) -> list[StackMessage]:
        self.seen.append(observation)
        sent, self.next = [*self.next, *self.repeated], []
        return sent


Scripted = Callable[..., tuple[Simulation, Script]]


@pytest.fixture
def scripted(open_hello: Opener) -> Scripted:
    """Open hello with xgv_0 driven by a script, after five seconds under the traffic's driver."""

    def opened(*overrides: str) -> tuple[Simulation, Script]:
        simulation = open_hello("bind.0.stack=none", *overrides)
        simulation.step()
        script, vehicle = Script(), simulation.state.vehicle("xgv_0")
        simulation.state.vehicles.connect("xgv_0", InProcessLink(script, stack_address(vehicle.slot)))
        simulation.run_until(5.0)
        return simulation, script

    return opened


def modes_of(simulation: Simulation) -> tuple[ControlMode, ReadyMode]:
    fleet, slot = simulation.fleet, simulation.fleet.slot_of("xgv_0")
    return ControlMode(int(fleet.control_mode[slot])), ReadyMode(int(fleet.ready_mode[slot]))


def test_three_ways_to_operate_the_car_xgv_02(scripted: Scripted) -> None:
    """XGV-02: closed loop, open loop and manual, one after the other, by one client."""
    simulation, script = scripted()
    car = simulation.vehicle("xgv_0")
    script.next = [*CLOSED_LOOP]
    script.repeated = [MotionProfile(10.0, 2.0, 0.0, 0.1, 0.4)]
    simulation.run_until(6.0)
    assert modes_of(simulation) == (ControlMode.MOTION_PROFILES, ReadyMode.READY)
    assert car.mode == "drive_by_wire"
    script.next = [ReleaseControl(MPD), *OPEN_LOOP]
    script.repeated = [WrenchEffort(0.2, 0.0, 0.0)]
    simulation.run_until(7.0)
    assert modes_of(simulation) == (ControlMode.WRENCH_EFFORTS, ReadyMode.READY)
    assert car.mode == "drive_by_wire"
    car.override()
    simulation.run_until(8.0)
    assert car.mode == "manual_override"


def test_telemetry_keeps_flowing_while_a_human_drives_xgv_03(scripted: Scripted) -> None:
    simulation, script = scripted()
    simulation.vehicle("xgv_0").override()
    simulation.run_until(7.0)
    manual = [seen for seen in script.seen if seen.safety_mode == "manual_override"]
    assert len(manual) == 20  # two seconds, at every world step
    assert len({seen.x_m for seen in manual}) == len(manual)
    assert all(seen.speed_mps > 1.0 for seen in manual)


def test_open_loop_commands_move_pedals_and_wheel_directly_xgv_04_xgv_09(scripted: Scripted) -> None:
    simulation, script = scripted()
    slot = simulation.fleet.slot_of("xgv_0")
    script.next = [*OPEN_LOOP]
    script.repeated = [WrenchEffort(0.3, 0.0, 0.01)]
    simulation.run_until(6.5)
    motion = simulation.fleet.motion
    assert motion.throttle[slot] == pytest.approx(0.3, abs=0.02)
    assert motion.steer_rad[slot] > 0.0
    entry_mps = simulation.vehicle("xgv_0").speed_mps
    script.repeated = [WrenchEffort(0.0, 0.4, -0.01)]
    simulation.run_until(8.0)
    motion = simulation.fleet.motion
    assert motion.throttle[slot] == pytest.approx(0.0, abs=0.02)
    assert motion.brake[slot] == pytest.approx(0.4, abs=0.02)
    assert motion.steer_rad[slot] < 0.0
    assert simulation.vehicle("xgv_0").speed_mps < entry_mps - 2.0


def test_closed_loop_commands_are_reached_by_the_cars_own_controllers_xgv_05_xgv_06(
    scripted: Scripted,
) -> None:
    """XGV-05: speed within its acceleration; XGV-06: it is the car that finds throttle, brake and wheel."""
    simulation, script = scripted()
    car, slot = simulation.vehicle("xgv_0"), simulation.fleet.slot_of("xgv_0")
    script.next = [*CLOSED_LOOP]
    script.repeated = [MotionProfile(6.0, 2.0, 0.0, 0.1, 0.4)]
    simulation.run_until(6.5)
    assert car.accel_mps2 == pytest.approx(-2.0, abs=0.1)
    assert simulation.fleet.motion.brake[slot] > 0.02
    simulation.run_until(12.0)
    assert car.speed_mps == pytest.approx(6.0, abs=0.1)
    script.repeated = [MotionProfile(9.0, 0.8, 0.002, 0.1, 0.4)]
    simulation.run_until(14.0)
    assert car.accel_mps2 == pytest.approx(0.8, abs=0.1)
    assert simulation.fleet.motion.throttle[slot] > 0.02
    assert simulation.fleet.motion.steer_rad[slot] > 0.0
    simulation.run_until(17.0)
    assert car.speed_mps == pytest.approx(9.0, abs=0.1)


def test_each_driver_refuses_the_other_ones_command_xgv_09_xgv_16(scripted: Scripted) -> None:
    simulation, script = scripted()
    script.next = [*CLOSED_LOOP, MotionProfile(10.0, 2.0, 0.0, 0.1, 5.0)]
    simulation.run_until(6.0)
    script.next = [WrenchEffort(0.5, 0.0, 0.0)]
    simulation.run_until(6.5)
    refused = [event for event in simulation.state.journal.events if event.kind == "command_refused"]
    assert [event.after for event in refused] == ["WrenchEffort"]
    assert "Motion Profile Driver controls the Primitive Driver" in refused[0].reasons[0]
    assert simulation.vehicle("xgv_0").mode == "drive_by_wire"


@pytest.mark.parametrize("part", ["subsystem", "node", "component", "instance"])
def test_an_address_is_four_bytes_xgv_07(part: str) -> None:
    largest = dict.fromkeys(("subsystem", "node", "component", "instance"), 255)
    JausAddress(**largest)
    for wrong in (-1, 256):
        with pytest.raises(LocalProtocolError, match=part):
            JausAddress(**{**largest, part: wrong})


def test_six_components_on_the_controller_xgv_07_xgv_08() -> None:
    assert {component.name: int(component) for component in ComponentId} == {
        "NODE_MANAGER": 1,
        "PRIMITIVE_DRIVER": 33,
        "VELOCITY_STATE_SENSOR": 42,
        "MOTION_PROFILE_DRIVER": 10,
        "SIGNALS_DRIVER": 11,
        "ERROR_MANAGER": 12,
    }


def test_control_mode_follows_control_messages_alone_xgv_15(scripted: Scripted) -> None:
    """XGV-15: no command, status, device or door changes it; requests and releases do."""
    simulation, script = scripted()
    car = simulation.vehicle("xgv_0")
    script.next = [*CLOSED_LOOP]
    simulation.run_until(6.0)
    car.door()
    car.estop("stop")
    script.next = [
        MotionProfile(3.0, 1.0, 0.0, 0.1, 0.2),
        CommandStatus(MPD, StatusCommand.STANDBY),
        CommandStatus(PD, StatusCommand.SET_EMERGENCY),
    ]
    simulation.run_until(7.0)
    assert modes_of(simulation) == (ControlMode.MOTION_PROFILES, ReadyMode.SOFTWARE_PAUSE)
    script.next = [ReleaseControl(MPD)]
    simulation.run_until(7.5)
    assert modes_of(simulation)[0] is ControlMode.SOFTWARE_PAUSE


def test_more_devices_than_the_safestop_xgv_14(open_hello: Opener) -> None:
    """XGV-14: button, emergency override, override, door, health; each has its reason."""
    stops = {
        InjectionKind.ESTOP_BUTTON: ("estop_disable", "emergency stop button"),
        InjectionKind.EMO: ("emergency_manual_override", "emergency manual override"),
        InjectionKind.OVERRIDE: ("manual_override", "manual override"),
        InjectionKind.DOOR: ("software_pause", "door or liftgate open"),
        InjectionKind.ERROR: ("software_pause", "error 9161"),
    }
    for kind, (mode, reason) in stops.items():
        simulation = open_hello()
        simulation.run_until(3.0)
        car = simulation.vehicle("xgv_0")
        car.inject(kind, code=9161 if kind is InjectionKind.ERROR else None)
        simulation.run_until(3.2)
        assert car.mode == mode
        assert any(reason in said for said in car.reasons), (kind, car.reasons)
        simulation.close()


def test_emergency_override_gives_the_car_to_the_human_and_disable_beats_it_xgv_30_xgv_31(
    open_hello: Opener,
) -> None:
    simulation = open_hello()
    simulation.run_until(5.0)
    car = simulation.vehicle("xgv_0")
    car.inject("emo")
    simulation.run_until(7.0)
    assert car.mode == "emergency_manual_override"
    held = [(event.kind, event.after) for event in simulation.state.journal.events if event.t_s == 5.0]
    assert ("speed_control", "driver") in held
    assert ("steering_control", "driver") in held
    assert car.speed_mps > 5.0
    car.override()  # engaged as well: the higher mode stays
    simulation.run_until(7.5)
    assert car.mode == "emergency_manual_override"
    car.inject("estop_button")
    simulation.run_until(12.0)
    assert car.mode == "estop_disable"
    assert car.speed_mps == 0.0


def test_nothing_latches_but_what_a_device_latches_xgv_37(open_hello: Opener) -> None:
    """XGV-37, the source's text: each stop ends with its demand, and the car drives on by itself."""
    simulation = open_hello()
    simulation.step()
    car, now_s = simulation.vehicle("xgv_0"), 0.0
    for kind in ("estop_pause", "estop_disable", "estop_button", "door", "override"):
        now_s += 3.0
        simulation.run_until(now_s)
        assert car.mode == "drive_by_wire", kind
        car.inject(kind)
        simulation.run_until(now_s + 0.5)
        assert car.mode != "drive_by_wire", kind
        car.inject(kind, begins=False)
        simulation.run_until(now_s + 1.0)
        assert car.mode == "drive_by_wire", kind


def test_no_message_sets_the_partial_mode_xgv_40() -> None:
    """XGV-40: the display sets it; nothing that a stack may send speaks of it."""
    for message in get_args(StackMessage):
        assert not [
            field for field in message.__dataclass_fields__ if "partial" in field or "manual" in field
        ]


def test_each_code_of_a_mode_has_one_name_xgv_54() -> None:
    """XGV-54: the enumeration of the text is complete: 1 to 11, where 2 to 7 are one mode."""
    names = [XgvProfile().safety_mode_name(code) for code in range(1, 12)]
    assert names == [
        "drive_by_wire",
        *["software_pause"] * 6,
        "estop_pause",
        "manual_override",
        "emergency_manual_override",
        "estop_disable",
    ]
    assert {mode.name.lower() for mode in SafetyMode} == {*names, "inactive"}
