"""Pause and disable through the whole simulation: device, radio, modes, controllers, plant and world step.

The device's edge lies inside a world step. The way is counted from that edge, and compared with closed forms
and with the delays that are declared: the radio's latency (up to the next 10 ms tick) and the response of
the brakes (``speed_response_s`` of the preset).
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.xgv_cosim.kernel.test_stopping_proofs import (
    EDMUNDS_60_TO_0_M,
    LOAD_MPS2,
    MPH_MPS,
    full_brake_way_m,
)
from tests.xgv_cosim.simulation.bare_world import Car, injection, simulation
from tests.xgv_cosim.simulation.conftest import Opener
from xgv_cosim.injection import InjectionKind
from xgv_cosim.parameters import load_preset
from xgv_cosim.simulation import Simulation
from xgv_cosim.vehicles.xgv.safestop import SafeStopSettings
from xgv_cosim.vehicles.xgv.settings import XgvSettings

EDGE_TICK = 253
EDGE_S = 2.53
RESPONSE_S = load_preset("ford_escape_hybrid").speed_response_s


class Stop:
    """One car cruising at a speed, stopped by a device on tick 253, driven until it has stood a while."""

    def __init__(
        self, speed_mps: float, kind: InjectionKind, *, latency_s: float = 0.0, decel_mps2: float = 2.5,
        step_s: float = 0.1, steady: bool = True, **parameters: float,
    ) -> None:  # fmt: skip
        settings = XgvSettings(pause_decel_mps2=decel_mps2, safestop=SafeStopSettings(latency_s=latency_s))
        rows = [injection(EDGE_TICK, kind, "xgv")]
        self.run: Simulation = simulation(
            {"xgv": Car(speed_mps)}, rows, settings, step_s=step_s, **parameters
        )
        car = self.run.vehicle("xgv")
        self.run.run_until(math.floor(EDGE_S / step_s + 1e-6) * step_s)
        self.edge_speed_mps = car.speed_mps
        if steady:
            assert self.edge_speed_mps == pytest.approx(speed_mps, abs=0.12)
        edge_m = car.pose.x_m + car.speed_mps * (EDGE_S - self.run.now_s)
        self.times_s, self.speeds_mps, self.accels_mps2 = [], [], []
        stands_s = 0.0
        while stands_s < 1.0 and self.run.now_s < 60.0:
            self.run.step()
            self.times_s.append(self.run.now_s)
            self.speeds_mps.append(car.speed_mps)
            self.accels_mps2.append(car.accel_mps2)
            stands_s = stands_s + step_s if car.speed_mps == 0.0 else 0.0
        self.way_m = car.pose.x_m - edge_m
        self.mode = car.mode
        self.brake = float(self.run.fleet.motion.brake[self.run.fleet.slot_of("xgv")])

    def told(self, kind: str) -> list[tuple[float, str, str, tuple[str, ...]]]:
        events = self.run.state.journal.events
        return [
            (event.t_s, event.before, event.after, event.reasons) for event in events if event.kind == kind
        ]

    def modes(self) -> list[tuple[float, str]]:
        return [
            (event.t_s, event.after)
            for event in self.run.state.journal.events
            if event.kind == "safety_mode" and event.t_s > 1.0
        ]

    def decels_mps2(self, since_s: float) -> np.ndarray:
        """Return the deceleration from 0.3 s after the brake's onset down to 0.5 m/s."""
        times, speeds = np.array(self.times_s), np.array(self.speeds_mps)
        return -np.array(self.accels_mps2)[(times > since_s + 0.3) & (speeds > 0.5)]


def on_tick_s(latency_s: float) -> float:
    return math.ceil(latency_s * 100 - 1e-6) / 100


@pytest.mark.parametrize("kind", [InjectionKind.ESTOP_PAUSE, InjectionKind.DOOR])
@pytest.mark.parametrize(
    ("speed_mps", "decel_mps2"), [(5.0, 1.5), (5.0, 4.0), (13.9, 2.5), (13.9, 6.0), (33.0, 2.5), (33.0, 6.0)]
)
def test_both_pauses_brake_as_set_from_the_edge_of_their_device_xgv_12_xgv_27_xgv_28_xgv_36_xgv_71(
    speed_mps: float, decel_mps2: float, kind: InjectionKind
) -> None:
    """Within 5 % of the set value; way from the edge within 1 % + 0.1 m of v²/2a + v t_d."""
    stop = Stop(speed_mps, kind, decel_mps2=decel_mps2)
    mode = "estop_pause" if kind is InjectionKind.ESTOP_PAUSE else "software_pause"
    assert stop.modes() == [(EDGE_S, mode)]
    speed = stop.edge_speed_mps
    decels = stop.decels_mps2(EDGE_S)
    assert len(decels) >= min(speed / decel_mps2 - 0.6, 1.0) * 9
    np.testing.assert_allclose(decels, decel_mps2, rtol=0.05)
    expected = speed**2 / (2.0 * decel_mps2) + speed * RESPONSE_S
    assert abs(stop.way_m - expected) <= 0.01 * expected + 0.1
    assert stop.brake == pytest.approx(0.5, abs=1e-3)  # XGV-33


@pytest.mark.parametrize(
    ("kind", "mode", "latency_s"),
    [(InjectionKind.ESTOP_PAUSE, "estop_pause", 0.05), (InjectionKind.DOOR, "software_pause", 0.0)],
)
def test_both_pauses_brake_as_set_on_every_control_tick_xgv_12_xgv_27_xgv_28_xgv_36(
    kind: InjectionKind, mode: str, latency_s: float
) -> None:
    """Nothing hides between the samples: 10 ms apart, each within 5 %, reported and from the speeds alike."""
    stop = Stop(13.9, kind, latency_s=latency_s, decel_mps2=3.0, step_s=0.01)
    onset_s = EDGE_S + latency_s
    assert stop.modes() == [(pytest.approx(onset_s), mode)]
    decels = stop.decels_mps2(onset_s)
    assert len(decels) == pytest.approx((stop.edge_speed_mps - 0.5) / 3.0 * 100 - 30, abs=15)
    np.testing.assert_allclose(decels, 3.0, rtol=0.05)
    times, speeds = np.array(stop.times_s), np.array(stop.speeds_mps)
    slowed = -np.diff(speeds) / 0.01
    np.testing.assert_allclose(slowed[(times[1:] > onset_s + 0.3) & (speeds[1:] > 0.5)], 3.0, rtol=0.05)
    expected = stop.edge_speed_mps**2 / 6.0 + stop.edge_speed_mps * (latency_s + RESPONSE_S)
    assert abs(stop.way_m - expected) <= 0.01 * expected + 0.1


@pytest.mark.parametrize(
    ("speed_mps", "decel_mps2", "latency_s", "step_s"),
    [
        (13.9, 2.5, 0.033, 0.1),
        (13.9, 2.5, 0.12, 0.03),
        (13.9, 2.5, 0.5, 0.1),
        (30.0, 4.0, 0.033, 0.1),
        (30.0, 4.0, 0.12, 0.1),
        (30.0, 6.0, 0.5, 0.03),
        (8.0, 4.0, 0.25, 0.01),
    ],
)
def test_the_radios_latency_lengthens_the_way_by_just_that_xgv_36_xgv_42_xgv_71(
    speed_mps: float, decel_mps2: float, latency_s: float, step_s: float
) -> None:
    """Whatever the world step: the mode changes on the tick on which the frame has arrived."""
    stop = Stop(
        speed_mps, InjectionKind.ESTOP_PAUSE, latency_s=latency_s, decel_mps2=decel_mps2, step_s=step_s
    )
    onset_s = EDGE_S + on_tick_s(latency_s)
    assert stop.modes() == [(pytest.approx(onset_s), "estop_pause")]
    speed = stop.edge_speed_mps
    np.testing.assert_allclose(stop.decels_mps2(onset_s), decel_mps2, rtol=0.05)
    expected = speed**2 / (2.0 * decel_mps2) + speed * (on_tick_s(latency_s) + RESPONSE_S)
    assert abs(stop.way_m - expected) <= 0.01 * expected + 0.1


@pytest.mark.parametrize(
    "road", [{"grade": 0.06}, {"grade": -0.06}, {"grade": -0.12}, {"friction": 0.35}, {"mass_kg": 2300.0}]
)
def test_a_pause_brakes_as_set_on_a_slope_on_ice_and_with_load_xgv_36(road: dict[str, float]) -> None:
    """As long as the tyres allow the set deceleration, the road does not show in it."""
    stop = Stop(18.0, InjectionKind.ESTOP_PAUSE, latency_s=0.08, **road)
    speed = stop.edge_speed_mps
    np.testing.assert_allclose(stop.decels_mps2(EDGE_S + 0.08), 2.5, rtol=0.05)
    expected = speed**2 / 5.0 + speed * (0.08 + RESPONSE_S)
    assert abs(stop.way_m - expected) <= 0.01 * expected + 0.1


@pytest.mark.parametrize(
    ("road", "decel_mps2", "reached_mps2", "limit"),
    [
        ({"friction": 0.3}, 4.0, 0.3 * 9.81 + 0.01 * 9.81, "the grip allows 3.04 m/s²"),
        (
            {"friction": 0.3, "grade": -0.1},
            2.5,
            (0.31 - 0.1) * 9.81 / math.hypot(1.0, 0.1),
            "grip allows 2.05",
        ),
        ({"max_brake_decel_mps2": 5.0}, 6.0, 5.0 + 0.01 * 9.81, "the brake allows 5.10 m/s²"),
    ],
)
def test_a_pause_that_the_road_does_not_allow_brakes_with_what_there_is_and_says_so_xgv_36(
    road: dict[str, float], decel_mps2: float, reached_mps2: float, limit: str
) -> None:
    """The user sees an event with what limits it and its duration; the way is that of what there is."""
    stop = Stop(18.0, InjectionKind.ESTOP_PAUSE, latency_s=0.08, decel_mps2=decel_mps2, **road)
    onset_s, speed = EDGE_S + 0.08, stop.edge_speed_mps
    decels = stop.decels_mps2(onset_s)
    rolling = np.array(stop.speeds_mps)[: np.argmax(np.array(stop.speeds_mps) < 2.0)]  # no creep yet
    assert decels[: len(rolling) - 4].min() >= 0.97 * reached_mps2
    assert decels.max() <= reached_mps2 + LOAD_MPS2[0] * speed**2 + 0.02  # what drag adds
    assert stop.way_m == pytest.approx(speed**2 / 2.0 / decels.mean() + speed * 0.14, rel=0.03)
    begin, end = stop.told("pause_weaker_than_set")
    assert begin[:3] == (pytest.approx(onset_s), "", "estop_pause")
    assert begin[3][0].startswith(f"set to {decel_mps2:.2f} m/s², but on this road the ")
    assert limit in begin[3][0]
    assert end[:3] == (pytest.approx(onset_s + speed / decels.mean(), abs=0.3), "estop_pause", "")


def test_a_pause_on_a_slope_too_slippery_to_stop_says_so_xgv_36() -> None:
    stop = Stop(10.0, InjectionKind.ESTOP_PAUSE, friction=0.1, grade=-0.15, steady=False)
    (begin,) = stop.told("pause_weaker_than_set")
    assert begin[3] == ("set to 2.50 m/s², but on this slope the grip does not stop it at all",)
    assert stop.speeds_mps[-1] > 10.0


@pytest.mark.parametrize("road", [{}, {"friction": 0.3}, {"grade": -0.12}])
def test_a_pause_that_brakes_as_set_tells_of_no_weakness_xgv_36(road: dict[str, float]) -> None:
    assert Stop(10.0, InjectionKind.DOOR, **road).told("pause_weaker_than_set") == []


@pytest.mark.parametrize(
    ("kind", "latency_s"), [(InjectionKind.ESTOP_DISABLE, 0.12), (InjectionKind.ESTOP_BUTTON, 0.2)]
)
@pytest.mark.parametrize(
    ("speed_mps", "road"),
    [
        (8.0, {}),
        (26.8, {}),
        (33.0, {"friction": 0.4}),
        (20.0, {"grade": -0.1}),
        (20.0, {"grade": 0.1, "friction": 0.5}),
    ],
)
def test_disable_end_to_end_takes_the_way_of_the_full_brake_xgv_31_xgv_71(
    speed_mps: float, road: dict[str, float], latency_s: float, kind: InjectionKind
) -> None:
    """Within 2 % + 0.1 m of the forces integrated independently; the wired button has no radio's latency."""
    stop = Stop(speed_mps, kind, latency_s=latency_s, **road)
    delay_s = latency_s if kind is InjectionKind.ESTOP_DISABLE else 0.0
    assert stop.modes() == [(pytest.approx(EDGE_S + delay_s), "estop_disable")]
    expected = full_brake_way_m(stop.edge_speed_mps, **road, cruising=True) + stop.edge_speed_mps * delay_s
    assert stop.way_m == pytest.approx(expected, rel=0.02, abs=0.1)
    assert stop.brake == pytest.approx(1.0, abs=1e-3)


def test_disable_from_60_mph_is_within_ten_percent_of_the_track_test_end_to_end_xgv_31() -> None:
    stop = Stop(60 * MPH_MPS, InjectionKind.ESTOP_BUTTON)
    assert stop.way_m == pytest.approx(EDMUNDS_60_TO_0_M, rel=0.10)


@pytest.mark.parametrize("at_s", [5.53, 5.5, 5.59])
def test_a_pause_in_sumo_traffic_takes_the_way_of_the_closed_form_xgv_36_xgv_42_xgv_71(
    open_hello: Opener, at_s: float
) -> None:
    """The same through libsumo, the reference stack and scenario keys."""
    run = open_hello(
        f"injections=[{{at_s: {at_s}, vehicles: xgv_0, kind: estop_pause}}]",
        "safestop.latency_s=0.15",
        "xgv.pause.decel_mps2=3.0",
    )
    run.run_until(5.5)
    car = run.vehicle("xgv_0")
    speed, pose, accel = car.speed_mps, car.pose, car.accel_mps2
    lead_s = at_s - 5.5
    edge_speed = speed + accel * lead_s
    run.run_until(12.0)
    assert car.speed_mps == 0.0
    way = math.hypot(car.pose.x_m - pose.x_m, car.pose.y_m - pose.y_m) - (speed + edge_speed) / 2 * lead_s
    expected = edge_speed**2 / 6.0 + edge_speed * (0.15 + RESPONSE_S)
    assert abs(way - expected) <= 0.01 * expected + 0.1
