"""Timelines of a client in Python that drives a car of scenario hello, with no stack of its own."""

from __future__ import annotations

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.component import StatusCommand
from tests.xgv_cosim.simulation.conftest import Opener
from xgv_cosim.actuation import Gear, LostFunction
from xgv_cosim.commands import DiscreteDevices, MotionProfile, MotionQueue, Signals, Turn, WrenchEffort
from xgv_cosim.endpoint import CommandStatus, RequestControl, StackMessage
from xgv_cosim.simulation import Simulation, VehicleHandle
from xgv_cosim.vehicles.base import VehicleModeReport

PD = ComponentId.PRIMITIVE_DRIVER
MPD = ComponentId.MOTION_PROFILE_DRIVER
ROLLING = WrenchEffort(throttle=0.2, brake=0.0, steering=0.0)
BRAKING = WrenchEffort(throttle=0.0, brake=0.4, steering=0.0)
TO_WRENCH = (RequestControl(PD), CommandStatus(PD, StatusCommand.RESUME))
TO_MOTION = (
    RequestControl(MPD),
    CommandStatus(PD, StatusCommand.RESUME),
    CommandStatus(MPD, StatusCommand.RESUME),
)


class Client:
    """Sends to one car step by step, as a person at a console does."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        simulation.step()
        self.car: VehicleHandle = simulation.vehicle("xgv_0")
        self.slot = simulation.fleet.slot_of("xgv_0")

    def say(self, *messages: StackMessage) -> None:
        for message in messages:
            self.car.send(message)
        self.simulation.step()

    def repeat(self, until_s: float, *messages: StackMessage) -> None:
        while self.simulation.now_s < until_s - 1e-9:
            self.say(*messages)

    def events(self, kind: str) -> list[tuple[float, str, str]]:
        return [
            (e.t_s, e.before, e.after)
            for e in self.simulation.state.journal.events
            if e.kind == kind and e.vehicle == "xgv_0"
        ]

    def refusals(self) -> list[str]:
        return [e.reasons[0] for e in self.simulation.state.journal.events if e.kind == "command_refused"]


@pytest.fixture
def client(open_hello: Opener) -> Client:
    return Client(open_hello("bind.0.stack=none"))


def test_a_client_drives_open_loop_shifts_and_stops_the_engine_in_a_pause(client: Client) -> None:
    """XGV-04, XGV-09, XGV-16, XGV-22, XGV-34: throttle, brake, gear and engine, each where it may."""
    client.say(*TO_WRENCH, ROLLING)
    client.repeat(3.0, ROLLING)
    car, fleet = client.car, client.simulation.fleet
    assert car.mode == "drive_by_wire"
    assert fleet.motion.throttle[client.slot] == pytest.approx(0.2, abs=0.02)
    client.repeat(15.0, BRAKING)
    assert car.speed_mps == 0.0
    assert fleet.motion.brake[client.slot] == pytest.approx(0.4, abs=0.02)

    client.say(BRAKING, DiscreteDevices(gear=Gear.REVERSE))
    client.say(BRAKING, DiscreteDevices(gear=Gear.REVERSE))  # clients repeat; that is no event
    assert fleet.gear_wanted[client.slot] == Gear.REVERSE
    assert [(before, after) for _t, before, after in client.events("gear")] == [("drive", "reverse")]

    car.estop("pause")
    client.say(BRAKING)
    client.say(BRAKING, DiscreteDevices(gear=Gear.REVERSE, engine_on=False))
    assert car.mode == "estop_pause"
    assert fleet.gear_wanted[client.slot] == Gear.DRIVE  # the pause has dropped the shift that was under way
    assert not fleet.engine_on[client.slot]
    assert client.refusals()[-1].startswith("gear: a gear shift is motion-related")
    client.say(BRAKING, DiscreteDevices(engine_on=True))
    assert fleet.engine_on[client.slot]
    assert [(before, after) for _t, before, after in client.events("engine")] == [
        ("on", "off"),
        ("off", "on"),
    ]


def test_wrench_efforts_that_stop_time_out_and_their_silent_client_loses_control(client: Client) -> None:
    """XGV-43, XGV-65: 9158 half a second after the last effort, no control five seconds after it."""
    client.say(*TO_WRENCH, ROLLING)  # at 0.1 s
    client.simulation.run_until(6.0)
    assert [(t_s, after) for t_s, _before, after in client.events("error")] == [(0.6, "9158")]
    assert client.events("control_mode")[-1] == (5.1, "wrench_efforts", "software_pause")
    assert "was silent for 5 s" in client.car.reasons[-1]
    assert client.events("component_control")[-1][2] == "Primitive Driver: nobody"
    client.say(*TO_WRENCH, ROLLING)
    client.say(ROLLING)
    assert client.car.mode == "drive_by_wire"


def test_motions_run_in_order_and_the_pause_drops_those_that_wait(open_hello: Opener) -> None:
    """XGV-43, XGV-58, XGV-70: each motion ends on its own tick, and a pause drops the queue."""
    client = Client(open_hello("bind.0.stack=none", "xgv.motion.allow_many=true"))
    speeds = (8.0, 6.0, 4.0)
    queue = MotionQueue(tuple(MotionProfile(speed, 2.0, 0.0, 0.1, 1.03) for speed in speeds))
    client.say(*TO_MOTION, queue)  # at 0.1 s
    commanded = client.simulation.fleet.command.speed_mps
    seen = []
    for until_s in (1.1, 1.2, 2.1, 2.2):
        client.simulation.run_until(until_s)
        seen.append(commanded[client.slot])
    assert seen == [8.0, 6.0, 6.0, 4.0]  # the second begins at 1.13 s, the third at 2.16 s
    client.simulation.run_until(4.0)
    assert [(t_s, after) for t_s, _before, after in client.events("error")] == [
        (pytest.approx(3.19), "9157")  # 0.1 s and three times 1.03 s
    ]

    client.say(queue)
    client.car.estop("pause")
    client.simulation.run_until(4.5)
    assert client.events("motion_queue") == [(4.1, "2 waiting", "0 waiting")]
    client.simulation.run_until(6.0)
    assert client.events("error")[-1] == (pytest.approx(5.03), "", "9157")


def test_several_motions_are_refused_without_the_key(client: Client) -> None:
    """XGV-70: the event log says why."""
    motion = MotionProfile(5.0, 1.0, 0.0, 0.1, 1.0)
    client.say(*TO_MOTION, MotionQueue((motion, motion)))
    assert "xgv.motion.allow_many" in client.refusals()[0]


def test_rate_0_and_acceleration_0_hold_curvature_and_speed(client: Client) -> None:
    """XGV-70: public speed-only clients send a rate of 0."""
    client.say(*TO_MOTION, MotionProfile(9.0, 1.5, 0.0, 0.1, 1.0))
    client.repeat(4.0, MotionProfile(9.0, 1.5, 0.0, 0.1, 1.0))
    reference = client.simulation.fleet.reference
    before = (reference.speed_mps[client.slot], reference.curvature_per_m[client.slot])
    client.repeat(6.0, MotionProfile(2.0, 0.0, 0.05, 0.0, 1.0))
    after = client.simulation.fleet.reference
    assert after.speed_mps[client.slot] == pytest.approx(before[0], abs=1e-6)
    assert after.curvature_per_m[client.slot] == pytest.approx(before[1], abs=1e-6)
    assert client.car.speed_mps == pytest.approx(before[0], abs=0.1)


def test_signals_from_anyone_until_a_disable(client: Client) -> None:
    """XGV-10, XGV-31: no control is needed; in a disable they are manual."""
    client.say(Signals(turn=Turn.HAZARD))
    client.car.estop("stop")
    client.say()
    client.say(Signals(turn=Turn.LEFT))
    assert [(before, after) for _t, before, after in client.events("signals")] == [
        ("off", "turn hazard"),
        ("turn hazard", "off"),
    ]
    assert "in estop disable" in client.refusals()[-1]


def test_a_hardware_error_takes_its_function_away_until_the_operator_clears_it(open_hello: Opener) -> None:
    """XGV-38: the column that controllers and plant read, the latch, and the operator's verb."""
    row = "{at_s: 1.0, vehicles: xgv_0, kind: error, code: 9110, duration_s: 1.0}"
    client = Client(open_hello(f"injections=[{row}]"))
    fleet = client.simulation.fleet
    client.simulation.run_until(1.5)
    assert fleet.lost_functions[client.slot] == LostFunction.BRAKE
    client.car.clear_errors()  # in vain: its cause lasts
    client.simulation.run_until(3.0)
    assert fleet.lost_functions[client.slot] == LostFunction.BRAKE
    assert client.car.mode == "software_pause"
    client.car.clear_errors()
    client.simulation.step()
    assert fleet.lost_functions[client.slot] == 0
    client.simulation.run_until(4.0)
    assert client.car.mode == "drive_by_wire"
    assert client.events("error") == [(1.0, "", "9110"), (3.0, "9110", "")]
    assert [t_s for t_s, _before, _after in client.events("error_latched")] == [1.5, 2.0]


def test_the_vehicle_mode_report_follows_the_modes(client: Client) -> None:
    """XGV-45, XGV-47 to XGV-52: software pause first, then motion profiles and a door."""
    assert client.car.vehicle_mode_report() == VehicleModeReport(0, 1, 1, 2, 0, 0x10)
    client.say(*TO_MOTION, MotionProfile(9.0, 1.5, 0.0, 0.1, 5.0))
    assert client.car.vehicle_mode_report() == VehicleModeReport(0, 3, 2, 1, 0, 0x10)
    client.car.door()
    client.say()
    assert client.car.vehicle_mode_report() == VehicleModeReport(0, 3, 2, 2, 0, 0x50)


@pytest.mark.parametrize("firmware", ["1.0", "1.1"])
def test_old_firmware_has_no_vehicle_mode_report(open_hello: Opener, firmware: str) -> None:
    """XGV-53."""
    client = Client(open_hello(f"xgv.firmware={firmware}"))
    assert client.car.vehicle_mode_report() is None


def test_preemption_of_a_moving_car_is_a_software_pause_at_speed(open_hello: Opener) -> None:
    """XGV-66: the reference stack asks with 6; a console with 7 takes the car from it."""
    client = Client(open_hello())
    client.simulation.run_until(5.0)
    speed_mps = client.car.speed_mps
    client.say(RequestControl(MPD, authority=7))
    assert client.car.mode == "software_pause"
    assert client.car.speed_mps == pytest.approx(speed_mps - 0.25, abs=0.2)
    assert client.events("error") == []  # nothing has timed out: the pause is the pre-emption's alone
    assert "was preempted" in client.car.reasons[0]
    assert "Motion Profile Driver" in client.refusals()[-1]  # the stack's own commands are refused now
    client.say(MotionProfile(5.0, 1.0, 0.0, 0.1, 1.0))
    assert client.car.mode == "drive_by_wire"


def test_a_console_of_another_address_is_another_client(client: Client) -> None:
    """XGV-65: a controller is its address; a stranger neither commands nor releases."""
    client.say(*TO_WRENCH, ROLLING)
    client.car.send(ROLLING, sender=JausAddress(7, 7, 7, 1))
    client.simulation.step()
    assert "not 7.7.7.1" in client.refusals()[-1]
