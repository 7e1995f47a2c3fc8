"""Stops that do not stop the car: who has the pedals, or what has taken the brake away, and for how long."""

from __future__ import annotations

import pytest

from tests.xgv_cosim.simulation.conftest import Opener
from tests.xgv_cosim.simulation.test_safety_timelines import changes, modes_after, rows

INEFFECTIVE = ("pause_ineffective", "disable_ineffective")


def told(simulation: object, kind: str) -> list[tuple[float, str, str, str]]:
    return [(e.t_s, e.before, e.after, e.reasons[0]) for e in rows(simulation, kind)]  # type: ignore[arg-type]


@pytest.mark.parametrize(("driver", "who"), [("rider", "rider"), ("world", "world's driver")])
def test_who_has_the_pedals_and_drives_on_makes_a_pause_ineffective_xgv_41(
    open_hello: Opener, driver: str, who: str
) -> None:
    """The car goes on in traffic; one event when it begins and one, with its duration, when it ends."""
    simulation = open_hello(
        f"bind.0.driver={driver}",
        "bind.0.partial=manual_speed",
        "injections=[{at_s: 5.03, vehicles: xgv_0, kind: estop_pause, duration_s: 2.5}]",
    )
    simulation.run_until(7.0)
    car = simulation.vehicle("xgv_0")
    assert (car.mode, car.speed_mps > 5.0) == ("estop_pause", True)
    simulation.run_until(8.0)
    assert told(simulation, "pause_ineffective") == [
        (5.03, "", "estop_pause", f"manual speed, and the {who} at the pedals drives on as in traffic"),
        (7.53, "estop_pause", "", "lasted 2.50 s"),
    ]


def test_a_software_pause_with_manual_speed_says_which_stop_does_not_act_xgv_41(open_hello: Opener) -> None:
    """A door, and above it the toggle: each demand has its own word and its own duration."""
    simulation = open_hello(
        "bind.0.partial=manual_speed",
        "injections=[{at_s: 4.0, vehicles: xgv_0, kind: door, duration_s: 3.0},"
        "{at_s: 5.02, vehicles: xgv_0, kind: estop_pause, duration_s: 1.0}]",
    )
    simulation.run_until(8.0)
    seen = [(t_s, before, after) for t_s, before, after, _ in told(simulation, "pause_ineffective")]
    assert seen == [
        (4.0, "", "software_pause"),
        (5.02, "software_pause", ""),
        (5.02, "", "estop_pause"),
        (6.02, "estop_pause", ""),
        (6.02, "", "software_pause"),
        (7.0, "software_pause", ""),
    ]


def test_a_pause_that_the_computer_brakes_says_nothing_xgv_41(open_hello: Opener) -> None:
    """Neither before the hand-over, where the world's driver has both axes by design, nor with the wheel
    alone manual."""
    simulation = open_hello(
        "bind.0.partial=manual_steering",
        "injections=[{at_s: 5.0, vehicles: xgv_0, kind: estop_pause}]",
    )
    simulation.run_until(7.0)
    assert simulation.vehicle("xgv_0").mode == "estop_pause"
    assert not any(rows(simulation, kind) for kind in INEFFECTIVE)


@pytest.mark.parametrize("code", [9109, 9110, 9111])
def test_a_brake_error_makes_the_pause_ineffective_xgv_38_xgv_41(open_hello: Opener, code: int) -> None:
    """It comes during the pause, and outlasts its cause until the operator clears it."""
    simulation = open_hello(
        "injections=[{at_s: 5.0, vehicles: xgv_0, kind: estop_pause},"
        f"{{at_s: 5.53, vehicles: xgv_0, kind: error, code: {code}, duration_s: 0.5}}]"
    )
    simulation.run_until(5.6)
    car = simulation.vehicle("xgv_0")
    speed_mps = car.speed_mps
    simulation.run_until(7.0)
    assert car.speed_mps > speed_mps - 1.0  # it rolls
    car.clear_errors()
    simulation.run_until(8.0)
    begun, ended = told(simulation, "pause_ineffective")
    assert begun[:3] == (5.53, "", "estop_pause")
    assert begun[3].startswith(f"no brake: error {code} brake")
    assert ended == (7.0, "estop_pause", "", "lasted 1.47 s")


def test_a_brake_error_pauses_a_driving_car_without_effect_xgv_38(open_hello: Opener) -> None:
    """The software pause by the error is one that cannot brake."""
    simulation = open_hello("injections=[{at_s: 5.04, vehicles: xgv_0, kind: error, code: 9109}]")
    simulation.run_until(6.0)
    assert modes_after(simulation, 5.0) == [(5.04, "software_pause")]
    assert told(simulation, "pause_ineffective") == [
        (5.04, "", "software_pause", "no brake: error 9109 brake")
    ]


def test_a_disable_without_a_brake_has_its_own_word_xgv_31_xgv_38(open_hello: Opener) -> None:
    """A pause is not what fails here: the event names the disable, and ends with the car's release too."""
    simulation = open_hello(
        "injections=[{at_s: 5.02, vehicles: xgv_0, kind: error, code: 9110},"
        "{at_s: 6.0, vehicles: xgv_0, kind: estop_button, duration_s: 2.0}]"
    )
    simulation.run_until(9.0)
    assert simulation.vehicle("xgv_0").speed_mps > 5.0
    assert [row[:3] for row in told(simulation, "disable_ineffective")] == [
        (6.0, "", "estop_disable"),
        (8.0, "estop_disable", ""),
    ]
    assert told(simulation, "disable_ineffective")[1][3] == "lasted 2.00 s"
    assert changes(simulation, "pause_ineffective") == [
        (5.02, "software_pause"),
        (6.0, ""),
        (8.0, "software_pause"),
    ]


def test_other_lost_functions_leave_the_brake_to_the_pause_xgv_38(open_hello: Opener) -> None:
    simulation = open_hello("injections=[{at_s: 5.0, vehicles: xgv_0, kind: error, code: 9106}]")
    simulation.run_until(7.0)
    assert simulation.vehicle("xgv_0").mode == "software_pause"
    assert not any(rows(simulation, kind) for kind in INEFFECTIVE)
