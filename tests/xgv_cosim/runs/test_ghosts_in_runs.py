"""A car across the line has a ghost in SUMO; whoever reads the run folder never hears of it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import xgv_cosim
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.recording import EVENTS, REPORT, RESULT, ROAD, TRAJECTORY, read_trajectory
from xgv_cosim.worlds.sumo.ghosts import GHOST_PREFIX, is_ghost
from xgv_cosim.worlds.sumo.libraries import load_libsumo

STACK = Path(__file__).parents[3] / "examples" / "my_stack.py"
ASIDE = """from dataclasses import replace

from my_stack import MyStack


class Aside(MyStack):
    def act(self, seen):
        aside_m = tuple((x_m, y_m + 1.2) for x_m, y_m in seen.lane_ahead_m)
        return super().act(replace(seen, lane_ahead_m=aside_m))
"""


@pytest.mark.parametrize("beside_m", [60, 99])
def test_the_ghost_of_a_car_across_the_line_is_nowhere_in_the_run_folder(
    tmp_path: Path, beside_m: float
) -> None:
    """Point 3.2: no count, no row, no event and no picture has it, though SUMO has it all the while.

    Beside a car that comes over the line SUMO has one in collision with its ghost, and says so.
    """
    vehicles = car("ego", 100, 10, kind="xgv") + car("left", beside_m, 10, lane=1)
    config = write_config(tmp_path, vehicles, network("hello"))
    (tmp_path / "my_stack.py").write_text(STACK.read_text())
    (tmp_path / "aside.py").write_text(ASIDE)
    with_ghost, engine = [], load_libsumo()

    def look(now_s: float, duration_s: float) -> None:
        names = engine.vehicle.getIDList()
        with_ghost.append(sum(map(is_ghost, names)))
        assert 0.0 < now_s <= duration_s
        assert sorted(name for name in names if not is_ghost(name)) == ["ego", "left"]

    out = tmp_path / "out"
    result = xgv_cosim.run(
        config, bind=["ego,stack=aside:Aside"], set=["duration_s=12"], out=out, progress=look
    )
    assert result.status == "ok"
    assert sum(with_ghost) > 40, "the car never reached over the line"
    data = json.loads((out / RESULT).read_text())
    assert (data["num_vehicles_max"], data["num_bound_max"]) == (2, 1)
    assert list(data["vehicles"]) == ["ego"]
    assert set(read_trajectory(out / TRAJECTORY).rows_of) == {"ego", "left"}
    assert data["collisions"] == []
    for name in (RESULT, EVENTS, ROAD, REPORT):
        assert GHOST_PREFIX not in (out / name).read_text(), name
    assert GHOST_PREFIX.encode() not in (out / TRAJECTORY).read_bytes()
