"""Bound cars that turn left against a stream of SUMO's, and turns tighter than the car's circle."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim import Simulation, simulate

ARMS = (
    '<node id="W" x="-200" y="0"/><node id="E" x="200" y="0"/>'
    '<node id="S" x="0" y="-200"/><node id="N" x="0" y="200"/>'
)


def two_way(folder: Path, kind: str, lanes: int) -> Path:
    """Return a crossing of two streets with traffic both ways; the one from west to east has priority."""
    edges = "".join(
        f'<edge id="{a}{b}" from="{a}" to="{b}" numLanes="{lanes}" speed="13.89" priority="{priority}"/>'
        for arm, priority in (("W", 3), ("E", 3), ("S", 1), ("N", 1))
        for a, b in ((arm, "C"), ("C", arm))
    )
    return plain_network(folder, f'{ARMS}<node id="C" x="0" y="0" type="{kind}"/>', edges)


def entered_second_half(run: Simulation) -> bool:
    """Return whether the car has left the place inside the crossing at which one waits."""
    row = run.snapshot.index_of.get("xgv")
    if row is None:
        return True
    name = run.world.road.lane_ids[run.snapshot.lane[row]]
    return name.startswith("CN")


@pytest.mark.parametrize("stack", ["reference", "reference_wrench"])
@pytest.mark.parametrize("kind", ["priority", "traffic_light"])
@pytest.mark.parametrize("lanes", [1, 2])
def test_turning_left_it_lets_the_oncoming_stream_pass(
    tmp_path: Path, kind: str, lanes: int, stack: str
) -> None:
    """Cars 13 m/s fast and 22 m apart leave no gap; at green without protection likewise (issue 4, 3.7)."""
    stream = "".join(car(f"car{n}", 178 - 22 * n, 13.0, lane=lanes - 1, route="EC CW") for n in range(8))
    own = car("xgv", 150, 8.0, lane=lanes - 1, route="WC CN", kind="xgv")
    config = write_config(tmp_path, own + stream, two_way(tmp_path, kind, lanes))
    with simulate(config, bind=["xgv*"], set=[f"bind.0.stack={stack}", "duration_s=120"]) as run:
        braked_mps2, passed = 0.0, set()
        foes: set[str] = set()
        while run.now_s < 60.0 and not (run.now_s > 1.0 and entered_second_half(run)):
            snapshot = run.step()
            assert snapshot.collisions == ()
            junction = run.world.surroundings(["xgv"]).junctions[0] if "xgv" in run.vehicle_ids else None
            if junction is not None:
                foes |= {foe.vehicle_id for foe in junction.foes if foe.first}
            for name, row in snapshot.index_of.items():
                if name != "xgv":
                    braked_mps2 = min(braked_mps2, float(snapshot.accel_mps2[row]))
                    if run.world.road.lane_ids[snapshot.lane[row]].startswith("CW"):
                        passed.add(name)
        assert entered_second_half(run)
        assert foes == {f"car{n}" for n in range(8)}
        assert passed | set(run.snapshot.arrived) >= {f"car{n}" for n in range(7)}
        assert braked_mps2 > -2.0


def test_it_waits_inside_the_crossing_and_goes_through_a_gap(tmp_path: Path) -> None:
    """SUMO has a place inside for who turns left: there it stands, and goes between two 9 s apart."""
    stream = car("near", 150, 13.0, route="EC CW") + car("far", 20, 13.0, route="EC CW")
    own = car("xgv", 170, 6.0, route="WC CN", kind="xgv")
    config = write_config(tmp_path, own + stream, two_way(tmp_path, "priority", 1))
    with simulate(config, bind=["xgv*"], set=["duration_s=60"]) as run:
        order: list[str] = []
        while run.now_s < 40.0 and len(order) < 3:
            snapshot = run.step()
            assert snapshot.collisions == ()
            for name, row in snapshot.index_of.items():
                lane = run.world.road.lane_ids[snapshot.lane[row]]
                if lane[:2] in {"CW", "CN"} and name not in order:
                    order.append(name)
                assert name == "xgv" or snapshot.accel_mps2[row] > -2.0
        assert order == ["near", "xgv", "far"]


@pytest.mark.parametrize(("route", "lane"), [("WC CS", 0), ("WC CN", 0)])
def test_in_a_turn_its_body_stays_on_its_side_of_the_road(tmp_path: Path, route: str, lane: int) -> None:
    """A right turn on a radius of 5.6 m: no corner comes 0.3 m beyond the middle of the road reached."""
    config = write_config(
        tmp_path, car("xgv", 150, 8.0, route=route, kind="xgv"), two_way(tmp_path, "priority", 1)
    )
    with simulate(config, bind=["xgv*"], set=["duration_s=60"]) as run:
        beyond_m = -math.inf
        while run.now_s < 40.0:
            snapshot = run.step()
            row = snapshot.index_of["xgv"]
            x_m, y_m = snapshot.front_x_m[row], snapshot.front_y_m[row]
            cosine, sine = math.cos(snapshot.heading_rad[row]), math.sin(snapshot.heading_rad[row])
            left = (x_m - 0.9 * sine, y_m + 0.9 * cosine)
            if abs(left[1]) > 7.3:  # on the road reached, whose middle is x = 0
                beyond_m = max(beyond_m, left[0] if route.endswith("CS") else -left[0])
            if abs(y_m) > 60.0:
                break
        assert abs(y_m) > 60.0
        assert -1.5 < beyond_m < 0.3


def test_it_turns_round_where_the_drawn_lane_is_tighter_than_its_circle(tmp_path: Path) -> None:
    """On a lane drawn with a radius of 1.6 m a car of 4.1 m gets round, instead of driving circles."""
    net = plain_network(
        tmp_path,
        f'{ARMS}<node id="C" x="0" y="0"/>',
        "".join(
            f'<edge id="{a}{b}" from="{a}" to="{b}" numLanes="1" speed="13.89"/>'
            for arm in "WEN"
            for a, b in ((arm, "C"), ("C", arm))
        ),
        no_turnarounds=False,
    )
    config = write_config(tmp_path, car("xgv", 150, 8.0, route="WC CW", kind="xgv"), net)
    with simulate(config, bind=["xgv*"], set=["duration_s=60"]) as run:
        while run.now_s < 40.0:
            run.step()
            row = run.snapshot.index_of["xgv"]
            if run.snapshot.front_x_m[row] < -50.0 and run.now_s > 10.0:
                break
        assert run.now_s < 30.0
        assert run.world.road.lane_ids[run.snapshot.lane[row]] == "CW_0"
        assert run.world.surroundings(["xgv"]).lateral_m[0] == pytest.approx(0.0, abs=0.7)
