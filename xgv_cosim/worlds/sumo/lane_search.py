"""Who is first ahead or behind on lanes, for all vehicles at once: compiled loops over sorted traffic."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.jit import compiled, inlinable

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn, IntMatrix


@inlinable
def _from(position_m: FloatColumn, least_m: float, begin: int, end: int) -> int:
    """Return the first place between ``begin`` and ``end`` from ``least_m`` on, ``end`` if there is none."""
    while begin < end:
        middle = (begin + end) // 2
        if position_m[middle] < least_m:
            begin = middle + 1
        else:
            end = middle
    return begin


@inlinable
def _last_before(
    rows: IntColumn, position_m: FloatColumn, first: IntColumn, lane: int, at_m: float, own: int
) -> int:
    """Return the place of the last vehicle on a lane before a position, -1: nobody."""
    begin = first[lane]
    index = _from(position_m, at_m, begin, first[lane + 1]) - 1
    while index >= begin and rows[index] == own:
        index -= 1
    return index if index >= begin else -1


def first_ahead_in(
    rows: IntColumn,
    position_m: FloatColumn,
    first: IntColumn,
    lanes: IntMatrix,
    starts_m: FloatMatrix,
    here_m: FloatColumn,
    own: IntColumn,
    found: IntColumn,
    distance_m: FloatColumn,
) -> None:
    """Find row and distance of the first vehicle ahead along each way, see ``LaneTraffic.first_ahead``."""
    for number in range(lanes.shape[0]):
        for step in range(lanes.shape[1]):
            lane = lanes[number, step]
            if lane < 0:
                break
            start_m, end = starts_m[number, step], first[lane + 1]
            index = _from(position_m, here_m[number] - start_m, first[lane], end)
            while index < end and rows[index] == own[number]:
                index += 1
            if index < end:
                found[number] = rows[index]
                distance_m[number] = start_m + position_m[index] - here_m[number]
                break


def first_behind_in(
    rows: IntColumn,
    position_m: FloatColumn,
    first: IntColumn,
    lengths_m: FloatColumn,
    before: IntColumn,
    first_before: IntColumn,
    lane: IntColumn,
    at_m: FloatColumn,
    own: IntColumn,
    sight_m: float,
    found: IntColumn,
    distance_m: FloatColumn,
) -> None:
    """Find row and distance of the nearest vehicle behind, see ``LaneTraffic.first_behind``.

    ``before`` has the lanes that lead to lane ``k`` from ``first_before[k]`` to ``first_before[k + 1]``.
    """
    for number in range(lane.shape[0]):
        if lane[number] < 0:
            continue
        index = _last_before(rows, position_m, first, lane[number], at_m[number], own[number])
        if index >= 0:
            found[number], distance_m[number] = rows[index], at_m[number] - position_m[index]
            continue
        waiting = [(lane[number], at_m[number])]
        while len(waiting) > 0:
            reached, ahead_m = waiting.pop()
            for place in range(first_before[reached], first_before[reached + 1]):
                source = before[place]
                gap_m = ahead_m + lengths_m[source]
                index = _last_before(rows, position_m, first, source, np.inf, own[number])
                if index >= 0:
                    if gap_m - position_m[index] < distance_m[number]:
                        found[number], distance_m[number] = rows[index], gap_m - position_m[index]
                elif gap_m < sight_m:
                    waiting.append((source, gap_m))


first_ahead = compiled(first_ahead_in, [Path(__file__)])
first_behind = compiled(first_behind_in, [Path(__file__)])
