"""Drive-by-wire without a live command, and driving against the parking brake: both are told."""

from __future__ import annotations

import pytest

from tests.xgv_cosim.simulation.conftest import Opener
from tests.xgv_cosim.simulation.test_client_timelines import TO_MOTION, TO_WRENCH, Client
from xgv_cosim.commands import DiscreteDevices, MotionProfile, WrenchEffort

AHEAD = WrenchEffort(throttle=0.4, brake=0.0, steering=0.0)
FORWARD = MotionProfile(5.0, 2.0, 0.0, 0.1, 0.4)
SET, RELEASE = DiscreteDevices(parking_brake=True), DiscreteDevices(parking_brake=False)


@pytest.fixture
def client(open_hello: Opener) -> Client:
    return Client(open_hello("bind.0.stack=none"))


@pytest.mark.parametrize(("setup", "command"), [(TO_WRENCH, AHEAD), (TO_MOTION, FORWARD)])
def test_after_a_brief_override_no_old_command_acts_xgv_43_xgv_70(
    client: Client, setup: tuple[object, ...], command: WrenchEffort | MotionProfile
) -> None:
    """XGV-13, XGV-70: motion and effort alike are dropped, and the car stops and holds until a fresh one."""
    client.say(*setup, command)  # type: ignore[arg-type]
    client.repeat(2.0, command)
    client.car.override()
    client.say()
    client.car.override(engaged=False)
    client.say()
    assert client.events("command_dropped") == [(2.0, "", "")]
    assert client.car.mode == "drive_by_wire"
    assert client.car.reasons[0].endswith("ready, but without a live command")
    speed_mps = client.car.speed_mps
    client.repeat(3.0)
    assert client.car.speed_mps < speed_mps - 1.0
    assert client.events("error") == []
    client.say(command)
    assert client.events("no_command") == [(2.1, "", "stop and hold"), (3.0, "stop and hold", "")]


def test_before_the_first_command_the_car_stops_and_holds_and_says_so_xgv_70(client: Client) -> None:
    """After a change of control mode nothing is in force; before the hand-over nobody needs a command."""
    client.say(*TO_MOTION)
    client.say()
    assert client.car.mode == "drive_by_wire"
    assert client.events("no_command") == []  # the world's driver has both axes
    client.say(FORWARD)
    client.car.inject("estop_button")
    client.say()
    client.car.inject("estop_button", begins=False)
    client.say()
    client.repeat(1.0)
    begin = client.events("no_command")
    assert [row[1:] for row in begin] == [("", "stop and hold")]
    client.repeat(1.2, FORWARD)
    assert [row[1:] for row in client.events("no_command")][1:] == [("stop and hold", "")]


def test_to_drive_against_the_parking_brake_is_warned_of_xgv_38(client: Client) -> None:
    """Warning 9175 pauses nothing; it goes when the brake is released, and is none while the car stands."""
    still = MotionProfile(0.0, 4.0, 0.0, 0.1, 0.4)
    client.say(*TO_MOTION, still)
    client.repeat(5.0, still)
    assert client.car.speed_mps == 0.0
    client.say(still, SET)
    client.say(still)
    warned = [row for row in client.events("warning") if "9175" in row[1:]]
    assert warned == []
    client.repeat(6.0, FORWARD)
    assert client.car.mode == "drive_by_wire"
    client.say(FORWARD, RELEASE)
    warned = [row for row in client.events("warning") if "9175" in row[1:]]
    assert warned == [(pytest.approx(5.2), "", "9175"), (pytest.approx(6.0), "9175", "")]


def test_a_throttle_against_the_parking_brake_is_warned_of_and_a_pause_ends_it_xgv_38(client: Client) -> None:
    client.say(*TO_WRENCH, AHEAD)
    client.repeat(1.0, WrenchEffort(throttle=0.0, brake=0.3, steering=0.0), SET)
    client.repeat(1.5, AHEAD)
    client.car.estop("pause")
    client.say(AHEAD)
    warned = [row for row in client.events("warning") if "9175" in row[1:]]
    assert warned == [(pytest.approx(1.0), "", "9175"), (pytest.approx(1.5), "9175", "")]
