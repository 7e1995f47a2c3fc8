"""Who takes a released axis, and what a frozen controller holds: columns alone, no traffic."""

from __future__ import annotations

import math

import numpy as np
import pytest

from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from xgv_cosim.actuation import Driver, Lateral, Longitudinal
from xgv_cosim.commands import CommandKind
from xgv_cosim.fleet import Fleet
from xgv_cosim.simulation import moding
from xgv_cosim.simulation.moding import AxisModes
from xgv_cosim.vehicles.xgv.modes import (
    EMERGENCY_OVERRIDE_ENGAGED,
    ESTOP_BUTTON,
    LINK_GOOD,
    MANUAL_OVERRIDE_ENGAGED,
    MANUAL_SPEED,
    MANUAL_STEERING,
    SAFESTOP_PAUSE,
    STEERING_UNINITIALISED,
)
from xgv_cosim.vehicles.xgv.profile import XgvProfile

REACTION_S = 0.7


class Cars:
    """Cars that drive by wire, and slot 3 free; each in a fleet of one profile."""

    def __init__(self, driver: Driver = Driver.RIDER) -> None:
        self.fleet = fleet = Fleet()
        self.slots = np.array([fleet.occupy(name) for name in ("a", "b", "c")], np.int64)
        self.groups = [(XgvProfile(), self.slots)]
        fleet.driver[self.slots] = driver
        fleet.driver_reaction_s[:] = REACTION_S
        fleet.control_mode[self.slots] = ControlMode.MOTION_PROFILES
        fleet.ready_mode[self.slots] = ReadyMode.READY
        fleet.command.kind[self.slots] = CommandKind.MOTION_PROFILE
        fleet.safety_devices[self.slots] = LINK_GOOD
        fleet.handed_over[self.slots] = True
        self.at(0.0)

    def at(self, now_s: float) -> AxisModes:
        """Resolve as the loop does, and put the answer in force."""
        fleet = self.fleet
        axes = moding.take_axes(fleet, moding.resolve(fleet, self.groups), now_s)
        fleet.safety_mode, fleet.longitudinal, fleet.lateral = (
            axes.safety_mode,
            axes.longitudinal,
            axes.lateral,
        )
        fleet.speed_released_s, fleet.steering_released_s = axes.speed_released_s, axes.steering_released_s
        fleet.handed_over = axes.handed_over
        return axes

    def of(self, slot: int) -> tuple[Longitudinal, Lateral]:
        return Longitudinal(int(self.fleet.longitudinal[slot])), Lateral(int(self.fleet.lateral[slot]))


@pytest.mark.parametrize(("driver", "lateral"), [(Driver.WORLD, Lateral.DRIVER), (Driver.NONE, Lateral.FREE)])
def test_the_world_takes_a_released_axis_at_once_and_nobody_never_xgv_64(
    driver: Driver, lateral: Lateral
) -> None:
    cars = Cars(driver)
    cars.fleet.safety_devices[1] |= ESTOP_BUTTON
    for now_s in (1.0, 100.0):
        cars.at(now_s)
        assert cars.of(1) == (Longitudinal.FULL_BRAKE, lateral)
    assert moding.next_take_over_s(cars.fleet) == math.inf
    assert cars.of(0) == cars.of(2) == (Longitudinal.CLOSED_LOOP, Lateral.CLOSED_LOOP)


def test_the_rider_takes_the_wheel_when_his_reaction_is_over_and_not_before_xgv_64() -> None:
    cars = Cars()
    cars.fleet.safety_devices[1] |= ESTOP_BUTTON
    cars.at(1.0)
    assert cars.of(1) == (Longitudinal.FULL_BRAKE, Lateral.FREE)
    assert moding.next_take_over_s(cars.fleet) == pytest.approx(1.0 + REACTION_S)
    cars.at(1.0 + REACTION_S - 0.01)
    assert cars.of(1)[1] is Lateral.FREE
    cars.at(1.0 + REACTION_S)
    assert cars.of(1)[1] is Lateral.DRIVER
    assert moding.next_take_over_s(cars.fleet) == math.inf
    cars.fleet.safety_devices[1] = LINK_GOOD
    axes = cars.at(3.0)
    assert cars.of(1) == (Longitudinal.CLOSED_LOOP, Lateral.CLOSED_LOOP)
    assert axes.steering_released_s[1] == math.inf
    cars.fleet.safety_devices[1] |= ESTOP_BUTTON
    cars.at(4.0)  # released anew: his time counts anew
    assert cars.of(1)[1] is Lateral.FREE
    assert moding.next_take_over_s(cars.fleet) == pytest.approx(4.0 + REACTION_S)


def test_each_axis_counts_for_itself_xgv_64_xgv_69() -> None:
    """The pedals are his by his own hand; the wheel, which nobody gave him, takes its time."""
    cars = Cars()
    cars.fleet.partial_mode[0] = MANUAL_SPEED
    cars.fleet.safety_devices[0] |= STEERING_UNINITIALISED
    axes = cars.at(2.0)
    assert cars.of(0) == (Longitudinal.DRIVER, Lateral.FREE)
    assert (axes.speed_released_s[0], axes.steering_released_s[0]) == (2.0, 2.0)
    cars.at(2.0 + REACTION_S)
    assert cars.of(0) == (Longitudinal.DRIVER, Lateral.DRIVER)


@pytest.mark.parametrize(
    ("partial", "expected"),
    [
        (MANUAL_SPEED, (Longitudinal.DRIVER, Lateral.CLOSED_LOOP)),
        (MANUAL_STEERING, (Longitudinal.CLOSED_LOOP, Lateral.DRIVER)),
    ],
)
def test_what_he_took_himself_is_his_at_once_xgv_39_xgv_64(
    partial: int, expected: tuple[Longitudinal, Lateral]
) -> None:
    cars = Cars()
    cars.fleet.partial_mode[2] = partial
    cars.at(1.0)
    assert cars.of(2) == expected
    cars.fleet.safety_devices[2] |= MANUAL_OVERRIDE_ENGAGED
    cars.at(1.1)
    assert cars.of(2) == (Longitudinal.DRIVER, Lateral.DRIVER)


def test_an_axis_that_he_holds_he_keeps_when_it_is_released_for_another_reason_xgv_64() -> None:
    cars = Cars()
    cars.fleet.partial_mode[0] = MANUAL_STEERING
    cars.at(1.0)
    cars.fleet.safety_devices[0] |= ESTOP_BUTTON
    cars.at(2.0)
    assert cars.of(0) == (Longitudinal.FULL_BRAKE, Lateral.DRIVER)


def test_the_next_to_take_over_is_the_earliest_of_both_axes_and_all_cars_xgv_64() -> None:
    cars = Cars()
    fleet = cars.fleet
    fleet.longitudinal[0], fleet.speed_released_s[0] = Longitudinal.FREE, 5.0
    fleet.lateral[1], fleet.steering_released_s[1] = Lateral.FREE, 4.0
    assert moding.next_take_over_s(fleet) == pytest.approx(4.0 + REACTION_S)
    fleet.speed_released_s[0] = 3.0
    assert moding.next_take_over_s(fleet) == pytest.approx(3.0 + REACTION_S)
    fleet.driver[0] = Driver.NONE
    assert moding.next_take_over_s(fleet) == pytest.approx(4.0 + REACTION_S)


def test_before_the_hand_over_both_axes_are_the_drivers_until_something_ends_it() -> None:
    """Cross-profile rules, Binding: a live command in the run state, or an emergency stop device."""
    cars = Cars()
    fleet = cars.fleet
    fleet.handed_over[:] = False
    fleet.command.kind[:] = CommandKind.NONE
    axes = cars.at(1.0)
    assert [cars.of(slot) for slot in cars.slots] == [(Longitudinal.DRIVER, Lateral.DRIVER)] * 3
    assert not axes.handed_over.any()
    assert cars.of(3) == (Longitudinal.HOLD, Lateral.FREE)  # a free slot is nobody's
    fleet.command.kind[0] = CommandKind.MOTION_PROFILE
    fleet.safety_devices[1] |= SAFESTOP_PAUSE
    cars.at(2.0)
    assert cars.of(0) == (Longitudinal.CLOSED_LOOP, Lateral.CLOSED_LOOP)
    assert cars.of(1) == (Longitudinal.CONTROLLED_STOP, Lateral.CLOSED_LOOP)
    assert cars.of(2) == (Longitudinal.DRIVER, Lateral.DRIVER)
    assert fleet.handed_over[:4].tolist() == [True, True, False, False]
    fleet.command.kind[0] = CommandKind.NONE
    cars.at(3.0)
    assert cars.of(0)[0] is Longitudinal.CONTROLLED_STOP  # once handed over, it stays so


def test_a_frozen_controller_holds_and_its_neighbours_do_not_xgv_67() -> None:
    cars = Cars()
    fleet = cars.fleet
    fleet.frozen[1] = True
    fleet.held.safety_mode[1] = SafetyMode.ESTOP_PAUSE
    fleet.held.longitudinal[1], fleet.held.lateral[1] = Longitudinal.OPEN_LOOP, Lateral.OPEN_LOOP
    fleet.safety_devices[cars.slots] |= ESTOP_BUTTON  # nothing that needs software acts on the frozen one
    fleet.partial_mode[1] = MANUAL_SPEED | MANUAL_STEERING
    answer = moding.resolve(fleet, cars.groups)
    assert answer.safety_mode[:3].tolist() == [
        SafetyMode.ESTOP_DISABLE,
        SafetyMode.ESTOP_PAUSE,
        SafetyMode.ESTOP_DISABLE,
    ]
    assert (answer.longitudinal[1], answer.lateral[1]) == (Longitudinal.OPEN_LOOP, Lateral.OPEN_LOOP)
    assert answer.stop_demanded[:3].tolist() == [True, False, True]
    for column in (answer.speed_engaged, answer.steering_engaged, answer.in_run_state, answer.pausing):
        assert not column[1]


@pytest.mark.parametrize("name", ["speed_engaged", "steering_engaged", "in_run_state", "pausing"])
def test_what_a_computing_controller_answers_is_not_held_back_by_a_frozen_neighbour_xgv_67(name: str) -> None:
    cars = Cars()
    fleet = cars.fleet
    fleet.frozen[1] = True
    if name == "pausing":
        fleet.safety_devices[cars.slots] |= SAFESTOP_PAUSE
    elif name != "in_run_state":
        fleet.partial_mode[cars.slots] = MANUAL_SPEED | MANUAL_STEERING
    answer = moding.resolve(fleet, cars.groups)
    assert getattr(answer, name)[:4].tolist() == [True, False, True, False]
    assert answer.stop_demanded.any() == (name == "pausing")


def test_the_emergency_override_acts_on_a_frozen_car_alone_by_its_bit_xgv_30_xgv_67() -> None:
    cars = Cars()
    cars.fleet.frozen[1] = True
    cars.fleet.held.safety_mode[1] = SafetyMode.DRIVE_BY_WIRE
    cars.fleet.safety_devices[1] |= EMERGENCY_OVERRIDE_ENGAGED | ESTOP_BUTTON
    cars.at(1.0)
    assert cars.fleet.safety_mode[1] == SafetyMode.EMERGENCY_MANUAL_OVERRIDE
    assert cars.of(1) == (Longitudinal.DRIVER, Lateral.DRIVER)


def test_a_rider_keeps_an_axis_that_a_frozen_controller_had_released_xgv_64_xgv_67() -> None:
    cars = Cars()
    fleet = cars.fleet
    fleet.safety_devices[1] |= ESTOP_BUTTON
    cars.at(1.0)
    fleet.frozen[1] = True
    fleet.held.longitudinal[1], fleet.held.lateral[1] = Longitudinal.OPEN_LOOP, Lateral.FREE
    cars.at(1.2)
    assert cars.of(1) == (Longitudinal.OPEN_LOOP, Lateral.FREE)
    cars.at(1.0 + REACTION_S)
    assert cars.of(1) == (Longitudinal.OPEN_LOOP, Lateral.DRIVER)
    fleet.longitudinal[1], fleet.held.longitudinal[1] = Longitudinal.DRIVER, Longitudinal.FREE
    cars.at(1.1 + REACTION_S)  # the pedals were his when it froze: he does not take time again
    assert cars.of(1) == (Longitudinal.DRIVER, Lateral.DRIVER)
