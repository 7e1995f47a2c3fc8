"""Edges inside a world step, who holds an axis, and settings that reach the vehicle."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.xgv_cosim.simulation.conftest import Opener
from tests.xgv_cosim.simulation.test_timelines import events_of
from xgv_cosim.commands import DiscreteDevices, Signals
from xgv_cosim.errors import CommandError, ScenarioError, WorldError


def inject(*rows: str) -> str:
    return f"injections=[{', '.join('{' + row + '}' for row in rows)}]"


def test_a_stop_under_override_acts_on_its_own_tick(open_hello: Opener) -> None:
    """XGV-29, XGV-31, XGV-71: each 10 ms later the button is pressed, the car stops 10 ms of way later."""
    ends = []
    for at_s in (6.0, 6.04, 6.09):
        rows = (
            "at_s: 5.0, vehicles: xgv_0, kind: override",
            f"at_s: {at_s}, vehicles: xgv_0, kind: estop_disable",
        )
        simulation = open_hello(inject(*rows))
        simulation.run_until(6.0)
        speed = simulation.vehicle("xgv_0").speed_mps
        simulation.run_until(12.0)
        assert events_of(simulation, "safety_mode")[-1] == (at_s, "estop_disable")
        ends.append((at_s, speed, simulation.vehicle("xgv_0").pose.x_m))
        simulation.close()
    for (early_s, speed, early_m), (late_s, _, late_m) in pairwise(ends):
        assert late_m - early_m == pytest.approx(speed * (late_s - early_s), abs=0.15 * speed * 0.1)


def test_a_driver_who_holds_the_wheel_keeps_it(open_hello: Opener) -> None:
    """XGV-64: his reaction time is for an axis that nobody had."""
    rows = ("at_s: 5.0, vehicles: xgv_0, kind: override", "at_s: 5.5, vehicles: xgv_0, kind: estop_disable")
    simulation = open_hello(inject(*rows))
    simulation.run_until(7.0)
    assert events_of(simulation, "steering_control")[-1] == (5.0, "driver")
    assert events_of(simulation, "speed_control")[-1] == (5.5, "computer")


def test_the_rider_takes_the_wheel_on_the_tick_his_reaction_ends(open_hello: Opener) -> None:
    """XGV-64, XGV-71: released at 5.03 s, reaction 0.25 s."""
    simulation = open_hello(
        inject("at_s: 5.03, vehicles: xgv_0, kind: estop_disable"), "bind.0.driver_reaction_s=0.25"
    )
    simulation.run_until(6.0)
    assert events_of(simulation, "steering_control")[-2:] == [(5.03, "nobody"), (5.28, "driver")]


def test_the_idealised_world_driver_takes_the_wheel_in_the_same_tick(open_hello: Opener) -> None:
    """XGV-64 ``bind.driver = world``."""
    simulation = open_hello(inject("at_s: 5.03, vehicles: xgv_0, kind: estop_disable"), "bind.0.driver=world")
    simulation.run_until(6.0)
    assert events_of(simulation, "steering_control")[-1] == (5.03, "driver")


def test_a_lost_link_loses_the_message_of_the_same_tick_and_carries_that_of_its_end(
    open_hello: Opener,
) -> None:
    """XGV-43: lost from 5.0 to 8.0 s the last motion is that of 4.9 s, the next one that of 8.0 s."""
    simulation = open_hello(inject("at_s: 5.0, vehicles: xgv_0, kind: cmd_loss, duration_s: 3.0"))
    simulation.run_until(9.0)
    assert events_of(simulation, "error") == [(5.3, "9157"), (8.0, "")]


@pytest.mark.parametrize("decel_mps2", [1.5, 4.0])
def test_a_pause_brakes_at_the_deceleration_that_was_set_and_holds_what_was_set(
    open_hello: Opener, decel_mps2: float
) -> None:
    """XGV-12, XGV-33, XGV-36: constant from the edge on (no jerk limit), whatever the user set."""
    simulation = open_hello(
        inject("at_s: 5.0, vehicles: xgv_0, kind: estop_pause"),
        f"xgv.pause.decel_mps2={decel_mps2}",
        "xgv.pause.hold_brake=0.3",
    )
    simulation.run_until(5.0)
    car = simulation.vehicle("xgv_0")
    speed, begin = car.speed_mps, car.pose.x_m
    simulation.run_until(18.0)
    assert car.speed_mps == 0.0
    delay_s = 0.06  # declared response of the pedals
    assert car.pose.x_m - begin == pytest.approx(
        speed**2 / (2 * decel_mps2) + speed * delay_s, rel=0.01, abs=0.1
    )
    slot = simulation.fleet.slot_of("xgv_0")
    assert simulation.fleet.motion.brake[slot] == pytest.approx(0.3, abs=1e-3)


def test_a_vehicle_that_is_bound_during_an_injection_meets_it(open_hello: Opener) -> None:
    simulation = open_hello(inject("at_s: 0.0, vehicles: xgv_0, kind: estop_pause, duration_s: 3.0"))
    simulation.run_until(2.0)
    assert simulation.vehicle("xgv_0").mode == "estop_pause"
    assert events_of(simulation, "injection_without_vehicle") == [(0.0, "estop_pause")]
    simulation.run_until(5.0)
    assert simulation.vehicle("xgv_0").mode == "drive_by_wire"


def test_two_holders_of_one_device_end_with_the_last(open_hello: Opener) -> None:
    """A scheduled pause and an operator's: the car is free when both have let go."""
    simulation = open_hello(inject("at_s: 2.0, vehicles: xgv_0, kind: estop_pause, duration_s: 2.0"))
    simulation.run_until(3.0)
    simulation.vehicle("xgv_0").estop("pause")
    simulation.run_until(5.0)
    assert simulation.vehicle("xgv_0").mode == "estop_pause"
    simulation.vehicle("xgv_0").estop("run")
    simulation.run_until(5.2)
    assert simulation.vehicle("xgv_0").mode == "drive_by_wire"


def test_each_stack_speaks_under_its_own_address(open_hello: Opener) -> None:
    """XGV-65: a controller is its JAUS id."""
    simulation = open_hello()
    simulation.run_until(1.0)
    controllers = {
        simulation.state.vehicle(name).endpoint.component_controller[10] for name in simulation.vehicle_ids
    }
    assert len(controllers) == len(simulation.vehicle_ids)


def test_an_error_needs_a_code_and_nothing_else_takes_one(open_hello: Opener) -> None:
    simulation = open_hello()
    simulation.step()
    car = simulation.vehicle("xgv_0")
    for arguments in ({"kind": "error"}, {"kind": "error", "code": 77}, {"kind": "door", "code": 9109}):
        with pytest.raises(ScenarioError, match="code"):
            car.inject(**arguments)  # type: ignore[arg-type]
    car.inject("error", code=9109)
    simulation.run_until(0.5)
    assert (car.mode, car.reasons[0]) == ("software_pause", "error 9109 brake")
    car.inject("error", code=9109, begins=False)
    simulation.run_until(1.0)
    assert car.mode == "software_pause"  # a hardware code stays until the operator clears it (XGV-38)
    car.clear_errors()
    simulation.run_until(1.5)
    assert car.mode == "drive_by_wire"


def test_after_a_step_that_failed_the_simulation_is_over(
    open_hello: Opener, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError

    simulation = open_hello()
    simulation.run_until(1.0)
    monkeypatch.setattr(simulation.world, "step", fails)
    with pytest.raises(ZeroDivisionError):
        simulation.step()
    monkeypatch.undo()
    with pytest.raises(WorldError, match="open a new one"):
        simulation.step()


@pytest.mark.parametrize("duration_s", [6.0, 6.03])
def test_a_controller_that_thaws_goes_on_where_it_froze_whatever_the_tick(
    open_hello: Opener, duration_s: float
) -> None:
    """XGV-65, XGV-67, XGV-71: its clock stood still, so neither command nor controller has timed out."""
    simulation = open_hello(inject(f"at_s: 3.0, vehicles: xgv_0, kind: frozen, duration_s: {duration_s}"))
    simulation.run_until(11.0)
    assert events_of(simulation, "error") == []
    assert [mode for _, mode in events_of(simulation, "safety_mode")] == ["software_pause", "drive_by_wire"]


def test_a_controller_that_froze_meets_its_time_outs_later(open_hello: Opener) -> None:
    """XGV-43, XGV-67: commands lost at 3.0, frozen from 3.1 to 5.03: the last motion ends that much later."""
    rows = (
        "at_s: 3.0, vehicles: xgv_0, kind: cmd_loss",
        "at_s: 3.1, vehicles: xgv_0, kind: frozen, duration_s: 1.93",
    )
    simulation = open_hello(inject(*rows))
    simulation.run_until(6.0)
    assert events_of(simulation, "error") == [(5.23, "9157")]  # without the freeze at 3.3


def test_what_is_no_message_is_refused_when_it_is_sent(open_hello: Opener) -> None:
    simulation = open_hello()
    simulation.step()
    car = simulation.vehicle("xgv_0")
    with pytest.raises(CommandError, match="expected one of"):
        car.send("hello")  # type: ignore[arg-type]
    with pytest.raises(
        CommandError, match=r"Signals.turn: got 9, expected Turn \(OFF, LEFT, RIGHT, HAZARD\)"
    ):
        Signals(turn=9)  # type: ignore[arg-type]
    with pytest.raises(CommandError, match=r"DiscreteDevices\.gear"):
        DiscreteDevices(gear=3)  # type: ignore[arg-type]
    with pytest.raises(CommandError, match="engine_on"):
        DiscreteDevices(engine_on="yes")  # type: ignore[arg-type]
    simulation.step()


def test_a_refusal_is_told_once_while_nothing_changes(open_hello: Opener) -> None:
    """XGV-37: the stack repeats Resume at every step of the door's pause."""
    simulation = open_hello(
        "xgv.rearm.preset=conservative", inject("at_s: 3.0, vehicles: xgv_0, kind: door, duration_s: 4.0")
    )
    simulation.run_until(6.5)
    refusals = [
        event
        for event in simulation.state.journal.events
        if event.kind == "command_refused" and event.t_s > 2.0
    ]
    assert 1 <= len(refusals) <= 2  # Resume of both drivers
