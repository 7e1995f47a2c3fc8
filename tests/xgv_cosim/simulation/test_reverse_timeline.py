"""A client reverses a car of scenario hello, in SUMO: gears, path, pause and what the world reports."""

from __future__ import annotations

import pytest

from tests.xgv_cosim.simulation.conftest import Opener
from tests.xgv_cosim.simulation.test_client_timelines import TO_MOTION, Client
from xgv_cosim.actuation import Gear
from xgv_cosim.commands import MotionProfile

FORWARD = MotionProfile(4.0, 2.0, 0.0, 0.1, 0.5)
BACKWARD = MotionProfile(-3.0, 2.0, 0.0, 0.1, 0.5)


@pytest.fixture
def client(open_hello: Opener) -> Client:
    return Client(open_hello("bind.0.stack=none"))


def test_a_commanded_reverse_goes_through_standstill_and_a_pause_keeps_the_gear(client: Client) -> None:
    """XGV-36, XGV-70: and the world is told of the car where it is, and of a speed below 0."""
    client.say(*TO_MOTION, FORWARD)
    client.repeat(3.0, FORWARD)
    client.repeat(20.0, BACKWARD)
    fleet, slot, simulation = client.simulation.fleet, client.slot, client.simulation
    assert client.car.mode == "drive_by_wire"
    assert client.events("gear_engaged")[0][1:] == ("drive", "reverse")
    assert client.car.speed_mps == pytest.approx(-3.0, abs=0.1)
    assert simulation.snapshot.speed_mps[simulation.snapshot.index_of["xgv_0"]] <= 0.0
    before = client.car.pose
    client.repeat(21.0, BACKWARD)
    after = client.car.pose
    moved = ((after[0] - before[0]) ** 2 + (after[1] - before[1]) ** 2) ** 0.5
    assert moved == pytest.approx(3.0, abs=0.1)

    client.car.estop("pause")
    client.repeat(24.0, BACKWARD)
    assert client.car.speed_mps == 0.0
    assert fleet.motion.gear[slot] == Gear.REVERSE
    assert fleet.motion.brake[slot] == pytest.approx(0.5, abs=0.01)
    client.car.estop("run")
    client.repeat(27.0, BACKWARD)
    assert client.car.speed_mps == pytest.approx(-3.0, abs=0.2)
    client.repeat(33.0, FORWARD)
    assert [event[1:] for event in client.events("gear_engaged")] == [
        ("drive", "reverse"),
        ("reverse", "drive"),
    ]
    assert client.car.speed_mps == pytest.approx(4.0, abs=0.2)
