"""Safety devices on real traffic, tick by tick: SafeStop radio, frozen or inactive controllers, re-arming."""

from __future__ import annotations

import pytest

import xgv_cosim
from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from tests.xgv_cosim.simulation.conftest import Opener
from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.clock import time_of_tick_s
from xgv_cosim.endpoint import RequestControl
from xgv_cosim.errors import ScenarioError
from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.simulation import commanding
from xgv_cosim.snapshot import Snapshot


def rows(simulation: xgv_cosim.Simulation, kind: str, vehicle: str = "xgv_0") -> list[Event]:
    return [e for e in simulation.state.journal.events if e.kind == kind and e.vehicle == vehicle]


def changes(simulation: xgv_cosim.Simulation, kind: str, vehicle: str = "xgv_0") -> list[tuple[float, str]]:
    return [(event.t_s, event.after) for event in rows(simulation, kind, vehicle)]


def modes_after(
    simulation: xgv_cosim.Simulation, time_s: float, vehicle: str = "xgv_0"
) -> list[tuple[float, str]]:
    return [row for row in changes(simulation, "safety_mode", vehicle) if row[0] >= time_s]


def test_everything_acts_on_its_own_tick_inside_a_world_step(open_hello: Opener) -> None:
    """XGV-71: edges, link time-out, frames, injections, command time-outs and modes at 10 ms resolution."""
    simulation = open_hello(
        "injections=["
        "{at_s: 3.03, vehicles: xgv_0, kind: door, duration_s: 0.04},"
        "{at_s: 3.54, vehicles: xgv_0, kind: link, duration_s: 0.62},"
        "{at_s: 5.01, vehicles: xgv_0, kind: estop_pause, duration_s: 0.33},"
        "{at_s: 6.06, vehicles: xgv_0, kind: cmd_loss, duration_s: 0.8},"
        "{at_s: 7.47, vehicles: xgv_0, kind: override, duration_s: 0.05}]",
        "safestop.latency_s=0.02",
    )
    simulation.run_until(8.0)
    assert modes_after(simulation, 3.0) == [
        (3.03, "software_pause"),
        (3.07, "drive_by_wire"),
        (4.02, "estop_pause"),  # the last frame arrived at 3.52, half a second before
        (4.17, "drive_by_wire"),  # the frame of 4.15 is the first that arrives again
        (5.03, "estop_pause"),  # pressed at 5.01, 20 ms on its way
        (5.36, "drive_by_wire"),
        (6.4, "software_pause"),  # the motion of 6.0 s lasts 0.4 s
        (6.9, "drive_by_wire"),
        (7.47, "manual_override"),
        (7.52, "drive_by_wire"),
    ]
    assert changes(simulation, "safestop_link") == [(4.02, "none"), (4.17, "good")]
    assert changes(simulation, "error") == [(4.02, "9138"), (4.17, ""), (6.4, "9157"), (6.9, "")]
    # Hand-overs of axes are written on the ticks of their modes, too.
    assert (7.47, "driver") in changes(simulation, "speed_control")


def test_one_press_pauses_every_car_that_the_transmitter_serves(open_hello: Opener) -> None:
    """XGV-12, XGV-42: an injection with a pattern is one transmitter for many cars."""
    simulation = open_hello(
        "injections=[{at_s: 4.0, vehicles: 'xgv_*', kind: estop_pause}]",
        "safestop.loss_share=0.8",
        "safestop.link_timeout_s=20",
    )
    simulation.run_until(3.9)
    assert len(simulation.vehicle_ids) > 1
    served = simulation.vehicle_ids
    simulation.run_until(8.0)
    begins = {name: modes_after(simulation, 4.0, name)[0] for name in served}
    assert {mode for _, mode in begins.values()} == {"estop_pause"}
    assert all(4.0 <= time_s < 7.0 for time_s, _ in begins.values())
    assert len({time_s for time_s, _ in begins.values()}) > 1


def test_lost_frames_repeat_with_the_seed(open_hello: Opener) -> None:
    """XGV-42: losses are drawn from seed and vehicle; the same run gives the same times."""
    seen = []
    for seed in (1, 1, 2):
        simulation = open_hello(
            f"seed={seed}",
            "injections=[{at_s: 2.0, vehicles: xgv_0, kind: estop_pause, duration_s: 0.5}]",
            "safestop.loss_share=0.7",
            "safestop.link_timeout_s=0.3",
        )
        simulation.run_until(5.0)
        seen.append((changes(simulation, "safety_mode"), changes(simulation, "safestop_link")))
        simulation.close()
    assert seen[0] == seen[1] != seen[2]


def test_bypass_and_a_dead_receiver(open_hello: Opener) -> None:
    """XGV-42, XGV-68: bypass masks the lost link only; a dead receiver stops the car all the same."""
    simulation = open_hello(
        "injections=["
        "{at_s: 2.0, vehicles: xgv_0, kind: bypass},"
        "{at_s: 3.0, vehicles: xgv_0, kind: link},"
        "{at_s: 4.23, vehicles: xgv_0, kind: receiver_dead}]"
    )
    simulation.run_until(5.0)
    assert modes_after(simulation, 2.0) == [(4.23, "estop_disable")]
    assert [(e.t_s, e.before, e.after, e.reasons) for e in rows(simulation, "stop_masked")] == [
        (3.5, "", "SafeStop link loss", ("bypass",)),
        (4.23, "SafeStop link loss", "", ("lasted 0.73 s",)),
    ]
    assert changes(simulation, "safestop_link") == [(2.0, "bypass")]


def test_a_stop_that_a_stuck_relay_swallows_is_an_event(open_hello: Opener) -> None:
    """XGV-42, XGV-68: the car drives on, and the log says that a stop was demanded."""
    simulation = open_hello(
        "injections=["
        "{at_s: 2.0, vehicles: xgv_0, kind: relay_stuck_stop},"
        "{at_s: 3.02, vehicles: xgv_0, kind: estop_disable, duration_s: 1.5}]"
    )
    simulation.run_until(6.0)
    assert modes_after(simulation, 2.0) == []
    begin, end = rows(simulation, "stop_masked")
    assert (begin.t_s, begin.after, begin.reasons) == (3.02, "SafeStop stop", ("stop relay stuck",))
    assert (end.t_s, end.before, end.reasons) == (4.52, "SafeStop stop", ("lasted 1.50 s",))


def test_a_pause_under_override_is_masked_and_acts_when_the_override_ends(open_hello: Opener) -> None:
    """XGV-29, XGV-68: the demand is written with its duration, and takes hold afterwards."""
    simulation = open_hello(
        "injections=["
        "{at_s: 3.0, vehicles: xgv_0, kind: override, duration_s: 2.0},"
        "{at_s: 3.55, vehicles: xgv_0, kind: estop_pause}]"
    )
    simulation.run_until(6.0)
    assert modes_after(simulation, 3.0) == [(3.0, "manual_override"), (5.0, "estop_pause")]
    begin, end = rows(simulation, "stop_masked")
    assert (begin.t_s, begin.after, begin.reasons) == (3.55, "SafeStop pause relay", ("manual override",))
    assert (end.t_s, end.reasons) == (5.0, ("lasted 1.45 s",))


def test_an_emergency_stop_button_latches_until_a_hand_resets_it(open_hello: Opener) -> None:
    """XGV-31, XGV-37: without a hand the disable lasts; literally, the car goes on by itself after it."""
    simulation = open_hello("injections=[{at_s: 3.0, vehicles: xgv_0, kind: estop_button, duration_s: 6.0}]")
    simulation.run_until(8.9)
    car = simulation.vehicle("xgv_0")
    assert (car.mode, car.reasons[0], car.speed_mps) == ("estop_disable", "emergency stop button", 0.0)
    slot = simulation.fleet.slot_of("xgv_0")
    assert simulation.fleet.motion.brake[slot] == pytest.approx(1.0, abs=0.01)
    simulation.run_until(14.0)
    assert car.mode == "drive_by_wire"
    assert car.speed_mps > 2.0


def test_a_frozen_controller_holds_its_outputs_and_only_the_emergency_override_acts(
    open_hello: Opener,
) -> None:
    """XGV-30, XGV-67: door, override and error change nothing; the hardware override does, at once."""
    simulation = open_hello(
        "injections=["
        "{at_s: 5.03, vehicles: xgv_0, kind: estop_pause, duration_s: 1.0},"
        "{at_s: 5.53, vehicles: xgv_0, kind: frozen},"
        "{at_s: 6.11, vehicles: xgv_0, kind: override, duration_s: 0.5},"
        "{at_s: 6.7, vehicles: xgv_0, kind: door, duration_s: 0.2},"
        "{at_s: 7.0, vehicles: xgv_0, kind: error, code: 9109, duration_s: 0.2},"
        "{at_s: 9.02, vehicles: xgv_0, kind: emo, duration_s: 1.0}]"
    )
    simulation.run_until(5.5)
    fleet, slot, car = simulation.fleet, simulation.fleet.slot_of("xgv_0"), simulation.vehicle("xgv_0")
    simulation.run_until(5.6)
    held = (
        float(fleet.motion.throttle[slot]),
        float(fleet.motion.brake[slot]),
        float(fleet.motion.steer_rad[slot]),
    )
    assert held[1] > 0.05  # it froze while the pause was braking
    seen = simulation.state.vehicle("xgv_0").last_view
    while simulation.now_s < 9.0:
        simulation.step()
        assert car.mode == "estop_pause"
        assert car.reasons == ("controller frozen: last outputs held",)
        assert (fleet.longitudinal[slot], fleet.lateral[slot]) == (Longitudinal.OPEN_LOOP, Lateral.OPEN_LOOP)
        now = (fleet.motion.throttle[slot], fleet.motion.brake[slot], fleet.motion.steer_rad[slot])
        assert now == pytest.approx(held, abs=1e-6)
        assert simulation.state.vehicle("xgv_0").last_view is seen  # the endpoint is silent
    assert modes_after(simulation, 5.0) == [(5.03, "estop_pause")]
    assert changes(simulation, "error") == []
    simulation.run_until(9.1)
    assert modes_after(simulation, 9.0) == [(9.02, "emergency_manual_override")]
    assert car.reasons[0] == "emergency manual override"
    assert car.vehicle_mode_report() is None
    assert changes(simulation, "speed_control")[-1] == (9.02, "driver")
    simulation.run_until(10.6)
    assert modes_after(simulation, 10.0) == [(10.02, "estop_pause")]  # the held outputs act again
    assert fleet.motion.brake[slot] == pytest.approx(held[1], abs=0.005)


def test_a_stop_demand_on_a_frozen_car_is_masked_and_a_thawed_controller_obeys(open_hello: Opener) -> None:
    """XGV-67, XGV-68: nothing with software acts; afterwards the modes are computed anew on their tick."""
    simulation = open_hello(
        "injections=["
        "{at_s: 4.02, vehicles: xgv_0, kind: frozen, duration_s: 2.0},"
        "{at_s: 4.51, vehicles: xgv_0, kind: estop_disable}]"
    )
    simulation.run_until(6.0)
    car = simulation.vehicle("xgv_0")
    assert car.mode == "drive_by_wire"
    assert car.speed_mps > 5.0
    simulation.run_until(6.5)
    assert modes_after(simulation, 4.0) == [(6.02, "estop_disable")]
    masked = [(e.t_s, e.after, e.reasons) for e in rows(simulation, "stop_masked")]
    assert masked == [
        (4.51, "SafeStop stop relay", ("controller frozen",)),
        (6.02, "", ("lasted 1.51 s",)),
    ]
    # The controller's clock stood still with it: the command of 4.0 s still had 0.38 s to live.
    assert changes(simulation, "error") == []


def test_an_inactive_system_is_a_stock_car_with_telemetry_and_silence(open_hello: Opener) -> None:
    """XGV-01, XGV-02, XGV-03, XGV-32: no modes, the driver drives, data are still collected."""
    recorded: list[tuple[float, int, float]] = []

    class Recorder:
        def record_event(self, event: Event) -> None:
            pass

        def record_step(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
            if "xgv_0" in fleet.ids:
                slot = fleet.slot_of("xgv_0")
                row = (
                    time_of_tick_s(tick),
                    int(fleet.control_mode[slot]),
                    float(fleet.motion.speed_mps[slot]),
                )
                recorded.append(row)

    simulation = open_hello("injections=[{at_s: 4.03, vehicles: xgv_0, kind: inactive, duration_s: 3.0}]")
    simulation.state.journal._observers = (Recorder(),)
    simulation.run_until(4.5)
    car, slot = simulation.vehicle("xgv_0"), simulation.fleet.slot_of("xgv_0")
    assert (car.mode, car.reasons) == ("inactive", ("system not active",))
    assert car.vehicle_mode_report() is None
    assert (simulation.fleet.control_mode[slot], simulation.fleet.ready_mode[slot]) == (0, 0)
    assert changes(simulation, "speed_control")[-1] == (4.03, "driver")
    assert changes(simulation, "steering_control")[-1] == (4.03, "driver")
    last = simulation.state.vehicle("xgv_0").last_view
    assert last is not None
    assert last.safety_mode == "drive_by_wire"  # the last report before it fell silent
    simulation.run_until(7.0)
    manual = [row for row in recorded if 4.1 <= row[0] <= 7.0]
    assert len(manual) == 30
    assert {control for _, control, _ in manual} == {0}
    assert all(speed > 1.0 for *_, speed in manual)
    simulation.run_until(9.0)  # booted again: nobody in control, until the stack has it anew
    booted = modes_after(simulation, 7.0)
    assert booted[0] == (7.03, "software_pause")
    assert booted[-1][1] == "drive_by_wire"


def test_going_inactive_during_a_disable_releases_the_brake_and_says_so(open_hello: Opener) -> None:
    """XGV-32: inactive ranks above disable; with nobody aboard the car then creeps."""
    simulation = open_hello(
        "bind.0.driver=none",
        "injections=["
        "{at_s: 3.0, vehicles: xgv_0, kind: estop_disable},"
        "{at_s: 9.04, vehicles: xgv_0, kind: inactive}]",
    )
    simulation.run_until(9.0)
    car, slot = simulation.vehicle("xgv_0"), simulation.fleet.slot_of("xgv_0")
    assert (car.mode, car.speed_mps) == ("estop_disable", 0.0)
    simulation.run_until(12.0)
    assert modes_after(simulation, 9.0) == [(9.04, "inactive")]
    (event,) = rows(simulation, "disable_released")
    assert (event.t_s, event.before, event.after) == (9.04, "estop_disable", "inactive")
    assert simulation.fleet.motion.brake[slot] == pytest.approx(0.0, abs=1e-3)
    assert car.speed_mps > 0.1
    assert rows(simulation, "stop_masked")[0].reasons == ("system not active",)


def test_literal_goes_on_by_itself_and_conservative_asks_for_a_fresh_resume(open_hello: Opener) -> None:
    """XGV-37: both presets through the same pause; Resume is refused while it lasts."""
    injection = "injections=[{at_s: 3.02, vehicles: xgv_0, kind: estop_pause, duration_s: 2.0}]"
    literal = open_hello(injection)
    literal.run_until(6.0)
    assert modes_after(literal, 3.0) == [(3.02, "estop_pause"), (5.02, "drive_by_wire")]
    assert not [row for row in changes(literal, "component_status") if "standby" in row[1] and row[0] > 1.0]
    literal.close()

    simulation = open_hello(injection, "xgv.rearm.preset=conservative")
    simulation.run_until(5.0)
    status = simulation.state.vehicle("xgv_0").endpoint.component_status
    assert status[ComponentId.PRIMITIVE_DRIVER] is ComponentStatus.STANDBY
    assert status[ComponentId.MOTION_PROFILE_DRIVER] is ComponentStatus.STANDBY
    refused = rows(simulation, "command_refused")[-1]
    assert refused.reasons == ("Resume is refused: the e-stop pause lasts",)
    simulation.run_until(6.0)
    assert modes_after(simulation, 3.0) == [
        (3.02, "estop_pause"),
        (5.02, "software_pause"),  # released, but nobody has resumed it yet
        (5.1, "drive_by_wire"),  # the stack's next Resume
    ]


def test_after_a_disable_the_conservative_preset_waits_for_the_operator(open_hello: Opener) -> None:
    """XGV-37 ``operator``: the stack's Resume is refused until ``rearm()``."""
    simulation = open_hello(
        "xgv.rearm.preset=conservative",
        "injections=[{at_s: 3.0, vehicles: xgv_0, kind: estop_button, duration_s: 2.0}]",
    )
    simulation.run_until(4.0)
    car = simulation.vehicle("xgv_0")
    car.rearm()  # too early: the button is still pressed
    simulation.run_until(7.0)
    assert car.mode == "software_pause"
    refused = rows(simulation, "command_refused")[-1]
    assert refused.reasons == (
        "Resume is refused: the operator has not re-armed it after the e-stop disable",
    )
    car.rearm()
    simulation.run_until(7.5)
    assert car.mode == "drive_by_wire"
    assert changes(simulation, "operator") == [(4.0, "rearm"), (7.0, "rearm")]


@pytest.mark.parametrize(
    ("cause", "injection"),
    [
        ("door", "kind: door"),
        ("override", "kind: override"),
        ("error", "kind: error, code: 9143"),
        ("link_loss", "kind: link"),
    ],
)
def test_each_cause_has_its_own_key(open_hello: Opener, cause: str, injection: str) -> None:
    """XGV-37: with ``operator`` the car stays in standby after that cause; a mere warning is none."""
    simulation = open_hello(
        f"xgv.rearm.{cause}=operator",
        f"injections=[{{at_s: 3.0, vehicles: xgv_0, {injection}, duration_s: 1.0}}]",
    )
    simulation.run_until(6.0)
    car = simulation.vehicle("xgv_0")
    assert car.mode == ("drive_by_wire" if cause == "error" else "software_pause")
    car.rearm()
    simulation.run_until(6.5)
    assert car.mode == "drive_by_wire"


@pytest.mark.parametrize("value", ["auto", "operator"])
def test_a_preempted_car_is_paused_at_speed_and_goes_on_as_its_key_says(
    open_hello: Opener, value: str
) -> None:
    """XGV-66: authority is arbitration; who takes over a moving car pauses it."""
    simulation = open_hello(f"xgv.rearm.preemption={value}")
    simulation.run_until(5.0)
    vehicle = simulation.state.vehicle("xgv_0")
    thief = JausAddress(77, 9, 3, 1)
    events = vehicle.endpoint.receive(
        RequestControl(ComponentId.PRIMITIVE_DRIVER, 200), thief, simulation.now_s
    )
    commanding.handle(simulation.state, vehicle, events)
    simulation.step()
    car = simulation.vehicle("xgv_0")
    assert (car.mode, car.speed_mps > 5.0) == ("software_pause", True)
    assert len(rows(simulation, "control_preempted")) == 1
    standby = vehicle.endpoint.component_status[ComponentId.PRIMITIVE_DRIVER] is ComponentStatus.STANDBY
    assert standby == (value == "operator")


def test_uninitialised_steering_is_nobodys_until_an_operator_has_initialised_it(open_hello: Opener) -> None:
    """XGV-69: software pause with a free wheel; the rider takes it after his reaction; OK ends it."""
    simulation = open_hello("injections=[{at_s: 3.02, vehicles: xgv_0, kind: steering_uninitialised}]")
    simulation.run_until(3.5)
    car = simulation.vehicle("xgv_0")
    assert (car.mode, car.reasons) == ("software_pause", ("steering requires initialisation",))
    assert changes(simulation, "steering_control")[-1] == (3.02, "nobody")
    assert changes(simulation, "speed_control") == [(0.1, "computer")]
    simulation.run_until(9.0)
    assert car.speed_mps == 0.0
    assert changes(simulation, "steering_control")[-1][1] == "driver"
    car.initialise_steering()
    simulation.run_until(9.5)
    assert car.mode == "drive_by_wire"
    assert changes(simulation, "steering_control")[-1] == (9.0, "computer")


def test_a_pause_without_anybody_at_the_pedals_is_ineffective(open_hello: Opener) -> None:
    """XGV-41: manual speed forced with nobody aboard: the pause does not stop the car, and it is logged."""
    simulation = open_hello("bind.0.driver=none")
    simulation.run_until(5.0)
    car = simulation.vehicle("xgv_0")
    with pytest.raises(ScenarioError, match="nobody aboard"):
        car.set_partial_mode("manual_speed")
    car.set_partial_mode("manual_speed", force=True)
    simulation.run_until(5.1)
    car.estop("pause")
    simulation.run_until(7.1)
    assert car.mode == "estop_pause"
    assert car.speed_mps > 5.0
    car.estop("run")
    simulation.run_until(7.2)
    begin, end = rows(simulation, "pause_ineffective")
    assert (begin.t_s, begin.after) == (5.1, "estop_pause")
    assert begin.reasons == ("manual speed, and nobody has the pedals",)
    assert (end.t_s, end.reasons) == (7.1, ("lasted 2.00 s",))


def test_software_override_needs_the_controller_and_hardware_override_does_not(open_hello: Opener) -> None:
    """XGV-29, XGV-30: alike while the controller computes; frozen, only the hardware one acts."""
    for kind, expected in (("override", "manual_override"), ("emo", "emergency_manual_override")):
        simulation = open_hello(
            f"injections=[{{at_s: 3.0, vehicles: xgv_0, kind: {kind}, duration_s: 1.0}},"
            f"{{at_s: 5.0, vehicles: xgv_0, kind: frozen}},"
            f"{{at_s: 5.5, vehicles: xgv_0, kind: {kind}}}]"
        )
        simulation.run_until(6.0)
        modes = [mode for _, mode in modes_after(simulation, 3.0)]
        again = [expected] if kind == "emo" else []
        assert modes == [expected, "drive_by_wire", *again]
        simulation.close()


def test_a_scenario_may_force_a_manual_axis_without_a_driver(open_hello: Opener) -> None:
    """XGV-41: refused unless forced."""
    with pytest.raises(ScenarioError, match="partial_forced"):
        open_hello("bind.0.driver=none", "bind.0.partial=manual_speed")
    simulation = open_hello("bind.0.driver=none", "bind.0.partial=manual_speed", "bind.0.partial_forced=true")
    simulation.run_until(4.0)
    simulation.vehicle("xgv_0").estop("pause")
    simulation.run_until(5.0)
    assert changes(simulation, "pause_ineffective") == [(4.0, "estop_pause")]


@pytest.mark.parametrize("kind", ["reinit", "shutdown", "pause_request"])
def test_kinds_that_the_xgv_has_not_say_so(open_hello: Opener, kind: str) -> None:
    """Cross-profile rules: unsupported kinds are events, not silence."""
    simulation = open_hello(f"injections=[{{at_s: 1.0, vehicles: xgv_0, kind: {kind}}}]")
    simulation.run_until(1.5)
    assert changes(simulation, "injection_unsupported") == [(1.0, kind)]
