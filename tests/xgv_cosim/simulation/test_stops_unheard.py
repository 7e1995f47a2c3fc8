"""A stop demand, or an override, that the mode in force does not meet is an event with its duration."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from tests.xgv_cosim.simulation.bare_world import Car, injection, simulation
from xgv_cosim.injection import Injection
from xgv_cosim.injection import InjectionKind as K
from xgv_cosim.simulation import Simulation
from xgv_cosim.vehicles.xgv.safestop import SafeStopSettings
from xgv_cosim.vehicles.xgv.settings import XgvSettings

STOP_MASKED = "stop_masked"
Row = tuple[float, str, str, str]


def driven(rows: Sequence[Injection], until_s: float, **radio: float) -> Simulation:
    settings = XgvSettings(safestop=SafeStopSettings(**radio))
    run = simulation({"car": Car(12.0)}, rows, settings)
    run.run_until(until_s)
    return run


def told(run: Simulation, kind: str) -> list[Row]:
    events = [event for event in run.state.journal.events if event.kind == kind]
    return [(event.t_s, event.before, event.after, event.reasons[0]) for event in events]


PRESSED = injection(200, K.ESTOP_DISABLE, "car", end_tick=303)
CASES = {
    "frozen before the hand-over": (
        [injection(0, K.CMD_LOSS, "car"), injection(5, K.FROZEN, "car"), PRESSED],
        "SafeStop stop relay",
        "controller frozen",
    ),
    "a stuck relay before the hand-over": (
        [injection(0, K.CMD_LOSS, "car"), injection(5, K.RELAY_STUCK_STOP, "car"), PRESSED],
        "SafeStop stop",
        "stop relay stuck",
    ),
    "frozen in a pause whose brake is not there yet": (
        [injection(150, K.ESTOP_PAUSE, "car"), injection(153, K.FROZEN, "car"), PRESSED],
        "SafeStop stop relay",
        "controller frozen",
    ),
    "a stuck relay, and a door has paused the car": (
        [injection(100, K.RELAY_STUCK_STOP, "car"), injection(150, K.DOOR, "car"), PRESSED],
        "SafeStop stop",
        "stop relay stuck",
    ),
    "link supervision has paused the car": (
        [injection(100, K.LINK, "car"), PRESSED],
        "SafeStop stop",
        "radio link lost",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_stop_without_full_brake_is_told_xgv_68(name: str) -> None:
    """XGV-31, XGV-68: a pause is no answer to the stop button, and the world's driver brakes for neither."""
    rows, what, why = CASES[name]
    run = driven(rows, 3.5)
    assert told(run, STOP_MASKED) == [(2.0, "", what, why), (3.03, what, "", "lasted 1.03 s")]
    assert run.vehicle("car").speed_mps > 5.0


def test_a_pause_that_a_pause_meets_is_not_masked_xgv_28_xgv_68() -> None:
    """XGV-28: the toggle at pause, unheard, in a car that a door has paused; masked once the door is shut."""
    run = driven(
        [
            injection(100, K.RELAY_STUCK_PAUSE, "car"),
            injection(150, K.DOOR, "car", end_tick=252),
            injection(200, K.ESTOP_PAUSE, "car"),
        ],
        3.0,
    )
    assert told(run, STOP_MASKED) == [(2.52, "", "SafeStop pause", "pause relay stuck")]


def test_before_the_hand_over_a_software_pause_meets_no_demand_xgv_68() -> None:
    run = driven(
        [
            injection(0, K.CMD_LOSS, "car"),
            injection(5, K.RELAY_STUCK_PAUSE, "car"),
            injection(150, K.ESTOP_PAUSE, "car"),
        ],
        2.0,
    )
    assert told(run, STOP_MASKED) == [(1.5, "", "SafeStop pause", "pause relay stuck")]
    assert run.vehicle("car").speed_mps == pytest.approx(12.0, abs=0.1)


def test_a_press_whose_frames_are_all_lost_is_told_xgv_42_xgv_68() -> None:
    """XGV-68: from the tick on which its first frame is due; one that is on its way is not masked."""
    ticks = range(150, 450, 10)
    pressed = [injection(tick, K.ESTOP_DISABLE, "car", end_tick=tick + 3) for tick in ticks]
    run = driven(pressed, 5.0, loss_share=0.7, latency_s=0.02, link_timeout_s=10.0)
    missed = [row for row in told(run, STOP_MASKED) if row[2]]
    assert {row[2:] for row in missed} == {("SafeStop stop", "radio frames lost")}
    due = {round(tick / 100 + 0.02, 2) for tick in ticks}
    missed_s = {round(row[0], 2) for row in missed}
    assert 5 < len(missed_s) < len(due)
    assert missed_s <= due
    assert all(_is_disabled(run, time_s) for time_s in due - missed_s)


def _is_disabled(run: Simulation, time_s: float) -> bool:
    modes = [e.after for e in run.state.journal.events if e.kind == "safety_mode" and e.t_s <= time_s + 1e-6]
    return modes[-1] == "estop_disable"


def test_a_pause_that_froze_before_its_brake_was_there_is_told_as_weak_xgv_36_xgv_67() -> None:
    """XGV-36, XGV-67: 30 ms into the pause the pedal had begun to move; so it stays."""
    run = driven([injection(150, K.ESTOP_PAUSE, "car"), injection(153, K.FROZEN, "car")], 3.0)
    ((t_s, _, mode, why),) = told(run, "pause_weaker_than_set")
    assert (t_s, mode) == (1.53, "estop_pause")
    assert why.startswith("set to 2.50 m/s², but the frozen controller holds a brake that gives ")
    assert 0.0 < -run.vehicle("car").accel_mps2 < 2.0
    assert told(run, STOP_MASKED) == []  # the pause is held, and told as weak


def test_a_disable_that_froze_before_its_brake_was_there_is_told_as_weak_xgv_31_xgv_67() -> None:
    run = driven([injection(150, K.ESTOP_BUTTON, "car"), injection(153, K.FROZEN, "car")], 2.0)
    ((t_s, _, mode, why),) = told(run, "disable_weaker_than_full")
    assert (t_s, mode) == (1.53, "estop_disable")
    assert "but what the frozen controller holds gives" in why


def test_a_freeze_in_a_settled_stop_hides_nothing_xgv_67() -> None:
    """Full brake is held to the standstill: no demand is without effect."""
    run = driven([injection(150, K.ESTOP_DISABLE, "car"), injection(220, K.FROZEN, "car")], 5.0)
    assert run.vehicle("car").speed_mps == 0.0
    kinds = {event.kind for event in run.state.journal.events}
    assert not kinds & {STOP_MASKED, "pause_weaker_than_set", "disable_weaker_than_full"}


def test_inactive_releases_a_disable_that_a_frozen_controller_held_xgv_32_xgv_67() -> None:
    run = driven(
        [
            injection(150, K.ESTOP_BUTTON, "car"),
            injection(200, K.FROZEN, "car"),
            injection(250, K.INACTIVE, "car"),
        ],
        3.0,
    )
    assert [row[:3] for row in told(run, "disable_released")] == [(2.5, "estop_disable", "inactive")]


def test_a_disable_without_brake_assistance_says_how_weak_it_is_xgv_31() -> None:
    """XGV-31: the engine goes off by the disable, and full effort gives a share of its deceleration."""
    settings = XgvSettings(disable_engine_off=True, engine_brake_assist_lost=True)
    run = simulation({"car": Car(12.0)}, [injection(203, K.ESTOP_DISABLE, "car")], settings)
    run.run_until(9.0)
    begin, end = told(run, "disable_weaker_than_full")
    assert begin[:3] == (2.03, "", "estop_disable")
    assert "but a brake without assistance gives" in begin[3]
    assert end[1] == "estop_disable"
    full = simulation({"car": Car(12.0)}, [injection(203, K.ESTOP_DISABLE, "car")])
    full.run_until(6.0)
    assert told(full, "disable_weaker_than_full") == []


@pytest.mark.parametrize(
    ("kind", "event", "what"),
    [(K.OVERRIDE, "override_masked", "manual override"), (K.DOOR, STOP_MASKED, "door or liftgate")],
)
def test_what_a_frozen_controller_does_not_see_is_told_xgv_13_xgv_67(kind: K, event: str, what: str) -> None:
    """XGV-13 says "at any time"; the controller that would obey does not compute. EMO needs none."""
    run = driven(
        [
            injection(150, K.FROZEN, "car"),
            injection(203, kind, "car"),
            injection(255, K.EMO, "car", end_tick=300),
            injection(355, K.FROZEN, "car"),
        ],
        3.5,
    )
    assert told(run, event) == [
        (2.03, "", what, "controller frozen"),
        (2.55, what, "", "lasted 0.52 s"),
        (3.0, "", what, "controller frozen"),
    ]


def test_an_override_that_acts_is_not_masked_xgv_13() -> None:
    run = driven([injection(150, K.OVERRIDE, "car"), injection(200, K.FROZEN, "car")], 3.0)
    assert told(run, "override_masked") == []
