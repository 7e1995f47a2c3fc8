"""Who is first ahead or behind on lanes: the compiled loops against looking at everybody."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from xgv_cosim.worlds.sumo.traffic_lanes import LaneTraffic

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.network import SumoNetwork

LENGTHS_M = np.array([50.0, 30.0, 40.0, 80.0, 200.0])
BEFORE = ((), (0,), (0,), (1, 2), (3,))
"""0 leads to 1 and 2, both to 3, and that to 4."""
ROAD: Any = SimpleNamespace(lane_ids=("a", "b", "c", "d", "e"), lengths_m=LENGTHS_M)
NETWORK = cast(
    "SumoNetwork",
    SimpleNamespace(
        before=BEFORE,
        before_columns=(
            np.array([lane for lanes in BEFORE for lane in lanes]),
            np.array([0, *np.cumsum([len(lanes) for lanes in BEFORE])]),
        ),
    ),
)
WAYS = ((0, 1, 3, 4), (0, 2, 3, 4), (3, 4), (4,), ())
vehicles = st.lists(st.tuples(st.integers(-1, 4), st.integers(0, 40)), min_size=1, max_size=12)


@settings(deadline=None)  # the first call compiles
@given(vehicles, st.data())
def test_the_first_ahead_and_behind_are_those_that_walking_finds(
    placed: list[tuple[int, int]], data: st.DataObject
) -> None:
    lane = np.array([number for number, _ in placed])
    position_m = np.array([tenths / 40 * LENGTHS_M[number] for number, tenths in placed])
    traffic = LaneTraffic.of(ROAD, lane, position_m)
    own = np.arange(len(placed))
    ways = [data.draw(st.sampled_from(WAYS)) for _ in placed]
    here_m = np.array([data.draw(st.integers(0, 40)) / 40 * LENGTHS_M[way[0]] if way else 0 for way in ways])
    most = max(1, *(len(way) for way in ways))
    lanes = np.array([[*way, *[-1] * (most - len(way))] for way in ways])
    starts_m = np.array([np.concatenate([[0.0], np.cumsum(LENGTHS_M[row])])[:-1] for row in lanes])

    ahead, ahead_m = traffic.first_ahead(lanes, starts_m, here_m, own)
    behind, behind_m = traffic.first_behind(NETWORK, lanes[:, 0], here_m, own)

    for number, way in enumerate(ways):
        others = [other for other in own.tolist() if other != number]
        before_m = [
            (starts_m[number, step] + position_m[other] - here_m[number])
            for step, on in enumerate(way)
            for other in others
            if lane[other] == on and starts_m[number, step] + position_m[other] >= here_m[number]
        ]
        np.testing.assert_allclose(ahead_m[number], min(before_m, default=np.inf))
        assert (ahead[number] >= 0) == bool(before_m)
        np.testing.assert_allclose(
            behind_m[number], nearest_behind_m(way, here_m[number], lane, position_m, others)
        )
        assert (behind[number] >= 0) == np.isfinite(behind_m[number])
        assert number not in (ahead[number], behind[number])


def nearest_behind_m(
    way: tuple[int, ...], here_m: float, lane: Any, position_m: Any, others: list[int]
) -> float:
    """Walk back from a place, up each branch to its first vehicle; none is begun after 120 m."""
    if not way:
        return np.inf
    before = [other for other in others if lane[other] == way[0] and position_m[other] < here_m]
    on_lane = [here_m - position_m[other] for other in before]
    if on_lane:
        return min(on_lane)

    def back(number: int, gone_m: float) -> float:
        least_m = np.inf
        for source in BEFORE[number]:
            end_m = gone_m + LENGTHS_M[source]
            there = [end_m - position_m[other] for other in others if lane[other] == source]
            if there:
                least_m = min(least_m, *there)
            elif end_m < 120.0:
                least_m = min(least_m, back(source, end_m))
        return least_m

    return back(way[0], here_m)
