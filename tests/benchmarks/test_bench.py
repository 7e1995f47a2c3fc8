"""The benchmark measures what it says: real drives, the same places on the floor, whole rows in its table."""

from __future__ import annotations

import json
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.autonomy.reference import ReferenceStack
from xgv_cosim.bench import table
from xgv_cosim.bench.calls import LEFT_OUT, CallLog, TappedEngine
from xgv_cosim.bench.cases import Chosen, cases_of
from xgv_cosim.bench.drives import (
    HAND_OVER_STEPS,
    BoundSetup,
    Setup,
    drive_bound,
    handed_over,
    record_plain,
)
from xgv_cosim.bench.driving import CarMotion, Pursuit, Recording
from xgv_cosim.bench.extras import STACK_EXTRAS, Client, Extra, SilentStack
from xgv_cosim.bench.measuring import Case, Cost, measure
from xgv_cosim.bench.traffic import NETWORKS, Traffic
from xgv_cosim.errors import ScenarioError
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.metrics import Watch
from xgv_cosim.recording import Recorder

STEPS = 12


@cache
def cost_of(network: str, coupling: CouplingKind, share: float = 1.0, extra: Extra | None = None) -> Cost:
    extras = frozenset({extra} if extra else ())
    return measure(Case(Traffic(network, 8), coupling, share, extras, steps=STEPS), repeats=1)


@pytest.mark.parametrize("network", NETWORKS)
def test_the_floor_ends_where_the_bound_drive_ends(network: str) -> None:
    """The same poses through the same SUMO calls, with no model (issue 4.1)."""
    cost = cost_of(network, CouplingKind.AUTO)
    assert cost.floor_off_m < 1e-9
    assert cost.num_bound == 8
    assert min(cost.plain_us, cost.floor_us, cost.bound_us, cost.emulator_us) > 0.0


def test_the_free_floor_sets_speed_and_pose_of_every_car_once_a_step() -> None:
    cost = cost_of("busy_freeway", CouplingKind.FREE)
    assert cost.floor_off_m < 1e-9
    assert cost.in_lane_frame == 0.0
    assert cost.calls["setSpeed"] == pytest.approx(1.0, abs=0.15)
    assert cost.calls["moveToXY"] == pytest.approx(1.0, abs=0.15)


def test_the_lane_floor_sets_speeds_and_lateral_positions_that_have_changed() -> None:
    cost = cost_of("busy_freeway", CouplingKind.LANE)
    assert cost.floor_off_m < 1e-9
    assert cost.in_lane_frame > 0.9
    assert cost.calls["setSpeed"] == pytest.approx(1.0, abs=0.1)
    assert cost.calls.get("setLateralLanePosition", 0.0) < 0.2  # they drive straight on


def test_a_part_of_the_fleet_is_bound() -> None:
    assert cost_of("light_freeway", CouplingKind.AUTO, share=0.25).num_bound == 2


@pytest.mark.parametrize("extra", Extra)
def test_each_extra_is_really_on(extra: Extra, tmp_path: Path) -> None:
    setup = Setup(traffic := Traffic("light_freeway", 3), traffic.write(tmp_path), 2)
    how = BoundSetup(CouplingKind.AUTO, extras=frozenset({extra}))
    with handed_over(setup, how, record_plain(setup)) as fleet:
        for step in (HAND_OVER_STEPS, HAND_OVER_STEPS + 1):
            fleet.advance(fleet.targets(step))
        links = [vehicle.link for vehicle in fleet.sim.state.vehicles]
        stacks = {type(link._stack) if isinstance(link, InProcessLink) else None for link in links}
        observers = fleet.sim.state.journal._observers
        assert len(links) == 3
        match extra:
            case Extra.RECORDING:
                (recorder,) = observers
                assert isinstance(recorder, Recorder)
                assert recorder.num_steps == HAND_OVER_STEPS + 2
            case Extra.METRICS:
                (watch,) = observers
                assert isinstance(watch, Watch)
                assert watch.num_bound_max == 3
            case _:
                wanted = {Extra.LINKS: Client, Extra.OBSERVATIONS: SilentStack, Extra.STACKS: ReferenceStack}
                assert stacks == {wanted[extra]}
                assert observers == ()
    if extra not in STACK_EXTRAS:
        assert stacks == {None}


def test_clients_send_the_targets_of_the_step_before(tmp_path: Path) -> None:
    setup = Setup(traffic := Traffic("light_freeway", 2), traffic.write(tmp_path), 2)
    how = BoundSetup(CouplingKind.AUTO, extras=frozenset({Extra.LINKS}))
    with handed_over(setup, how, record_plain(setup)) as fleet:
        wanted = fleet.targets(HAND_OVER_STEPS)
        fleet.advance(wanted)
        fleet.advance(fleet.targets(HAND_OVER_STEPS + 1))
        assert fleet.sim.fleet.command.speed_mps[fleet.slots] == pytest.approx(wanted.speed_mps)


def test_steady_targets_stay(tmp_path: Path) -> None:
    setup = Setup(traffic := Traffic("light_freeway", 2), traffic.write(tmp_path), 2)
    with handed_over(setup, BoundSetup(CouplingKind.AUTO, steady=True), record_plain(setup)) as fleet:
        before = fleet.sim.fleet.command.speed_mps[fleet.slots].copy()
        fleet.advance(fleet.targets(HAND_OVER_STEPS)._replace(speed_mps=before + 1.0))
        assert fleet.sim.fleet.command.speed_mps[fleet.slots] == pytest.approx(before)


def test_the_price_of_an_extra_is_its_difference_to_the_bare_drive() -> None:
    cost = cost_of("light_freeway", CouplingKind.AUTO, 0.5, Extra.METRICS)
    assert cost.extras_us is not None
    assert cost.extras_us < cost.bound_us / cost.num_bound
    assert table.cells(cost)[table.COLUMNS.index("with")] == "metrics"


def test_free_cars_keep_to_the_ways_of_the_drivers_of_the_grid(tmp_path: Path) -> None:
    """Through turns and stops at signals; who was bound in a turn has had four seconds to find back."""
    setup = Setup(traffic := Traffic("grid", 25), traffic.write(tmp_path), 80)
    drive = drive_bound(setup, BoundSetup(CouplingKind.FREE), record_plain(setup), CallLog())
    assert drive.beside_m < 0.5


def test_pursuit_finds_back_to_its_way() -> None:
    """A plain bicycle 1 m beside a straight way, with the bounds of a car's steering."""
    steps = np.arange(120.0)
    way = [1.0 * steps, 0.0 * steps, 0.0 * steps, 0.0 * steps + 10.0]
    pursuit = Pursuit(Recording(("car",), *(column[:, None] for column in way)), np.array([3.5]))
    x_m, y_m, heading_rad, curvature_per_m = -3.5, 1.0, 0.0, 0.0
    beside = []
    for step in range(100):
        state = (x_m, y_m, heading_rad, 10.0, curvature_per_m)
        wanted = pursuit.targets(step, CarMotion(*(np.array([value]) for value in state)))
        for _ in range(10):
            change = float(wanted.curvature_per_m[0]) - curvature_per_m
            curvature_per_m += float(np.clip(change, -0.0015, 0.0015))
            heading_rad += 0.1 * curvature_per_m
            x_m, y_m = x_m + 0.1 * np.cos(heading_rad), y_m + 0.1 * np.sin(heading_rad)
        beside.append(float(pursuit.beside_m[0]))
    assert beside[0] == pytest.approx(1.0)
    assert min(beside) > -0.3
    assert max(map(abs, beside[60:])) < 0.05


def test_the_log_keeps_commands_and_no_questions() -> None:
    class Vehicle:
        def __init__(self) -> None:
            self.done: list[tuple[object, ...]] = []

        def getSpeed(self, name: str) -> float:  # noqa: N802 - SUMO's name
            return 5.0

        def setSpeed(self, name: str, speed: float) -> None:  # noqa: N802 - SUMO's name
            self.done.append((name, speed))

        def setActionStepLength(self, name: str, length: float, reset: bool = True) -> None:  # noqa: N802
            self.done.append((name, length, reset))

    class Engine:
        vehicle = Vehicle()

    log = CallLog()
    tapped = TappedEngine(Engine, log).vehicle
    assert tapped.getSpeed("a") == 5.0
    tapped.setActionStepLength("a", 1.0, reset=False)
    tapped.setSpeed("a", 1.0)
    log.end_step()
    tapped.setSpeed("ghost", 2.0)
    tapped.setSpeed("a", 3.0)
    assert Engine.vehicle.done == [("a", 1.0, False), ("a", 1.0), ("ghost", 2.0), ("a", 3.0)]
    assert log.counts(0) == {"setActionStepLength": 1, "setSpeed": 3}
    assert "setActionStepLength" in LEFT_OUT
    Engine.vehicle.done.clear()
    for calls in log.replay({"a"}, hand_over_steps=1):
        for function, given in calls:
            function(*given)
    assert Engine.vehicle.done == [("a", 1.0), ("a", 3.0)]


def test_rows_have_the_fields_of_the_table() -> None:
    costs = [
        cost_of("grid", CouplingKind.AUTO),
        cost_of("light_freeway", CouplingKind.AUTO, 0.5, Extra.METRICS),
    ]
    found = json.loads(json.dumps(table.document(costs, 1)))
    assert {"libsumo", "numba", "numpy", "python", "ruckig", "xgv-cosim"} == set(found["versions"])
    first, second = found["cases"]
    assert (first["network"], first["coupling"], first["vehicles"]) == ("grid", "auto", 8)
    assert first["ratio_to_plain"] == pytest.approx(costs[0].bound_us / costs[0].plain_us, abs=1e-3)
    assert first["ratio_to_floor"] == pytest.approx(costs[0].bound_us / costs[0].floor_us, abs=1e-3)
    assert 0.0 < first["emulator_us"] * first["bound"] < first["bound_us_per_step"]
    assert (first["with"], first["extras_us"]) == ([], None)
    assert (second["with"], second["bound"]) == (["metrics"], 4)


def test_markdown_has_a_line_for_each_case() -> None:
    lines = table.markdown([cost_of("grid", CouplingKind.AUTO)], 1).splitlines()
    assert "libsumo" in lines[0]
    assert [line.count("|") for line in lines[2:]] == [len(table.COLUMNS) + 1] * 3
    assert lines[4].startswith("| grid | auto | 8 | 8 | - |")


def test_by_default_all_networks_are_measured_quickly() -> None:
    cases = cases_of(Chosen())
    assert {case.traffic.network for case in cases} == set(NETWORKS)
    assert {case.traffic.num_vehicles for case in cases} == {1, 100, 1000}
    assert {case.coupling for case in cases} == {CouplingKind.AUTO}


def test_the_whole_table_has_every_size_coupling_extra_and_share() -> None:
    cases = cases_of(Chosen(), everything=True)
    bare = [case for case in cases if case.share == 1.0 and not (case.extras or case.steady)]
    assert {(c.traffic.network, c.coupling, c.traffic.num_vehicles) for c in bare} == {
        (network, coupling, number)
        for network in NETWORKS
        for coupling in CouplingKind
        for number in (1, 10, 100, 1000, 5000)
    }
    assert {extra for case in cases for extra in case.extras} == set(Extra)
    assert {case.share for case in cases} == {1.0, 0.5, 0.1}
    assert any(case.steady for case in cases)
    assert all(len(case.extras & STACK_EXTRAS) <= 1 for case in cases)


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        (Chosen(networks=["town"]), "network: got 'town', expected light_freeway, busy_freeway, grid"),
        (Chosen(couplings=["tight"]), "coupling: got 'tight', expected free, lane, auto"),
        (Chosen(vehicles=["1,many"]), "vehicles: got 'many', expected a number"),
        (Chosen(vehicles=["0"]), "vehicles: got 0, expected 1 or more"),
        (Chosen(shares=["1.5"]), "share: got 1.5, expected more than 0 and at most 1"),
        (Chosen(extras=["magic"]), "with: got 'magic', expected observations, links"),
        (Chosen(extras=["links,stacks"]), "with: got links, stacks together, expected one of them"),
        (Chosen(steps=100_000), "steps: got 100000, expected 1 to 500"),
    ],
)
def test_wrong_choices_are_told(chosen: Chosen, words: str) -> None:
    with pytest.raises(ScenarioError) as raised:
        cases_of(chosen)
    assert words in str(raised.value)


def test_more_vehicles_than_find_room_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="no room for 100000 vehicles"):
        Traffic("light_freeway", 100_000).write(tmp_path)


@pytest.mark.parametrize("number", [10, 300])
def test_no_car_of_the_grid_has_to_change_lanes(number: int) -> None:
    """From the lane it is in, each crossing is passed straight on or to that lane's side."""
    for row in Traffic("grid", number)._on_grid():
        lane = int(row.split('departLane="')[1][0])
        edges = row.split('edges="')[1].split('"')[0].split()[:9]
        ways = [_way(edge) for edge in edges]
        for (dx, dy), after in pairwise(ways):
            assert after != (-dx, -dy)
            assert after != ((-dy, dx) if lane == 0 else (dy, -dx))


def test_the_recorded_ways_reach_beyond_the_last_step(tmp_path: Path) -> None:
    setup = Setup(traffic := Traffic("light_freeway", 2), traffic.write(tmp_path), 5)
    recording = record_plain(setup)
    assert recording.ids == ("v0", "v1")
    assert len(recording.speed_mps) > HAND_OVER_STEPS + 5
    assert np.isfinite(np.array(recording[1:])).all()


def _way(edge: str) -> tuple[int, int]:
    begin, end = edge[:2], edge[2:]
    return ord(end[0]) - ord(begin[0]), int(end[1:]) - int(begin[1:])
