"""Gear selector, parking brake and engine of a car of scenario hello, as a client and a user see them."""

from __future__ import annotations

import pytest

from tests.xgv_cosim.simulation.conftest import Opener
from tests.xgv_cosim.simulation.test_client_timelines import (
    BRAKING,
    PD,
    ROLLING,
    TO_MOTION,
    TO_WRENCH,
    Client,
)
from xgv_cosim.actuation import Gear
from xgv_cosim.commands import DiscreteDevices, MotionProfile, WrenchEffort
from xgv_cosim.endpoint import ReleaseControl
from xgv_cosim.observation import DeviceReading
from xgv_cosim.simulation import Simulation

REVERSE = DiscreteDevices(gear=Gear.REVERSE)
FULL_AHEAD = WrenchEffort(throttle=0.6, brake=0.0, steering=0.0)
GENTLY = WrenchEffort(throttle=0.0, brake=0.3, steering=0.0)
SET, RELEASE = DiscreteDevices(parking_brake=True), DiscreteDevices(parking_brake=False)


@pytest.fixture
def client(open_hello: Opener) -> Client:
    return Client(open_hello("bind.0.stack=none"))


def _reasons(client: Client, kind: str) -> list[tuple[str, ...]]:
    events = client.simulation.state.journal.events
    return [event.reasons for event in events if event.kind == kind and event.vehicle == "xgv_0"]


def _told(client: Client, kind: str) -> list[tuple[str, str]]:
    return [(before, after) for _t_s, before, after in client.events(kind)]


def test_in_manual_speed_a_gear_command_is_refused_with_the_reason(client: Client) -> None:
    """XGV-41: the gear belongs to the human; nothing says that it was done."""
    client.say(*TO_WRENCH, BRAKING)
    client.car.set_partial_mode("manual_speed")
    client.say(BRAKING)
    client.say(BRAKING, REVERSE, SET)
    assert client.car.mode == "drive_by_wire"
    assert client.events("gear") == client.events("parking_brake") == []
    assert client.refusals() == [
        "gear: in manual speed the gear belongs to the human (XGV-41)",
        "parking brake: in manual speed the brakes belong to the human (XGV-41)",
    ]
    client.car.set_partial_mode("full")
    client.say(BRAKING)
    client.say(BRAKING, REVERSE)
    assert _told(client, "gear") == [("drive", "reverse")]


def test_a_car_that_was_bound_in_manual_speed_refuses_gears_as_well(open_hello: Opener) -> None:
    """XGV-41: also after its system has been powered up again (XGV-32)."""
    row = "{at_s: 1.0, vehicles: xgv_0, kind: inactive, duration_s: 0.5}"
    client = Client(open_hello("bind.0.stack=none", "bind.0.partial=manual_speed", f"injections=[{row}]"))
    for begin_s in (0.5, 2.0):
        client.simulation.run_until(begin_s)
        client.say(*TO_WRENCH, BRAKING)
        client.say(BRAKING, REVERSE)
        assert "the gear belongs to the human" in client.refusals()[-1]
    assert client.events("gear") == []


def test_a_shift_that_waits_says_so_withholds_the_throttle_and_comes(client: Client) -> None:
    """XGV-04, XGV-70: once, with wanted and engaged gear and speed; then when it is done."""
    client.say(*TO_WRENCH, ROLLING)
    client.repeat(3.0, FULL_AHEAD)
    motion = client.simulation.fleet.motion
    assert motion.throttle[client.slot] > 0.5
    asked_s = client.simulation.now_s
    speed_mps = client.car.speed_mps
    client.repeat(5.0, FULL_AHEAD, REVERSE)  # clients repeat: one event all the same
    assert client.events("gear_shift_waiting") == [(asked_s, "drive", "reverse")]
    assert _reasons(client, "gear_shift_waiting") == [
        (
            f"the car moves at {speed_mps:.2f} m/s",
            "the brake is not pressed",
            "throttle is withheld until then",
        )
    ]
    assert client.simulation.fleet.motion.throttle[client.slot] < 0.01
    assert client.car.accel_mps2 < 0.0  # the client's throttle drives it no further in the old gear
    assert client.car.devices == DeviceReading(Gear.DRIVE, Gear.REVERSE, engine_on=True, parking_brake=False)
    client.repeat(25.0, GENTLY, REVERSE)
    ((engaged_s, before, after),) = client.events("gear_engaged")
    assert (before, after) == ("drive", "reverse")
    ((waited,),) = _reasons(client, "gear_engaged")
    assert waited == f"waited {engaged_s - asked_s:.2f} s"
    client.repeat(28.0, ROLLING)  # and with the gear the throttle is back
    assert client.car.speed_mps < -1.0
    assert len(client.events("gear_shift_waiting")) == 1


def test_a_shift_within_forward_gears_keeps_its_throttle(client: Client) -> None:
    """XGV-70: only a change of direction withholds it; low waits all the same."""
    client.say(*TO_WRENCH, ROLLING)
    client.repeat(3.0, FULL_AHEAD)
    client.repeat(4.0, FULL_AHEAD, DiscreteDevices(gear=Gear.LOW))
    assert client.simulation.fleet.motion.throttle[client.slot] == pytest.approx(0.6, abs=0.01)
    assert _told(client, "gear_shift_waiting") == [("drive", "low")]
    assert not any("withheld" in why for why in _reasons(client, "gear_shift_waiting")[0])
    client.say(FULL_AHEAD, DiscreteDevices(gear=Gear.DRIVE))  # commanded back: nothing waits any more
    client.say(FULL_AHEAD, DiscreteDevices(gear=Gear.LOW))
    assert len(client.events("gear_shift_waiting")) == 2


def test_a_shift_at_a_braked_standstill_waits_for_nothing(client: Client) -> None:
    client.say(*TO_WRENCH, BRAKING)
    client.repeat(15.0, BRAKING)
    client.repeat(18.0, BRAKING, REVERSE)
    assert client.events("gear_shift_waiting") == []
    assert _told(client, "gear_engaged") == [("drive", "reverse")]
    assert _reasons(client, "gear_engaged") == [()]


def _pause(client: Client) -> None:
    client.car.estop("pause")


def _override(client: Client) -> None:
    client.car.override()


def _manual_speed(client: Client) -> None:
    client.car.set_partial_mode("manual_speed")


def _disable(client: Client) -> None:
    client.car.estop("stop")


@pytest.mark.parametrize(
    ("take_over", "why"),
    [
        (_pause, "estop pause: a gear shift is motion-related"),
        (_override, "manual override: the computer does not shift"),
        (_manual_speed, "drive by wire: the computer does not shift"),
        (_disable, "estop disable: the computer does not shift"),
    ],
)
def test_whatever_takes_the_shifting_from_the_computer_drops_a_pending_shift(
    client: Client, take_over: object, why: str
) -> None:
    """XGV-31, XGV-34, XGV-41: with an event; afterwards it has to be commanded anew."""
    client.say(*TO_WRENCH, ROLLING)
    client.repeat(3.0, FULL_AHEAD)
    client.repeat(3.5, FULL_AHEAD, REVERSE)
    take_over(client)  # type: ignore[operator]
    client.say(FULL_AHEAD)
    assert client.events("gear_shift_dropped") == [(3.5, "reverse", "drive")]
    assert _reasons(client, "gear_shift_dropped") == [(why,)]
    assert client.car.devices.gear_wanted is Gear.DRIVE
    client.car.estop("run")
    client.car.override(engaged=False)
    client.car.set_partial_mode("full")
    client.repeat(20.0, BRAKING)
    assert client.car.mode == "drive_by_wire"
    assert client.events("gear_engaged") == []
    client.repeat(23.0, BRAKING, REVERSE)
    assert _told(client, "gear_engaged") == [("drive", "reverse")]


def test_closed_loop_drops_a_pending_shift_because_it_chooses_the_gear(client: Client) -> None:
    """XGV-06, XGV-16."""
    client.say(*TO_WRENCH, ROLLING)
    client.repeat(3.0, FULL_AHEAD)
    client.say(FULL_AHEAD, REVERSE)
    motion = MotionProfile(8.0, 2.0, 0.0, 0.1, 1.0)
    client.say(ReleaseControl(PD), *TO_MOTION, motion)
    client.repeat(10.0, motion)
    assert _told(client, "gear_shift_dropped") == [("reverse", "drive")]
    assert client.car.mode == "drive_by_wire"
    assert client.car.speed_mps == pytest.approx(8.0, abs=1.0)


def _standing_on_a_grade(open_hello: Opener, driver: str) -> Client:
    """Return a client whose car stands, braked, on a grade of 8 %, in neutral."""
    client = Client(open_hello("bind.0.stack=none", f"bind.0.driver={driver}", "bind.0.plant.grade=0.08"))
    client.say(*TO_WRENCH, BRAKING)
    client.repeat(10.0, BRAKING)
    client.repeat(12.0, BRAKING, DiscreteDevices(gear=Gear.NEUTRAL))
    assert client.car.devices.gear is Gear.NEUTRAL
    assert client.car.speed_mps == 0.0
    return client


@pytest.mark.parametrize("is_set", [True, False])
def test_on_a_grade_with_nobody_aboard_the_parking_brake_decides_whether_the_car_rolls(
    open_hello: Opener, is_set: bool
) -> None:
    """XGV-09, XGV-34, XGV-64: set by command in a pause, it holds when an override releases all else."""
    client = _standing_on_a_grade(open_hello, "none")
    client.car.estop("pause")
    client.say(BRAKING)
    client.say(BRAKING, DiscreteDevices(parking_brake=is_set))
    assert client.car.devices.parking_brake is is_set
    client.car.override()
    before = client.car.pose
    client.repeat(17.0, BRAKING)
    assert client.car.mode == "manual_override"
    after = client.car.pose
    moved_m = ((after.x_m - before.x_m) ** 2 + (after.y_m - before.y_m) ** 2) ** 0.5
    if is_set:
        assert moved_m == 0.0
        assert _told(client, "parking_brake") == [("off", "on")]
    else:
        assert moved_m > 1.0
        assert client.car.speed_mps < -1.0
        assert "parking brake: releasing it is motion-related" in client.refusals()[-1]


def test_the_parking_brake_brakes_a_moving_car_gently_and_a_pause_does_not_release_it(client: Client) -> None:
    """XGV-09, XGV-34."""
    client.say(*TO_WRENCH, ROLLING)
    client.repeat(4.0, FULL_AHEAD)
    idle = WrenchEffort(throttle=0.0, brake=0.0, steering=0.0)
    client.repeat(5.0, idle, SET)
    assert -2.6 < client.car.accel_mps2 < -2.0
    client.car.estop("pause")
    client.say(idle)
    client.say(idle, RELEASE)
    assert "parking brake: releasing it is motion-related and refused in estop pause" in client.refusals()[-1]
    client.repeat(15.0, idle)
    client.car.estop("run")
    client.repeat(16.0, idle)
    assert client.car.mode == "drive_by_wire"
    assert client.car.speed_mps == 0.0  # creep does not move it
    client.repeat(18.0, idle, RELEASE)
    assert client.car.speed_mps > 0.2
    assert _told(client, "parking_brake") == [("off", "on"), ("on", "off")]


def test_a_driver_who_takes_the_speed_releases_the_parking_brake(open_hello: Opener) -> None:
    """XGV-13, XGV-64: the car responds as stock, so he can drive on."""
    client = _standing_on_a_grade(open_hello, "rider")
    client.say(BRAKING, SET)
    client.car.override()
    client.say(BRAKING)
    assert _told(client, "parking_brake") == [("off", "on"), ("on", "off")]
    assert _reasons(client, "parking_brake")[-1] == ("released by the driver",)
    client.repeat(16.0)
    assert client.car.speed_mps > 1.0


def _engine(simulation: Simulation) -> list[tuple[float, str, str, tuple[str, ...]]]:
    events = simulation.state.journal.events
    return [(e.t_s, e.kind, e.after, e.reasons) for e in events if e.kind in {"engine", "without_drive"}]


DISABLED = "injections=[{at_s: 4.0, vehicles: xgv_0, kind: estop_disable, duration_s: 6.0}]"


@pytest.mark.parametrize("rearm", ["literal", "conservative"])
def test_after_a_disable_the_reference_stack_starts_the_engine_and_drives_on(
    open_hello: Opener, rearm: str
) -> None:
    """XGV-16, XGV-31, XGV-34, XGV-37: ``xgv.disable.engine_off``, released, in either preset."""
    simulation = open_hello("xgv.disable.engine_off=true", f"xgv.rearm.preset={rearm}", DISABLED)
    simulation.run_until(3.9)
    before_mps = simulation.vehicle("xgv_0").speed_mps
    simulation.run_until(9.9)
    car = simulation.vehicle("xgv_0")
    assert car.speed_mps == 0.0
    assert not car.devices.engine_on
    assert _engine(simulation) == [(4.0, "engine", "off", ("estop disable (xgv.disable.engine_off)",))]
    simulation.run_until(12.0)
    if rearm == "conservative":
        car.rearm()
    simulation.run_until(22.0)
    assert car.devices.engine_on
    assert car.mode == "drive_by_wire"
    assert car.speed_mps == pytest.approx(before_mps, abs=2.0)
    stopped, *standing, started = [row for row in _engine(simulation) if row[0] <= 10.2 and row[2]]
    assert stopped[1:3] == ("engine", "off")
    assert started[1:3] == ("engine", "on")
    assert started[0] == pytest.approx(10.1)  # one step after the release: what the stack saw then
    if rearm == "literal":  # the computer had the speed for that step, and said so
        ((begun_s, kind, what, _why),) = standing
        assert (begun_s, kind, what) == (10.0, "without_drive", "engine off")
    else:
        assert standing == []


def test_a_car_that_nobody_starts_says_why_it_stands(open_hello: Opener) -> None:
    """XGV-31, XGV-34: until a controller starts its engine; a stranger may not outside a pause."""
    client = Client(open_hello("bind.0.stack=none", "xgv.disable.engine_off=true", DISABLED))
    forward = MotionProfile(8.0, 2.0, 0.0, 0.1, 0.5)
    client.say(*TO_MOTION, forward)
    client.repeat(14.0, forward)
    assert client.car.mode == "drive_by_wire"
    assert client.car.speed_mps == 0.0
    assert client.events("without_drive") == [(10.0, "", "engine off")]
    assert "nothing drives the car" in _reasons(client, "without_drive")[0][0]
    client.say(forward, DiscreteDevices(engine_on=True))
    client.repeat(22.0, forward)
    assert client.events("without_drive")[1:] == [(14.0, "engine off", "")]
    assert _reasons(client, "without_drive")[1] == ("lasted 4.00 s",)
    assert client.car.speed_mps == pytest.approx(8.0, abs=0.2)
