"""The reference stacks at a crossing with signals and one with priority, in SUMO, by hand-made numbers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim import Simulation, simulate
from xgv_cosim.surroundings import Surroundings

ARMS = (
    '<node id="W" x="-200" y="0"/><node id="E" x="200" y="0"/>'
    '<node id="S" x="0" y="-200"/><node id="N" x="0" y="200"/>'
)
EDGES = "".join(
    f'<edge id="{a}{b}" from="{a}" to="{b}" numLanes="1" speed="13.89" priority="{priority}"/>'
    for a, b, priority in (("W", "C", 3), ("C", "E", 3), ("S", "C", 1), ("C", "N", 1))
)
STACKS = pytest.mark.parametrize("stack", ["reference", "reference_wrench"])


@contextmanager
def crossing(folder: Path, kind: str, vehicles: str, stack: str) -> Iterator[Simulation]:
    """Open a crossing of a street from west to east with one from south to north; ``xgv*`` are bound."""
    net = plain_network(folder, f'{ARMS}<node id="C" x="0" y="0" type="{kind}"/>', EDGES)
    config = write_config(folder, vehicles, net)
    settings = [f"bind.0.stack={stack}", "duration_s=120"]
    with simulate(config, bind=["xgv*"], set=settings) as run:
        yield run


def around(run: Simulation) -> Surroundings:
    return run.world.surroundings(["xgv"])


def position_m(run: Simulation, name: str) -> tuple[str, float]:
    row = run.snapshot.index_of[name]
    return run.world.road.lane_ids[run.snapshot.lane[row]], float(run.snapshot.lane_position_m[row])


@STACKS
def test_at_red_it_stops_before_the_line_and_goes_at_green(tmp_path: Path, stack: str) -> None:
    """The front bumper stands 0.3 to 3 m before the line; the line is crossed at green or yellow only."""
    vehicles = car("xgv", 20, 10, route="WC CE", kind="xgv")
    with crossing(tmp_path, "traffic_light", vehicles, stack) as run:
        stood_m: list[float] = []
        crossed = ""
        seen_colours = set()
        while run.now_s < 100.0 and not crossed:
            signal = around(run).signals[0] if "xgv" in run.vehicle_ids else None
            before = position_m(run, "xgv") if signal else ("", 0.0)
            run.step()
            lane, _ = position_m(run, "xgv")
            if signal is None:
                continue
            seen_colours.add(signal.colour)
            length_m = run.world.road.lane_length_m(run.snapshot.lane)[run.snapshot.index_of["xgv"]]
            if before[0] == "WC_0" and lane == "WC_0":
                assert signal.line_m == pytest.approx(length_m - before[1], abs=1e-6)
                if run.snapshot.speed_mps[run.snapshot.index_of["xgv"]] < 0.01:
                    stood_m.append(float(length_m) - position_m(run, "xgv")[1])
            elif before[0] == "WC_0":
                crossed = signal.colour
        assert crossed in {"green", "yellow"}
        assert "red" in seen_colours
        assert stood_m
        assert all(0.3 <= gap <= 3.0 for gap in stood_m)


@STACKS
def test_from_the_minor_road_it_lets_the_major_road_pass(tmp_path: Path, stack: str) -> None:
    """Cars of the major road 14 m/s fast and 3 s apart leave no gap; it comes after them, untouched."""
    major = "".join(car(f"car{n}", 190 - 40 * n, 13.0, route="WC CE") for n in range(5))
    vehicles = car("xgv", 130, 8.0, route="SC CN", kind="xgv") + major
    with crossing(tmp_path, "priority", vehicles, stack) as run:
        run.step()
        run.step()
        junction = around(run).junctions[0]
        assert junction is not None
        assert junction.right_of_way == "minor"
        assert {foe.vehicle_id for foe in junction.foes} <= {f"car{n}" for n in range(5)}
        assert all(foe.first and not foe.yields for foe in junction.foes)
        passed: list[str] = []
        braked_mps2 = 0.0
        while run.now_s < 60.0 and "xgv" in run.snapshot.index_of:
            for name in run.snapshot.index_of:
                if position_m(run, name)[0] in {"CE_0", "CN_0"} and name not in passed:
                    passed.append(name)
            if "xgv" in run.vehicle_ids:
                snapshot = run.step()
                assert snapshot.collisions == ()
                cars = [row for name, row in snapshot.index_of.items() if name != "xgv"]
                braked_mps2 = min([braked_mps2, *(float(snapshot.accel_mps2[row]) for row in cars)])
            else:
                run.step()
        assert passed[-1] == "xgv"
        assert braked_mps2 > -2.0


def test_on_the_major_road_it_does_not_wait(tmp_path: Path) -> None:
    vehicles = car("xgv", 60, 10.0, route="WC CE", kind="xgv") + car("car", 60, 10.0, route="SC CN")
    with crossing(tmp_path, "priority", vehicles, "reference") as run:
        run.step()
        least_mps = 99.0
        while position_m(run, "xgv")[0] != "CE_0":
            run.step()
            least_mps = min(least_mps, float(run.snapshot.speed_mps[run.snapshot.index_of["xgv"]]))
        assert least_mps > 9.0


def test_it_sees_its_way_through_the_crossing_and_the_limits_on_it(tmp_path: Path) -> None:
    """From 10 m before the end of WC the way runs straight to the east: the points are the distances."""
    vehicles = car("xgv", 100, 0.0, route="WC CE", kind="xgv")
    with crossing(tmp_path, "priority", vehicles, "none") as run:
        run.step()
        seen = around(run)
        lane, here_m = position_m(run, "xgv")
        assert lane == "WC_0"
        assert seen.way_x_m[0, 0] == pytest.approx(-200.0 + here_m, abs=0.01)
        assert seen.way_x_m[0, -1] == pytest.approx(-200.0 + here_m + 190.0, abs=0.2)
        assert seen.way_y_m[0] == pytest.approx(seen.way_y_m[0, 0], abs=0.01)
        assert seen.lane_changes[0] == 0
        assert seen.lane_end_m[0] == float("inf")
        assert seen.route_end_m[0] == pytest.approx(400.0 - here_m, abs=0.5)
        assert seen.signals[0] is None
