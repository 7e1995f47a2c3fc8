"""One SafeStop transmitter for many cars, through whole simulations (XGV-42)."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from tests.xgv_cosim.simulation.bare_world import Car, injection, simulation
from tests.xgv_cosim.simulation.conftest import Opener
from xgv_cosim.errors import ScenarioError
from xgv_cosim.injection import Injection, InjectionKind
from xgv_cosim.simulation import Simulation
from xgv_cosim.vehicles.xgv.safestop import SafeStopSettings
from xgv_cosim.vehicles.xgv.settings import XgvSettings

PAUSE, STOP, LINK = InjectionKind.ESTOP_PAUSE, InjectionKind.ESTOP_DISABLE, InjectionKind.LINK
CARS = {name: Car(12.0, x_m=40.0 * place) for place, name in enumerate(["a", "b", "c", "own"])}
RADIOS = {"a": "north", "b": "north", "c": "south"}


def opened(
    rows: Sequence[Injection], cars: dict[str, Car] = CARS, radios: dict[str, str] = RADIOS, **radio: float
) -> Simulation:
    return simulation(cars, rows, XgvSettings(safestop=SafeStopSettings(**radio)), radios)


def modes(run: Simulation, name: str, since_s: float = 1.0) -> list[tuple[float, str]]:
    return [
        (event.t_s, event.after)
        for event in run.state.journal.events
        if event.kind == "safety_mode" and event.vehicle == name and event.t_s >= since_s
    ]


def told(
    run: Simulation, name: str, kind: str = "injection"
) -> list[tuple[float, str, str, tuple[str, ...]]]:
    return [
        (event.t_s, event.before, event.after, event.reasons)
        for event in run.state.journal.events
        if event.kind == kind and event.vehicle == name
    ]


@pytest.mark.parametrize(("kind", "mode"), [(PAUSE, "estop_pause"), (STOP, "estop_disable")])
def test_one_press_stops_all_cars_of_the_transmitter_and_no_other(kind: InjectionKind, mode: str) -> None:
    """Each after the radio's latency, on its tick; a car of another radio, or with its own, drives on."""
    run = opened([injection(203, kind, transmitter="north", end_tick=405)], latency_s=0.07)
    run.run_until(5.0)
    for name in ("a", "b"):
        assert modes(run, name) == [(2.1, mode), (4.12, "drive_by_wire")]
        assert told(run, name) == [
            (2.03, "", kind.value, ("transmitter north",)),
            (4.05, kind.value, "", ("transmitter north",)),
        ]
    for name in ("c", "own"):
        assert modes(run, name) == []
        assert told(run, name) == []
        assert run.vehicle(name).speed_mps == pytest.approx(12.0, abs=0.1)


def test_each_car_misses_its_own_frames_of_the_one_press() -> None:
    cars = {f"car_{number}": Car(10.0, x_m=30.0 * number) for number in range(12)}
    run = opened(
        [injection(203, STOP, transmitter="north")],
        cars,
        dict.fromkeys(cars, "north"),
        loss_share=0.7,
        link_timeout_s=20.0,
        latency_s=0.02,
    )
    run.run_until(6.0)
    begins = [modes(run, name)[0] for name in cars]
    assert {mode for _, mode in begins} == {"estop_disable"}
    assert len({time_s for time_s, _ in begins}) > 3
    frames_s = {round(time_s - 0.02, 2) for time_s, _ in begins}
    assert all(frame == 2.03 or round(frame * 20, 6) == round(frame * 20) for frame in frames_s)


def test_a_radio_that_falls_silent_is_lost_for_all_its_cars_and_a_press_meanwhile_is_heard_later() -> None:
    """XGV-42, XGV-68: link supervision pauses them; the press that nobody hears is told as masked."""
    rows = [
        injection(203, LINK, transmitter="north", end_tick=501),
        injection(221, STOP, transmitter="north"),
    ]
    run = opened(rows)
    run.run_until(7.0)
    for name in ("a", "b"):
        # The last frame was that of 2.00 s; 5.05 s is the first that is sent again.
        assert modes(run, name) == [(2.5, "estop_pause"), (5.05, "estop_disable")]
        assert [row[:3] for row in told(run, name, "safestop_link")] == [
            (2.5, "good", "none"),
            (5.05, "none", "good"),
        ]
        assert told(run, name, "stop_masked") == [
            (2.21, "", "SafeStop stop", ("radio frames lost",)),  # in the half second before the time-out too
            (5.05, "SafeStop stop", "", ("lasted 2.84 s",)),
        ]
    assert modes(run, "c") == modes(run, "own") == []


def test_a_press_that_a_bypassed_car_cannot_hear_is_masked_though_another_hand_pressed() -> None:
    """XGV-68: the car's own bypass lets it drive on without a link; the shared button is pressed for b."""
    rows = [
        injection(150, InjectionKind.BYPASS, "a"),
        injection(200, LINK, "a"),
        injection(403, STOP, "b"),
    ]
    run = opened(rows)
    run.run_until(6.0)
    assert modes(run, "a") == []
    assert modes(run, "b") == [(4.03, "estop_disable")]
    assert (4.03, "", "SafeStop stop", ("radio link lost",)) in told(run, "a", "stop_masked")


def test_what_is_pressed_for_one_car_is_pressed_for_all_that_share_its_radio() -> None:
    """There is one button: an injection into a car, or its operator, moves it for the others too."""
    run = opened([injection(203, PAUSE, "a", end_tick=403)])
    run.run_until(3.0)
    run.vehicle("b").estop("pause")
    run.run_until(4.5)
    assert run.vehicle("a").mode == run.vehicle("b").mode == "estop_pause"  # the other hand still holds it
    run.vehicle("b").estop("run")
    run.run_until(5.0)
    for name in ("a", "b"):
        assert modes(run, name) == [(2.03, "estop_pause"), (4.5, "drive_by_wire")]
    assert told(run, "b")[0] == (2.03, "", "estop_pause", ("transmitter north, used for a",))
    assert modes(run, "c") == []


def test_a_car_that_comes_later_meets_what_its_radio_asks_for_and_one_that_leaves_releases_nothing() -> None:
    cars = {"gone": Car(12.0, leaves_s=3.0), "late": Car(12.0, x_m=50.0, enters_s=4.0)}
    rows = [
        injection(203, PAUSE, transmitter="north", end_tick=603),
        injection(210, STOP, "gone", end_tick=703),
    ]
    run = opened(rows, cars, {"gone": "north", "late": "north"})
    run.run_until(8.0)
    assert modes(run, "gone") == [(2.03, "estop_pause"), (2.1, "estop_disable")]
    assert modes(run, "late", 4.0)[0] == (4.0, "estop_disable")
    assert modes(run, "late", 4.01)[:1] == [(7.03, "drive_by_wire")]
    assert told(run, "late")[0] == (4.0, "", "estop_pause", ("transmitter north",))


def test_a_press_before_any_car_is_there_is_told_and_met() -> None:
    cars = {"late": Car(12.0, enters_s=2.0)}
    run = opened([injection(50, STOP, transmitter="north")], cars, {"late": "north"})
    run.run_until(3.0)
    (row,) = told(run, "", "injection_without_vehicle")
    assert row[:3] == (0.5, "", "estop_disable")
    assert run.vehicle("late").mode == "estop_disable"


def test_two_injections_into_one_transmitter_end_with_the_last() -> None:
    rows = [
        injection(203, PAUSE, transmitter="north", end_tick=305),
        injection(250, PAUSE, transmitter="north", end_tick=407),
    ]
    run = opened(rows)
    run.run_until(5.0)
    assert modes(run, "a") == [(2.03, "estop_pause"), (4.07, "drive_by_wire")]


def test_transmitters_in_a_scenario_on_real_traffic(open_hello: Opener) -> None:
    """Keys ``bind.transmitter`` and ``injections.transmitter``, through libsumo."""
    run = open_hello(
        "bind=[{vehicles: xgv_0, transmitter: south}, {vehicles: [xgv_1, car_0], transmitter: north}]",
        "injections=[{at_s: 4.02, transmitter: north, kind: estop_disable}]",
        "safestop.latency_s=0.1",
    )
    run.run_until(9.0)
    for name in ("xgv_1", "car_0"):
        assert modes(run, name, 4.0) == [(4.12, "estop_disable")]
        assert run.vehicle(name).speed_mps == 0.0
    assert modes(run, "xgv_0", 4.0) == []
    assert run.vehicle("xgv_0").speed_mps > 8.0


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("{at_s: 1, transmitter: west, kind: estop_pause}", "known here: north"),
        ("{at_s: 1, transmitter: north, kind: door}", "a transmitter takes kind estop_pause"),
        ("{at_s: 1, transmitter: north, vehicles: xgv_0, kind: estop_pause}", "got both"),
        ("{at_s: 1, kind: estop_pause}", "got neither"),
    ],
)
def test_a_scenario_says_what_is_wrong_with_a_transmitter(open_hello: Opener, row: str, words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        open_hello("bind=[{vehicles: 'xgv_*', transmitter: north}]", f"injections=[{row}]")
