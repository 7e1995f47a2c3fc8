"""One car's safety devices, controller and columns, event by event, without a step of the world between."""

from __future__ import annotations

import math

import numpy as np
import pytest

from jaus.address import ComponentId, JausAddress
from jaus.component import StatusCommand
from tests.xgv_cosim.simulation.bare_world import Car, simulation
from xgv_cosim.actuation import Gear, Lateral, Longitudinal
from xgv_cosim.commands import CommandKind, DiscreteDevices
from xgv_cosim.endpoint import CommandStatus, DevicesCommanded, RequestControl
from xgv_cosim.injection import InjectionKind, OperatorAction
from xgv_cosim.simulation import Simulation, commanding, safety
from xgv_cosim.simulation.state import RunState
from xgv_cosim.vehicles.xgv.safestop import SafeStopSettings
from xgv_cosim.vehicles.xgv.settings import XgvSettings

FROZEN, INACTIVE, LINK = InjectionKind.FROZEN, InjectionKind.INACTIVE, InjectionKind.LINK


def next_s(state: RunState) -> float:
    """Return when somebody acts next: a command ends, or endpoint, devices or a message on the way act."""
    return min(commanding.next_expiry_s(state), state.alarms.next_s)


class Bench:
    """A car that drives by wire at 12 m/s since 0.1 s, at 1.0 s; time goes on by hand."""

    def __init__(self, speed_mps: float = 12.0, **settings: object) -> None:
        self.run: Simulation = simulation({"car": Car(speed_mps)}, [], XgvSettings(**settings))  # type: ignore[arg-type]
        self.run.run_until(1.0)
        self.state, self.fleet = self.run.state, self.run.fleet
        self.car = self.state.vehicle("car")
        self.seen = len(self.state.journal.events)

    def at(self, time_s: float) -> Bench:
        self.state.clock.tick = round(time_s * 100)
        return self

    def apply(self, kind: InjectionKind, *, begins: bool = True, code: int | None = None) -> Bench:
        safety.apply(self.state, self.car, kind, code, begins=begins)
        return self

    def told(self) -> list[tuple[str, str, str]]:
        """Return (kind, before, after) of what was told since the last call."""
        events = self.state.journal.events[self.seen :]
        self.seen = len(self.state.journal.events)
        assert all(event.vehicle == "car" and event.t_s == self.run.now_s for event in events)
        return [(event.kind, event.before, event.after) for event in events]

    def held(self) -> tuple[int, int, int]:
        held = self.fleet.held
        return int(held.safety_mode[0]), int(held.longitudinal[0]), int(held.lateral[0])


def test_who_freezes_holds_modes_and_pedals_as_they_are_xgv_67() -> None:
    bench = Bench()
    motion = bench.fleet.motion
    motion.throttle[0], motion.brake[0], motion.steer_rad[0] = 0.31, 0.12, 0.05
    held = bench.fleet.held
    held.governed[0] = Longitudinal.FREE
    bench.apply(FROZEN)
    assert held.governed[0] == Longitudinal.CLOSED_LOOP
    assert (held.throttle[0], held.brake[0], held.steer_rad[0]) == (0.31, 0.12, 0.05)
    assert bench.held() == (1, Longitudinal.OPEN_LOOP, Lateral.OPEN_LOOP)
    assert bench.fleet.frozen[0]
    assert bench.car.frozen_since_s == 1.0
    motion.throttle[0] = 0.9
    bench.at(2.0).apply(FROZEN)  # a second cause of the same: it is frozen already
    assert (held.throttle[0], bench.car.frozen_since_s) == (0.31, 1.0)


@pytest.mark.parametrize("longitudinal", [Longitudinal.FREE, Longitudinal.DRIVER, Longitudinal.FULL_BRAKE])
@pytest.mark.parametrize("lateral", [Lateral.FREE, Lateral.DRIVER, Lateral.CLOSED_LOOP])
def test_an_axis_that_was_released_stays_released_in_a_freeze_xgv_67(
    longitudinal: Longitudinal, lateral: Lateral
) -> None:
    bench = Bench()
    bench.fleet.longitudinal[0], bench.fleet.lateral[0] = longitudinal, lateral
    bench.apply(FROZEN)
    _, speed, steering = bench.held()
    assert speed == (Longitudinal.OPEN_LOOP if longitudinal is Longitudinal.FULL_BRAKE else longitudinal)
    assert steering == (Lateral.OPEN_LOOP if lateral is Lateral.CLOSED_LOOP else lateral)


def test_a_freeze_puts_off_commands_and_the_endpoints_deadlines_by_its_length_xgv_67() -> None:
    bench = Bench()
    expires_s, deadline_s = bench.fleet.command.expires_s[0], bench.car.endpoint.next_deadline_s
    assert expires_s == pytest.approx(1.3)  # the last motion came at 0.9 s
    assert math.isfinite(deadline_s)
    bench.apply(FROZEN)
    bench.at(1.25).apply(FROZEN, begins=False)
    assert bench.fleet.command.expires_s[0] == pytest.approx(expires_s + 0.25)
    assert bench.car.endpoint.next_deadline_s == pytest.approx(deadline_s + 0.25)
    assert not bench.fleet.frozen[0]
    bench.at(1.3).apply(InjectionKind.DOOR)  # and not again
    assert bench.fleet.command.expires_s[0] == pytest.approx(expires_s + 0.25)
    assert bench.car.endpoint.next_deadline_s == pytest.approx(deadline_s + 0.25)


def test_what_happens_during_a_freeze_puts_nothing_off_a_second_time_xgv_67() -> None:
    bench = Bench()
    expires_s = bench.fleet.command.expires_s[0]
    bench.apply(FROZEN)
    bench.at(1.5).apply(InjectionKind.DOOR)
    assert bench.fleet.command.expires_s[0] == expires_s
    bench.at(2.0).apply(FROZEN, begins=False)
    assert bench.fleet.command.expires_s[0] == pytest.approx(expires_s + 1.0)


@pytest.mark.parametrize(("bits", "takes_gears"), [(0, True), (1, True), (2, False)])
def test_a_controller_that_boots_knows_who_has_the_gear_xgv_32_xgv_41(bits: int, takes_gears: bool) -> None:
    """Bit 1 of the partial mode, manual speed: with the speed the human has the gear."""
    bench = Bench()
    bench.fleet.partial_mode[0] = bits
    bench.apply(INACTIVE)
    bench.at(2.0).apply(INACTIVE, begins=False)
    alice, endpoint = JausAddress(1, 2, 4, 1), bench.car.endpoint
    for message in (
        RequestControl(ComponentId.PRIMITIVE_DRIVER, 6),
        CommandStatus(ComponentId.PRIMITIVE_DRIVER, StatusCommand.RESUME),
    ):
        endpoint.receive(message, alice, 2.0)
    endpoint.safety_mode_entered(1, 2.0)
    events = endpoint.receive(DiscreteDevices(gear=Gear.NEUTRAL), alice, 2.0)
    assert any(isinstance(event, DevicesCommanded) for event in events) == takes_gears


def test_a_controller_that_boots_knows_nothing_of_a_parking_brake_that_it_drove_against_xgv_32() -> None:
    bench = Bench()
    bench.car.drags = True
    bench.apply(INACTIVE)
    bench.at(2.0).apply(INACTIVE, begins=False)
    assert not bench.car.drags


def test_a_controller_that_goes_inactive_has_no_command_no_modes_and_boots_anew_xgv_01_xgv_32() -> None:
    bench = Bench()
    bench.fleet.partial_mode[0] = 1
    endpoint = bench.car.endpoint
    bench.apply(INACTIVE)
    assert bench.fleet.command.kind[0] == CommandKind.NONE
    assert bench.fleet.command.expires_s[0] == math.inf
    assert (bench.fleet.control_mode[0], bench.fleet.ready_mode[0]) == (0, 0)
    assert bench.told() == [
        ("control_mode", "motion_profiles", "unknown"),
        ("ready_mode", "ready", "unknown"),
    ]
    bench.apply(InjectionKind.DOOR)
    assert bench.told() == []
    assert bench.car.endpoint is endpoint
    bench.at(2.0).apply(INACTIVE, begins=False)
    assert bench.car.endpoint is not endpoint
    assert bench.told() == [
        ("control_mode", "unknown", "software_pause"),
        ("ready_mode", "unknown", "software_pause"),
        ("warning", "", "9176"),
    ]
    assert (bench.fleet.control_mode[0], bench.fleet.ready_mode[0]) == (1, 1)
    assert bench.car.endpoint.component_controller == dict.fromkeys(bench.car.endpoint.component_controller)


def test_a_car_without_power_finds_its_errors_when_it_boots_xgv_32_xgv_38() -> None:
    bench = Bench()
    bench.apply(InjectionKind.ERROR, code=9109)
    assert bench.told()[0] == ("error", "", "9109")
    assert bench.car.raised == {9109}
    bench.apply(INACTIVE).told()
    bench.apply(InjectionKind.ERROR, code=9103)
    assert bench.told() == []
    bench.at(2.0).apply(INACTIVE, begins=False)
    errors = [row for row in bench.told() if row[0] == "error"]
    assert errors == [("error", "", "9103"), ("error", "", "9109")]
    assert bench.car.raised == {9103, 9109}
    assert bench.fleet.lost_functions[0] == bench.car.endpoint.lost_functions != 0


def test_a_frozen_controller_finds_and_clears_errors_when_it_goes_on_xgv_38_xgv_67() -> None:
    bench = Bench()
    bench.apply(InjectionKind.ERROR, code=9138).apply(FROZEN).told()
    bench.apply(InjectionKind.ERROR, code=9138, begins=False).apply(InjectionKind.ERROR, code=9109)
    assert bench.told() == []
    bench.at(1.5).apply(FROZEN, begins=False)
    assert [row for row in bench.told() if row[0] in {"error", "warning"} and "91" in row[1] + row[2]][
        :2
    ] == [
        ("error", "9138", ""),
        ("error", "", "9109"),
    ]


def test_a_booted_controller_that_is_frozen_at_once_notices_nothing_xgv_67() -> None:
    bench = Bench()
    bench.apply(INACTIVE).apply(FROZEN).apply(InjectionKind.DOOR)
    assert not bench.fleet.frozen[0]  # what is off cannot freeze
    bench.told()
    bench.at(2.0).apply(INACTIVE, begins=False)
    assert bench.fleet.frozen[0]
    assert ("warning", "", "9176") not in bench.told()
    bench.at(3.0).apply(FROZEN, begins=False)
    assert ("warning", "", "9176") in bench.told()


def test_a_hardware_override_of_a_frozen_car_is_noticed_when_it_goes_on_xgv_30_xgv_67() -> None:
    heard: list[tuple[int, float]] = []
    for mode in (1, 10):
        bench = Bench()
        bench.apply(FROZEN)
        endpoint = bench.car.endpoint
        bench.fleet.safety_mode[0] = mode
        entered = endpoint.safety_mode_entered
        endpoint.safety_mode_entered = lambda code, now_s, entered=entered: (  # type: ignore[method-assign]
            heard.append((code, now_s)) or entered(code, now_s)
        )
        bench.at(1.5).apply(FROZEN, begins=False)
    assert heard == [(10, 1.5)]


def test_devices_act_when_they_are_due_and_not_before_xgv_42_xgv_71() -> None:
    bench = Bench(safestop=SafeStopSettings(latency_s=0.05))
    bench.apply(LINK)
    assert bench.car.devices.next_deadline_s == pytest.approx(1.5)  # the frame of 0.95 came at 1.0
    safety.meet_deadlines(bench.at(1.49).state)
    assert bench.told() == []
    safety.meet_deadlines(bench.at(1.5).state)
    assert bench.told()[:2] == [("safestop_link", "good", "none"), ("error", "", "9138")]
    assert bench.fleet.safety_devices[0] & 0b11010 == 0b00010  # pause relay open, no link
    assert bench.car.devices.next_deadline_s == math.inf


def test_a_device_that_is_due_a_rounding_later_is_due_and_one_of_an_inactive_car_boots_nothing() -> None:
    bench = Bench()
    bench.apply(LINK)
    bench.apply(INACTIVE).told()
    bench.state.clock.tick = 147
    assert bench.car.devices.next_deadline_s == pytest.approx(1.45 + 0.05)
    safety.meet_deadlines(bench.state)
    assert bench.told() == []
    endpoint = bench.car.endpoint
    bench.at(1.5)
    safety.meet_deadlines(bench.state)
    assert bench.told() == [("safestop_link", "good", "none")]
    assert bench.car.endpoint is endpoint


def test_nobody_bound_nothing_due() -> None:
    run = simulation({"late": Car(10.0, enters_s=5.0)}, [])
    assert next_s(run.state) == math.inf


def test_an_operators_initialisation_is_told_and_changes_the_device_word_xgv_69() -> None:
    bench = Bench()
    bench.apply(InjectionKind.STEERING_UNINITIALISED)
    assert bench.fleet.safety_devices[0] & 1 << 9
    bench.told()
    safety.operate(bench.state, bench.car, OperatorAction.INITIALISE_STEERING)
    assert bench.told()[0] == ("operator", "", "initialise_steering")
    assert not bench.fleet.safety_devices[0] & 1 << 9
    bench.apply(INACTIVE).told()
    safety.operate(bench.state, bench.car, OperatorAction.REARM)
    assert bench.told() == [("operator", "", "rearm")]  # and it is not booted by it


def test_a_command_ends_on_the_tick_on_which_it_expires_and_no_sooner_xgv_43() -> None:
    bench = Bench()
    command = bench.fleet.command
    expires_s = float(command.expires_s[0])
    assert next_s(bench.state) == expires_s
    commanding.meet_deadlines(bench.at(1.29).state)
    assert command.kind[0] == CommandKind.MOTION_PROFILE
    command.expires_s[0] = 1.3 + 5e-10  # a sum of floats
    commanding.meet_deadlines(bench.at(1.3).state)
    assert (command.kind[0], command.expires_s[0]) == (CommandKind.NONE, math.inf)
    assert ("error", "", "9157") in bench.told()


def test_where_one_command_ends_another_goes_on_xgv_43() -> None:
    run = simulation({"one": Car(12.0), "other": Car(12.0, x_m=100.0)}, [])
    run.run_until(1.0)
    command, (one, other) = run.fleet.command, map(run.fleet.slot_of, ("one", "other"))
    command.expires_s[one], command.expires_s[other] = 1.3, 1.8
    run.state.clock.tick = 130
    commanding.meet_deadlines(run.state)
    assert (command.kind[one], command.kind[other]) == (CommandKind.NONE, CommandKind.MOTION_PROFILE)


def test_a_frozen_or_inactive_controller_meets_no_deadline_xgv_32_xgv_43_xgv_67() -> None:
    for kind in (FROZEN, INACTIVE):
        bench = Bench()
        expires_s = float(bench.fleet.command.expires_s[0])
        bench.apply(kind).told()
        assert next_s(bench.state) == math.inf
        commanding.meet_deadlines(bench.at(30.0).state)
        assert bench.told() == []
        assert bench.fleet.command.expires_s[0] == (expires_s if kind is FROZEN else math.inf)


def test_a_frozen_or_inactive_controller_is_silent_where_its_devices_are_due_xgv_32_xgv_67() -> None:
    """Its own deadline is past too; the devices of a car need no software."""
    for kind in (FROZEN, INACTIVE):
        bench = Bench(controller_timeout_s=0.4)
        bench.fleet.command.expires_s[0] = 50.0
        endpoint = bench.car.endpoint
        bench.apply(LINK).apply(kind).told()
        assert endpoint.next_deadline_s == pytest.approx(1.3)
        assert bench.state.alarms.next_s == bench.car.devices.next_deadline_s == pytest.approx(1.5)
        commanding.meet_deadlines(bench.at(1.6).state)
        assert bench.told() == []
        assert endpoint.next_deadline_s == pytest.approx(1.3)
        assert any(endpoint.component_controller.values())


def test_what_is_under_way_arrives_on_its_tick_at_who_computes_by_then_xgv_32_xgv_67() -> None:
    for kind in (None, FROZEN, INACTIVE):
        bench = Bench()
        bench.fleet.command.expires_s[0] = 50.0
        if kind is not None:
            bench.apply(kind).told()
        standby = CommandStatus(ComponentId.PRIMITIVE_DRIVER, StatusCommand.STANDBY)
        sender = JausAddress(1, 2, 2, 1)
        bench.car.on_the_way.append((120, sender, standby))
        bench.state.alarms.touch(bench.car)
        before = bench.car.endpoint.component_status
        commanding.meet_deadlines(bench.at(1.19).state)
        assert len(bench.car.on_the_way) == 1
        assert bench.car.endpoint.component_status == before
        commanding.meet_deadlines(bench.at(1.2).state)
        assert not bench.car.on_the_way
        assert (bench.car.endpoint.component_status == before) == (kind is not None)


def test_a_silent_controller_loses_control_on_its_tick_xgv_65() -> None:
    bench = Bench(controller_timeout_s=2.0)
    bench.fleet.command.expires_s[0] = 50.0
    assert next_s(bench.state) == pytest.approx(2.9)
    commanding.meet_deadlines(bench.at(2.89).state)
    assert bench.told() == []
    commanding.meet_deadlines(bench.at(2.9).state)
    assert bench.told()[0] == (
        "component_control",
        "Motion Profile Driver: 1.2.2.1",
        "Motion Profile Driver: nobody",
    )
    assert next_s(bench.state) == math.inf  # its command was dropped with it


@pytest.mark.parametrize("begins", [True, False])
@pytest.mark.parametrize("kind", [FROZEN, INACTIVE, InjectionKind.CMD_LOSS])
def test_targets_given_column_by_column_reach_only_who_hears_his_stack_xgv_32_xgv_67(
    kind: InjectionKind, begins: bool
) -> None:
    """Whoever does not compute, or whose stack is cut off, keeps the target that it has."""
    run = simulation({"one": Car(12.0), "other": Car(12.0, x_m=100.0)}, [])
    run.run_until(1.0)
    command, slots = run.fleet.command, np.array(list(map(run.fleet.slot_of, ("one", "other"))))
    safety.apply(run.state, run.state.vehicle("one"), kind, None, begins=True)
    if not begins:
        safety.apply(run.state, run.state.vehicle("one"), kind, None, begins=False)
    had, expires_s = command.speed_mps[slots].copy(), command.expires_s[slots].copy()
    reached = run.renew_motions(slots, np.array([3.0, 4.0]), np.array([0.01, 0.02]), 5.0)
    one_hears = not begins and kind is not INACTIVE  # who has booted anew has no motion in force
    assert reached.tolist() == [one_hears, True]
    assert command.speed_mps[slots].tolist() == [3.0 if one_hears else had[0], 4.0]
    assert command.expires_s[slots].tolist() == [6.0 if one_hears else expires_s[0], 6.0]
    assert command.curvature_per_m[slots[1]] == 0.02


def test_targets_given_column_by_column_bring_no_motion_into_force() -> None:
    bench = Bench()
    commanding.clear_command(bench.fleet.command, 0)
    slots = np.array([0])
    assert not bench.run.renew_motions(slots, np.array([3.0]), np.array([0.0]), 5.0)[0]
    assert bench.fleet.command.kind[0] == CommandKind.NONE
    assert bench.fleet.command.expires_s[0] == math.inf
