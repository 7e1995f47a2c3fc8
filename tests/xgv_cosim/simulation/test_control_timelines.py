"""Who controls the car, and which axis is whose, on real traffic: each pause for its own reason alone."""

from __future__ import annotations

import pytest

from jaus.address import JausAddress
from jaus.component import StatusCommand
from tests.xgv_cosim.simulation.conftest import Opener
from tests.xgv_cosim.simulation.test_client_timelines import MPD, PD, TO_MOTION, Client
from tests.xgv_cosim.simulation.test_safety_timelines import changes, modes_after, rows
from xgv_cosim.commands import MotionProfile, MotionQueue
from xgv_cosim.endpoint import CommandStatus, ReleaseControl, RequestControl, StackMessage

STRANGER = JausAddress(77, 9, 3, 1)
LONG = MotionProfile(9.0, 1.5, 0.0, 0.1, 20.0)


def by_stranger(client: Client, *messages: StackMessage) -> None:
    for message in messages:
        client.car.send(message, sender=STRANGER)
    client.simulation.step()


def driven(open_hello: Opener, *overrides: str) -> Client:
    """A car that the client's console drives by motion profiles since 0.1 s."""
    client = Client(open_hello("bind.0.stack=none", "xgv.motion.allow_many=true", *overrides))
    client.say(*TO_MOTION, LONG)
    client.repeat(4.0, LONG)
    assert client.car.mode == "drive_by_wire"
    return client


@pytest.mark.parametrize("queue", [LONG, MotionQueue((LONG, LONG, LONG))], ids=["one motion", "queue"])
def test_a_preempted_cars_motions_end_without_a_timeout_xgv_43_xgv_66(
    open_hello: Opener, queue: MotionProfile | MotionQueue
) -> None:
    """``rearm.error`` has no say in it, nor has the operator: the new controller's first command ends it."""
    client = driven(open_hello, "xgv.rearm.error=operator", "xgv.rearm.preemption=auto")
    client.say(queue)
    by_stranger(client, RequestControl(MPD, authority=7))
    assert (client.car.mode, client.car.speed_mps > 5.0) == ("software_pause", True)
    assert client.car.reasons[0].endswith(", 254.254.1.1 was preempted")
    client.simulation.run_until(6.0)
    assert client.car.speed_mps < 5.0
    by_stranger(client, LONG)
    client.simulation.run_until(7.0)
    assert client.car.mode == "drive_by_wire"
    assert modes_after(client.simulation, 4.0) == [(4.1, "software_pause"), (6.0, "drive_by_wire")]
    assert rows(client.simulation, "error") == []


def test_a_preemption_asks_for_what_its_own_key_says_xgv_37_xgv_66(open_hello: Opener) -> None:
    """``rearm.preemption = operator``: neither command nor Resume ends it before the operator's word."""
    client = driven(open_hello, "xgv.rearm.error=auto", "xgv.rearm.preemption=operator")
    resume = TO_MOTION[1:]
    by_stranger(client, RequestControl(MPD, authority=7), LONG, *resume)
    client.simulation.run_until(5.0)
    assert client.car.mode == "software_pause"
    client.car.rearm()
    client.simulation.run_until(5.5)
    assert client.car.mode == "software_pause"
    by_stranger(client, *resume)
    assert client.car.mode == "drive_by_wire"
    assert rows(client.simulation, "error") == []


def test_release_of_control_pauses_without_a_timeout_xgv_18_xgv_43(open_hello: Opener) -> None:
    client = driven(open_hello)
    client.say(ReleaseControl(MPD))
    client.simulation.run_until(30.0)
    assert modes_after(client.simulation, 3.0) == [(4.0, "software_pause")]
    assert client.car.reasons[-1].startswith("control mode software pause: nobody controls")
    assert rows(client.simulation, "error") == []


def test_a_silent_controller_loses_control_without_a_timeout_while_his_motion_lasts_xgv_43_xgv_65(
    open_hello: Opener,
) -> None:
    """His last motion of 20 s arrived at 3.9 s: the silence of 5 s is the reason, not the motion's end."""
    client = driven(open_hello)
    client.simulation.run_until(30.0)
    assert modes_after(client.simulation, 3.0) == [(8.9, "software_pause")]
    assert "was silent for 5 s" in client.car.reasons[-1]
    assert rows(client.simulation, "error") == []


@pytest.mark.parametrize(
    "command",
    [StatusCommand.STANDBY, StatusCommand.SHUTDOWN, StatusCommand.RESET, StatusCommand.SET_EMERGENCY],
)
def test_a_status_steers_on_by_the_command_and_times_out_only_when_the_stream_ends_xgv_33_xgv_43(
    open_hello: Opener, command: StatusCommand
) -> None:
    """The pause needs steering commands; who stops sending them is told so, in this pause as in any."""
    client = driven(open_hello)
    short = MotionProfile(9.0, 1.5, 0.004, 0.1, 0.4)
    client.say(CommandStatus(MPD, command), short)
    client.repeat(5.0, short)
    assert client.car.mode == "software_pause"
    reference = client.simulation.fleet.reference
    assert reference.curvature_per_m[client.slot] == pytest.approx(0.004, rel=1e-3)
    assert rows(client.simulation, "error") == []
    client.simulation.run_until(7.0)
    assert changes(client.simulation, "error") == [(5.3, "9157")]


def test_a_strangers_emergency_is_cleared_by_who_drives_through_the_mpd_xgv_63(open_hello: Opener) -> None:
    """He need not let go of the car for it; the stranger cannot clear what he has set."""
    client = driven(open_hello)
    clear = CommandStatus(PD, StatusCommand.CLEAR_EMERGENCY)
    by_stranger(client, CommandStatus(PD, StatusCommand.SET_EMERGENCY))
    by_stranger(client, clear)
    assert client.car.mode == "software_pause"
    assert client.refusals()[-1].startswith("77.9.3.1 may not send clear emergency")
    client.say(clear)
    client.say(*TO_MOTION[1:], LONG)
    assert client.car.mode == "drive_by_wire"
    assert [row[2] for row in client.events("component_status")[-3:]] == [
        "Primitive Driver: emergency",
        "Primitive Driver: standby",
        "Primitive Driver: ready",
    ]


def test_the_wheel_takes_its_own_reaction_though_the_pedals_are_the_riders_xgv_64_xgv_69(
    open_hello: Opener,
) -> None:
    """Manual speed is the rider's own doing, uninitialised steering is not: the axes count apart."""
    simulation = open_hello(
        "bind.0.partial=manual_speed",
        "bind.0.driver_reaction_s=0.83",
        "injections=[{at_s: 5.03, vehicles: xgv_0, kind: steering_uninitialised}]",
    )
    simulation.run_until(5.5)
    assert changes(simulation, "steering_control")[-1] == (5.03, "nobody")
    simulation.run_until(7.0)
    assert changes(simulation, "steering_control")[-1] == (5.86, "driver")
    # He has had the pedals since the hand-over, and nothing of this has touched them.
    assert changes(simulation, "speed_control") == []


def test_who_holds_the_wheel_keeps_it_when_it_is_released_anew_xgv_64_xgv_69(open_hello: Opener) -> None:
    """Override from 4.0 to 6.0 s, and the steering uninitialised: the pedals alone go back."""
    simulation = open_hello(
        "injections=[{at_s: 4.0, vehicles: xgv_0, kind: override, duration_s: 2.0},"
        "{at_s: 5.0, vehicles: xgv_0, kind: steering_uninitialised}]"
    )
    simulation.run_until(7.0)
    assert changes(simulation, "steering_control")[-1] == (4.0, "driver")
    assert changes(simulation, "speed_control")[-2:] == [(4.0, "driver"), (6.0, "computer")]


def test_each_axis_has_a_reaction_of_its_own_begin_xgv_64(open_hello: Opener) -> None:
    """The wheel is released at 5.0, the pedals at 5.6 by the rider's own hand: his at 6.0 and at 5.6."""
    simulation = open_hello(
        "xgv.partial.allow_both=true",
        "injections=[{at_s: 5.0, vehicles: xgv_0, kind: steering_uninitialised}]",
    )
    simulation.run_until(5.6)
    simulation.vehicle("xgv_0").set_partial_mode("manual_speed")
    simulation.run_until(7.0)
    assert changes(simulation, "steering_control")[-2:] == [(5.0, "nobody"), (6.0, "driver")]
    assert changes(simulation, "speed_control")[-1] == (5.6, "driver")


def test_nobody_aboard_takes_no_axis_whatever_the_partial_mode_xgv_41_xgv_64(open_hello: Opener) -> None:
    simulation = open_hello(
        "bind.0.driver=none",
        "bind.0.partial=manual_speed",
        "bind.0.partial_forced=true",
        "injections=[{at_s: 5.0, vehicles: xgv_0, kind: steering_uninitialised}]",
    )
    simulation.run_until(8.0)
    assert changes(simulation, "steering_control")[-1] == (5.0, "nobody")
    assert changes(simulation, "speed_control")[-1][1] == "nobody"
