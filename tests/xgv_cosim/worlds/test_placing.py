"""The compiled choice of couplings against the same code in plain Python, and its geometry against NumPy."""

from __future__ import annotations

from pathlib import Path
from types import FunctionType

import numpy as np
import pytest
from numpy.random import Generator

from xgv_cosim import actuation
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo import in_lane, lane_table, placing, placing_tables
from xgv_cosim.worlds.sumo.lane_table import LaneTables, point_ahead
from xgv_cosim.worlds.sumo.placing import decide, decide_in_place
from xgv_cosim.worlds.sumo.placing_tables import DECISION, Seen, Wanted, Way, new_row
from xgv_cosim.worlds.sumo.road import SumoRoad

STEP_S = 0.1
REST_S = 0.3


def random_road(draw: Generator) -> SumoRoad:
    """Lanes that bend and lead on to one, two or no others; SUMO's length differs from the drawn one."""
    shapes = []
    for _ in range(12):
        turns = np.cumsum(draw.uniform(-0.5, 0.5, draw.integers(1, 6)))
        steps = draw.uniform(2.0, 30.0, len(turns))[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
        shapes.append(np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]) + draw.uniform(-50.0, 50.0, 2))
    drawn_m = np.array([np.hypot(*np.diff(shape, axis=0).T).sum() for shape in shapes])
    successors = [tuple((f"e{j}", int(j)) for j in draw.integers(0, 12, draw.integers(0, 3))) for _ in shapes]
    return SumoRoad(
        lane_ids=tuple(f"e{i}_0" for i in range(12)),
        shapes=tuple(shapes),
        lengths_m=drawn_m * draw.uniform(0.98, 1.02, 12),
        widths_m=np.full(12, 3.2),
        limits_mps=np.full(12, 13.9),
        edge_ids=tuple(f"e{i}" for i in range(12)),
        successors=tuple(successors),
        leftwards=int(draw.choice([1, -1])),
    )


def as_records(tables: LaneTables) -> LaneTables:
    """Return tables whose rows plain Python can ask for their fields by name."""
    return tables._replace(lanes=tables.lanes.view(np.recarray), vertices=tables.vertices.view(np.recarray))


def random_step(draw: Generator, road: SumoRoad, n: int) -> tuple[Seen, Wanted]:
    """Cars about their lanes: inside, beside, past the end, in reverse, at rest, off the road, nowhere."""
    lane = draw.integers(-1, 12, n)
    next_lane = np.where(lane >= 0, [road.only_successor(int(k)) if k >= 0 else -1 for k in lane], -1)
    position_m = draw.uniform(0.0, 1.0, n) * road.lane_length_m(lane)
    travelled_m = draw.choice([0.0, -0.2, 1.0, 2.0], n)
    points = road.points_ahead(lane, position_m + travelled_m, next_lane)
    beside_m = draw.choice([0.0, 0.3, 1.7, 5.0], n)
    seen = Seen(
        draw.random(n) > 0.05,
        lane,
        next_lane,
        position_m,
        draw.choice([0.0, 10.0], n),
        np.full(n, 4.4),
        np.full(n, 1.8),
        draw.random(n) > 0.9,
    )
    wanted = Wanted(
        np.nan_to_num(points.x_m) - beside_m * np.nan_to_num(np.sin(points.heading_rad)),
        np.nan_to_num(points.y_m) + beside_m * np.nan_to_num(np.cos(points.heading_rad)),
        np.nan_to_num(points.heading_rad) + draw.choice([0.0, 0.01, 0.1], n),
        10.0 * travelled_m,
        travelled_m,
        draw.random(n) > 0.1,
        draw.random(n) > 0.1,
    )
    return seen, wanted


@pytest.mark.parametrize("seed", range(6))
def test_the_compiled_loop_does_what_its_plain_python_does(seed: int) -> None:
    draw = np.random.default_rng(seed)
    road, n = random_road(draw), 200
    kinds = [CouplingKind.AUTO, CouplingKind.AUTO, CouplingKind.FREE, CouplingKind.LANE]
    compiled = np.concatenate([new_row(kinds[number % 4]) for number in range(n)])
    plain = compiled.copy()
    ways = set()
    for _ in range(8):
        seen, wanted = random_step(draw, road, n)
        decided = decide(road.tables, compiled, seen, wanted, STEP_S, REST_S)
        found = decided.found
        expected = np.zeros(n, DECISION)
        tables = as_records(road.tables)
        any_of = np.zeros(6, np.bool_)
        was = plain["way"].copy()
        rows = plain.view(np.recarray), expected.view(np.recarray)
        decide_in_place(tables, rows[0], seen, wanted, STEP_S, REST_S, rows[1], any_of)
        assert decided[1:] == tuple(any_of.tolist())
        assert decided.tells == expected["tells"].any()
        assert decided.may_change_lane == expected["may_change_lane"].any()
        assert decided.reaches_out == expected["reaches_out"].any()
        assert decided.switches == (expected["way"] != was).any()
        assert decided.rests == (plain["rest_steps"][seen.is_here] * STEP_S >= REST_S).any()
        for name in DECISION.names:
            np.testing.assert_allclose(found[name], expected[name], rtol=0.0, atol=1e-9, err_msg=name)
        compiled["way"] = plain["way"] = found["way"]
        for name in compiled.dtype.names:
            np.testing.assert_allclose(compiled[name], plain[name], rtol=0.0, atol=1e-9, err_msg=name)
        ways |= set(found["way"].tolist())
    assert ways >= {Way.NONE, Way.FREE, Way.LANE, Way.LANE_KEEPING, Way.CAR_FOLLOWING, Way.WORLD_DRIVER}


@pytest.mark.parametrize("seed", range(4))
def test_points_of_one_lane_are_those_of_many(seed: int) -> None:
    draw = np.random.default_rng(seed)
    road = random_road(draw)
    lane, following = draw.integers(-1, 12, 400), draw.integers(-1, 12, 400)
    position_m = draw.uniform(-10.0, 250.0, 400)
    many = road.points_ahead(lane, position_m, following)
    tables = as_records(road.tables)
    for number in range(400):
        one = point_ahead(tables, int(lane[number]), float(position_m[number]), int(following[number]))
        expected = many.x_m[number], many.y_m[number], many.heading_rad[number]
        np.testing.assert_allclose(one[:3], expected, rtol=0.0, atol=1e-9)


def test_what_is_exact_is_mirrored_after_five_steps_and_no_longer_when_it_is_not() -> None:
    draw = np.random.default_rng(1)
    road = random_road(draw)
    row = new_row(CouplingKind.AUTO)
    ways = []
    for step in range(9):
        along_m = 5.0 + 0.1 * step
        point = point_ahead(as_records(road.tables), 0, along_m + 0.1, -1)
        beside_m = 1.0 if step == 7 else 0.0
        seen = Seen(*(np.array([value]) for value in (True, 0, -1, along_m, 1.0, 0.5, 0.3, False)))
        pose = point.x_m - beside_m * point.sine, point.y_m + beside_m * point.cosine
        turned = point.heading_rad + (0.5 if beside_m else 0.0)
        wanted = Wanted(*(np.array([value]) for value in (*pose, turned, 1.0, 0.1, True, True)))
        ways.append(Way(decide(road.tables, row, seen, wanted, STEP_S, REST_S).found["way"][0]))
    assert ways == [Way.FREE] * 4 + [Way.MIRROR] * 3 + [Way.FREE] * 2


def test_the_machine_code_is_named_by_every_file_that_it_is_made_from() -> None:
    """What is inlined comes from these modules; one left out would leave stale machine code (issue 4.4)."""
    functions = [
        function
        for module in (placing, in_lane, lane_table)
        for function in vars(module).values()
        if isinstance(function, FunctionType) and function.__module__.startswith("xgv_cosim.worlds")
    ]
    files = {Path(function.__code__.co_filename) for function in functions}
    tables = {Path(str(module.__file__)) for module in (placing_tables, actuation)}
    assert set(placing.placing_sources()) == files | tables
