"""Who has the wheel and the pedals of a car whose steering or brake an error has taken away."""

from __future__ import annotations

import pytest

from tests.xgv_cosim.simulation.conftest import Opener
from tests.xgv_cosim.simulation.test_axis_takers import REACTION_S, Cars
from tests.xgv_cosim.simulation.test_safety_timelines import changes, modes_after
from xgv_cosim.actuation import Driver, Lateral, Longitudinal, LostFunction
from xgv_cosim.commands import CommandKind
from xgv_cosim.runs.vehicles import time_without_control_s
from xgv_cosim.vehicles.xgv.modes import MANUAL_STEERING


@pytest.mark.parametrize(
    ("driver", "then"),
    [(Driver.RIDER, Lateral.DRIVER), (Driver.WORLD, Lateral.DRIVER), (Driver.NONE, Lateral.FREE)],
)
def test_a_lost_steering_is_released_and_the_driver_takes_the_wheel_xgv_38_xgv_64(
    driver: Driver, then: Lateral
) -> None:
    cars = Cars(driver)
    cars.fleet.lost_functions[1] = LostFunction.STEERING | LostFunction.THROTTLE
    axes = cars.at(1.0)
    assert cars.of(1)[1] is (Lateral.DRIVER if driver is Driver.WORLD else Lateral.FREE)
    assert axes.steering_released_s[1] == 1.0
    cars.at(1.0 + REACTION_S - 0.01)
    assert cars.of(1)[1] is (Lateral.DRIVER if driver is Driver.WORLD else Lateral.FREE)
    cars.at(1.0 + REACTION_S)
    assert cars.of(1) == (Longitudinal.CLOSED_LOOP, then)
    assert cars.of(0) == cars.of(2) == (Longitudinal.CLOSED_LOOP, Lateral.CLOSED_LOOP)
    cars.fleet.lost_functions[1] = LostFunction.THROTTLE
    cars.at(5.0)
    assert cars.of(1)[1] is Lateral.CLOSED_LOOP


def test_who_steers_already_keeps_the_wheel_when_the_steering_is_lost_xgv_39_xgv_64() -> None:
    cars = Cars()
    cars.fleet.partial_mode[0] = MANUAL_STEERING
    cars.at(1.0)
    cars.fleet.lost_functions[0] = LostFunction.STEERING
    cars.at(1.1)
    assert cars.of(0)[1] is Lateral.DRIVER


def test_a_lost_steering_is_nobodys_also_while_the_controller_is_frozen_xgv_38_xgv_67() -> None:
    cars = Cars(Driver.NONE)
    cars.fleet.frozen[1] = True
    cars.fleet.held.longitudinal[1], cars.fleet.held.lateral[1] = Longitudinal.OPEN_LOOP, Lateral.OPEN_LOOP
    cars.fleet.lost_functions[1] = LostFunction.STEERING
    cars.at(1.0)
    assert cars.of(1) == (Longitudinal.OPEN_LOOP, Lateral.FREE)


def test_before_the_hand_over_a_lost_steering_changes_nothing_xgv_38() -> None:
    cars = Cars()
    cars.fleet.handed_over[:] = False
    cars.fleet.command.kind[:] = CommandKind.NONE
    cars.fleet.lost_functions[0] = LostFunction.STEERING
    cars.at(1.0)
    assert cars.of(0) == (Longitudinal.DRIVER, Lateral.DRIVER)


def test_the_seconds_of_a_wheel_in_nobodys_hands_are_told_xgv_38_xgv_64(open_hello: Opener) -> None:
    """9103 at speed, on its own tick: nobody has the wheel until the rider takes it, a second later."""
    simulation = open_hello(
        "injections=[{at_s: 3.03, vehicles: xgv_0, kind: error, code: 9103, duration_s: 0.5}]"
    )
    simulation.run_until(4.5)
    assert modes_after(simulation, 3.0) == [(3.03, "software_pause")]
    handed = [row for row in changes(simulation, "steering_control") if row[0] > 2.0]
    assert handed == [(3.03, "nobody"), (4.03, "driver")]
    spent = time_without_control_s(simulation.state.journal.events, simulation.now_s)
    assert spent == {"speed": 0.0, "steering": pytest.approx(1.0)}
    simulation.vehicle("xgv_0").clear_errors()
    simulation.run_until(4.7)
    assert changes(simulation, "steering_control")[-1] == (4.5, "computer")


def test_a_rider_stays_passive_when_the_brake_is_lost_and_the_pause_is_told_xgv_38_xgv_64(
    open_hello: Opener,
) -> None:
    """A lost brake releases no axis: the computer keeps pedals and gear, throttle 0, and the car rolls on."""
    simulation = open_hello(
        "injections=[{at_s: 3.03, vehicles: xgv_0, kind: error, code: 9109, duration_s: 0.5}]"
    )
    simulation.run_until(3.0)
    fast = simulation.vehicle("xgv_0").speed_mps
    assert fast > 3.0
    simulation.run_until(5.5)
    slot = simulation.fleet.slot_of("xgv_0")
    assert simulation.fleet.longitudinal[slot] == Longitudinal.CONTROLLED_STOP
    assert simulation.vehicle("xgv_0").speed_mps > fast - 1.0
    assert changes(simulation, "pause_ineffective") == [(3.03, "software_pause")]
    assert [row for row in changes(simulation, "speed_control") if row[0] > 2.0] == []
