"""``bind[].plant.imperfections``: what sensors, radio and linkage lack; off by default, drawn by id."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.xgv_cosim.kernel.fleets import Drive
from tests.xgv_cosim.simulation.bare_world import Car, simulation
from tests.xgv_cosim.simulation.conftest import Opener
from tests.xgv_cosim.simulation.test_client_timelines import TO_MOTION, Client
from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.commands import CommandKind, MotionProfile
from xgv_cosim.errors import ScenarioError
from xgv_cosim.parameters import VehicleParameters, load_preset, parameter_columns
from xgv_cosim.plant import imperfections
from xgv_cosim.scenario.building import parameters_of
from xgv_cosim.scenario.loading import load_scenario
from xgv_cosim.simulation import views

KEYS = {
    "speed_quantum_mps": 0.05,
    "speed_noise_mps": 0.1,
    "command_latency_s": 0.02,
    "command_jitter_s": 0.03,
    "steer_backlash_rad": 0.01,
}


def reported(names: tuple[str, ...], seed: int = 1, **parameters: float) -> dict[str, list[float]]:
    """Return the speeds that cars at a steady 12 m/s report, step by step."""
    cars = {name: Car(12.0, y_m=20.0 * n) for n, name in enumerate(names)}
    told: dict[str, list[float]] = {name: [] for name in names}
    with simulation(cars, [], seed=seed, **parameters) as run:
        while run.now_s < 3.0 - 1e-9:
            run.step()
            speeds = views.measured_motion(run.state).speed_mps
            for name in names:
                told[name].append(float(speeds[run.fleet.slot_of(name)]))
    return told


def test_each_key_reaches_its_column_and_is_off_without_it() -> None:
    words = [f"bind.0.plant.imperfections.{name}={value}" for name, value in KEYS.items()]
    scenario = load_scenario("hello", words)
    parameters = parameters_of(scenario.bind[0], scenario.world.environment)
    assert {name: getattr(parameters, name) for name in KEYS} == KEYS
    assert {name: getattr(load_preset("ford_escape_hybrid"), name) for name in KEYS} == dict.fromkeys(
        KEYS, 0.0
    )


@pytest.mark.parametrize(
    "words",
    [
        ("speed_noise_mps=-0.1",),
        ("steer_backlash_rad=0.2",),
        ("command_latency_s=0.051",),
        ("command_latency_s=0.03", "command_jitter_s=0.03"),
    ],
)
def test_imperfections_beyond_reason_are_refused(words: tuple[str, ...]) -> None:
    with pytest.raises(ScenarioError, match=words[0].split("=", maxsplit=1)[0]):
        load_scenario("hello", [f"bind.0.plant.imperfections.{word}" for word in words])


def test_noise_is_a_vehicles_own_whoever_else_is_bound() -> None:
    """It follows from id, seed and tick: another slot and more neighbours change nothing."""
    alone = reported(("b",), speed_noise_mps=0.1)["b"]
    among = reported(("a", "b", "c"), speed_noise_mps=0.1)
    assert among["b"] == alone
    assert among["a"] != among["b"] != among["c"]
    assert reported(("b",), seed=2, speed_noise_mps=0.1)["b"] != alone
    true = reported(("b",))["b"]
    errors = np.array(alone) - np.array(true)
    assert 0.05 < errors.std() < 0.2
    assert abs(errors.mean()) < 0.06


def test_speed_is_reported_in_its_quanta_and_standstill_is_exact() -> None:
    keys = np.array([imperfections.draw_key(f"xgv_{n}", 1) for n in range(4000)], np.uint64)
    columns = parameter_columns(VehicleParameters(speed_noise_mps=0.2, speed_quantum_mps=0.25), 4000)
    speeds = np.full(4000, 10.1)
    told = imperfections.measured_speed_mps(speeds, columns, keys, 17)
    np.testing.assert_allclose(told / 0.25, np.rint(told / 0.25), atol=1e-9)
    assert told.mean() == pytest.approx(10.1, abs=0.02)
    assert told.std() == pytest.approx(math.hypot(0.2, 0.25 / math.sqrt(12.0)), rel=0.05)
    assert (imperfections.measured_speed_mps(0.0 * speeds, columns, keys, 17) == 0.0).all()
    off = parameter_columns(VehicleParameters(), 4000)
    assert imperfections.measured_speed_mps(speeds, off, keys, 17) is speeds


def test_draws_are_spread_evenly_and_the_same_on_every_machine() -> None:
    keys = np.array([imperfections.draw_key("xgv_0", 1)], np.uint64)
    draws = np.array([imperfections.uniform(keys, n)[0] for n in range(4000)])
    assert 0.0 <= draws.min() < draws.max() < 1.0
    assert np.histogram(draws, 10, (0.0, 1.0))[0].min() > 320
    assert abs(np.corrcoef(draws[:-1], draws[1:])[0, 1]) < 0.05
    # SplitMix64 of key 0, as its authors print it: the first output is 0xE220A8397B1DCDAF.
    assert imperfections.uniform(np.zeros(1, np.uint64), 0)[0] == (0xE220A8397B1DCDAF >> 11) / 2.0**53


def test_the_stack_sees_the_measured_speed_and_the_plant_goes_on_as_it_did(open_hello: Opener) -> None:
    seen = []
    for words in ((), ("bind.0.plant.imperfections.speed_quantum_mps=0.5",)):
        run = open_hello("bind.0.stack=none", *words)
        run.run_until(2.0)
        slot = run.fleet.slot_of("xgv_0")
        seen.append((run.fleet.motion.speed_mps[slot], views.measured_motion(run.state).speed_mps[slot]))
        run.close()
    (true, same), (also_true, coarse) = seen
    assert true == same == also_true
    assert coarse == pytest.approx(round(true / 0.5) * 0.5)
    assert coarse != true


@pytest.mark.parametrize(("latency_s", "acts_s"), [(0.0, 0.0), (0.03, 0.03), (0.021, 0.03)])
def test_a_command_acts_when_its_latency_is_over_on_its_tick_xgv_71(
    open_hello: Opener, latency_s: float, acts_s: float
) -> None:
    client = Client(
        open_hello("bind.0.stack=none", f"bind.0.plant.imperfections.command_latency_s={latency_s}")
    )
    client.say(*TO_MOTION, MotionProfile(8.0, 1.0, 0.0, 0.1, 5.0))
    assert client.simulation.fleet.command.kind[client.slot] == CommandKind.MOTION_PROFILE
    (handed,) = client.events("handover")
    sent_s = client.simulation.now_s - 0.1
    assert handed[0] == pytest.approx(sent_s + acts_s)


def test_drawn_latencies_let_no_message_overtake_another(open_hello: Opener) -> None:
    run = open_hello("bind.0.stack=none", "bind.0.plant.imperfections.command_jitter_s=0.05")
    client = Client(run)
    client.say(*TO_MOTION, *(MotionProfile(float(speed), 1.0, 0.0, 0.1, 5.0) for speed in range(1, 9)))
    assert run.fleet.command.speed_mps[client.slot] == 8.0
    assert not run.state.vehicles["xgv_0"].on_the_way
    key, ticks = int(run.fleet.draw_key[client.slot]), set()
    for counter in range(200):
        delay_s = imperfections.delay_s(0.01, 0.04, key, counter)
        assert 0.01 <= delay_s < 0.05
        ticks.add(int(delay_s / 0.01))
    assert ticks == {1, 2, 3, 4}


def test_the_wheel_does_not_follow_within_its_play() -> None:
    """From one side it stops half the play short; back within the play it stays; beyond it goes on."""
    drive = Drive.at(10.0, steer_backlash_rad=0.02)

    def turned_to(angle_rad: float) -> float:
        given = {"longitudinal": Longitudinal.HOLD, "brake": 0.0, "lateral": Lateral.OPEN_LOOP}
        return float(drive.for_s(2.0, ticks=10, steer_rad=angle_rad, **given).motion.steer_rad[0])

    assert turned_to(0.1) == pytest.approx(0.09)
    assert turned_to(0.081) == pytest.approx(0.09)
    assert turned_to(0.05) == pytest.approx(0.06)
    assert turned_to(0.069) == pytest.approx(0.06)
    assert turned_to(-0.05) == pytest.approx(-0.04)


def test_a_curvature_is_missed_by_what_the_play_takes() -> None:
    missed = []
    for backlash_rad in (0.0, 0.02):
        drive = Drive.at(10.0, steer_backlash_rad=backlash_rad)
        drive.for_s(4.0, ticks=10, target_speed_mps=10.0, target_curvature_per_m=0.02)
        missed.append(0.02 - drive.motion.curvature_per_m[0])
    assert missed[0] == pytest.approx(0.0, abs=1e-4)
    assert missed[1] == pytest.approx(0.01 / (2.619 + 0.25), rel=0.05)
