"""A world step with all vehicles bound, beside SUMO's own, for pytest-benchmark: see ``README.md``."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from time import thread_time
from typing import Any

import pytest

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.bench.drives import HAND_OVER_STEPS, BoundSetup, Setup, handed_over, opened, record_plain
from xgv_cosim.bench.measuring import Case, Cost, measure, usual_steps
from xgv_cosim.bench.traffic import NETWORKS, Traffic

SMALL = 5
LARGE = (1, 10, 100, 1000)
LARGEST = 5000


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Untimed, the largest fleet would show nothing that a thousand do not, and take half an hour."""
    if "number" in metafunc.fixturenames:
        is_timed = metafunc.config.getoption("benchmark_enable")
        slow = (*LARGE, LARGEST) if is_timed else LARGE
        sizes = [SMALL, *(pytest.param(number, marks=pytest.mark.slow) for number in slow)]
        metafunc.parametrize("number", sizes)


@pytest.fixture(params=NETWORKS)
def network(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def setup_of(network: str, number: int, folder: Path, benchmark: Any) -> Setup:
    traffic = Traffic(network, number)
    return Setup(traffic, traffic.write(folder), 1 if benchmark.disabled else usual_steps(number))


@pytest.mark.benchmark(timer=thread_time)
def test_plain_step(benchmark: Any, network: str, number: int, tmp_path: Path) -> None:
    benchmark.group = f"{network}, {number} vehicles"
    setup = setup_of(network, number, tmp_path, benchmark)
    with opened(setup) as session:
        benchmark.pedantic(session.engine.simulationStep, rounds=setup.steps)
        assert session.engine.vehicle.getIDCount() == number


@pytest.mark.benchmark(timer=thread_time)
@pytest.mark.parametrize("coupling", CouplingKind)
def test_bound_step(
    benchmark: Any, network: str, number: int, coupling: CouplingKind, tmp_path: Path
) -> None:
    benchmark.group = f"{network}, {number} vehicles"
    setup = setup_of(network, number, tmp_path, benchmark)
    with handed_over(setup, BoundSetup(coupling), record_plain(setup)) as fleet:
        steps = count(HAND_OVER_STEPS)
        benchmark.pedantic(
            fleet.advance, setup=lambda: ((fleet.targets(next(steps)),), {}), rounds=setup.steps
        )
        fleet.require_driving()
        assert len(fleet.sim.vehicle_ids) == number


@pytest.fixture(scope="module")
def a_thousand() -> Cost:
    return measure(Case(Traffic("busy_freeway", 1000), CouplingKind.AUTO, steps=30))


@pytest.mark.slow
def test_a_thousand_bound_vehicles_cost_a_small_multiple_of_sumo(a_thousand: Cost) -> None:
    """Far above what is reached (README.md): an alarm for what makes it many times dearer, not a measure."""
    free = measure(Case(Traffic("busy_freeway", 1000), CouplingKind.FREE, steps=30))
    assert free.ratio_to_floor < 4.0
    assert a_thousand.ratio_to_plain < 6.0
    assert max(free.floor_off_m, a_thousand.floor_off_m) < 1e-6


@pytest.mark.slow
def test_a_tenth_of_the_fleet_costs_a_fraction_of_the_whole() -> None:
    """Partly bound fleets cost in proportion to the bound share, with a wide margin.

    Differences of two costs of which each is half as large again now and then: the least of three counts.
    """
    part_us, num_bound = least_added_us(0.1)
    whole_us, _ = least_added_us(1.0)
    assert num_bound == 100
    assert part_us < 0.5 * whole_us


def least_added_us(share: float, repeats: int = 3) -> tuple[float, int]:
    """Return what a bound share adds to a step of SUMO's at least, and how many are bound."""
    case = Case(Traffic("busy_freeway", 1000), CouplingKind.AUTO, share, steps=30)
    costs = [measure(case) for _ in range(repeats)]
    return min(cost.bound_us for cost in costs) - min(cost.plain_us for cost in costs), costs[0].num_bound
