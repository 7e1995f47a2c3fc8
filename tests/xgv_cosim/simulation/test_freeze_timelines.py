"""What a controller that was frozen or off knows when it computes again."""

from __future__ import annotations

import pytest

from tests.xgv_cosim.simulation.conftest import Opener
from tests.xgv_cosim.simulation.test_client_timelines import TO_MOTION, Client
from tests.xgv_cosim.simulation.test_safety_timelines import changes, modes_after, rows
from xgv_cosim.actuation import LostFunction
from xgv_cosim.commands import MotionProfile, MotionQueue, Signals, Turn


def test_motions_that_wait_keep_their_whole_time_over_a_freeze_xgv_67_xgv_70(open_hello: Opener) -> None:
    """Three of 1 s from 0.1 s on, frozen from 0.6 to 2.63 s: the others begin 2.03 s later."""
    simulation = open_hello(
        "bind.0.stack=none",
        "xgv.motion.allow_many=true",
        "injections=[{at_s: 0.6, vehicles: xgv_0, kind: frozen, duration_s: 2.03}]",
    )
    client = Client(simulation)
    motions = tuple(MotionProfile(speed, 1.0, 0.0, 0.1, 1.0) for speed in (8.0, 7.0, 6.0))
    client.say(*TO_MOTION, MotionQueue(motions))
    commanded = simulation.fleet.command.speed_mps
    seen = []
    for until_s in (3.1, 3.2, 4.1, 4.2):
        simulation.run_until(until_s)
        seen.append(commanded[client.slot])
    assert seen == [8.0, 7.0, 7.0, 6.0]
    simulation.run_until(6.0)
    assert changes(simulation, "error") == [(pytest.approx(5.13), "9157")]


@pytest.mark.parametrize("kind", ["frozen", "inactive"])
def test_a_door_that_opened_meanwhile_is_warned_of_xgv_32_xgv_38_xgv_67(
    open_hello: Opener, kind: str
) -> None:
    """9176 follows from the device word, also from one that has not changed since."""
    simulation = open_hello(
        f"injections=[{{at_s: 3.0, vehicles: xgv_0, kind: {kind}, duration_s: 2.03}},"
        "{at_s: 4.0, vehicles: xgv_0, kind: door}]"
    )
    simulation.run_until(6.0)
    simulation.vehicle("xgv_0").door(is_open=False)
    simulation.run_until(6.5)
    warned = [row for row in changes(simulation, "warning") if row[1] == "9176"]
    assert warned == [(5.03, "9176")]
    assert [e.t_s for e in rows(simulation, "warning") if e.before == "9176"] == []  # the scheduled one holds


def test_a_hardware_override_that_outlasts_the_freeze_is_noticed_xgv_13_xgv_30_xgv_67(
    open_hello: Opener,
) -> None:
    """Engaged while the controller was frozen: when it computes again, signals and motions are dropped."""
    simulation = open_hello(
        "bind.0.stack=none",
        "injections=[{at_s: 1.0, vehicles: xgv_0, kind: frozen, duration_s: 2.03},"
        "{at_s: 2.0, vehicles: xgv_0, kind: emo}]",
    )
    client = Client(simulation)
    client.say(*TO_MOTION, MotionProfile(8.0, 1.0, 0.0, 0.1, 20.0), Signals(turn=Turn.LEFT))
    simulation.run_until(3.0)
    assert client.events("signals") == [(0.1, "off", "turn left")]  # held, like all it put out
    simulation.run_until(3.5)
    assert modes_after(simulation, 1.0) == [(2.0, "emergency_manual_override")]
    assert client.events("signals")[-1] == (3.03, "turn left", "off")
    assert [t_s for t_s, _, _ in client.events("command_dropped")] == [3.03]
    client.say(Signals(turn=Turn.RIGHT))
    assert "emergency manual override" in client.refusals()[-1]


@pytest.mark.parametrize("kind", ["frozen", "inactive"])
def test_nobody_clears_the_errors_of_a_controller_that_does_not_compute_xgv_32_xgv_67(
    open_hello: Opener, kind: str
) -> None:
    """The brake does not come back by a word to a display that nobody serves."""
    simulation = open_hello(
        "injections=[{at_s: 2.0, vehicles: xgv_0, kind: error, code: 9109, duration_s: 0.5},"
        f"{{at_s: 3.0, vehicles: xgv_0, kind: {kind}, duration_s: 2.0}}]"
    )
    simulation.run_until(4.0)
    car, slot = simulation.vehicle("xgv_0"), simulation.fleet.slot_of("xgv_0")
    car.clear_errors()
    simulation.run_until(4.5)
    assert changes(simulation, "operator_refused") == [(4.0, "clear_errors")]
    assert [code for _, code in changes(simulation, "error")] == ["9109"]
    if kind == "frozen":
        assert simulation.fleet.lost_functions[slot] == LostFunction.BRAKE
