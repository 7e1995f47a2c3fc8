"""What is kept and found of bound vehicles when couplings are chosen: tables with a row for each.

Their columns are read and written by the compiled loop of ``placing`` and by whoever acts on it.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.actuation import CouplingKind

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
    from xgv_cosim.worlds.sumo.lane_table import Table


class Way(IntEnum):
    """Which coupling writes a vehicle, see ``couplings``."""

    NONE = 0
    """None yet: the vehicle was bound since the last step."""
    FREE = 1
    LANE = 2
    MIRROR = 3
    LANE_KEEPING = 4
    CAR_FOLLOWING = 5
    WORLD_DRIVER = 6


class Yields(IntEnum):
    """Why the free coupling stands in for the one that ownership asks for."""

    NOTHING = 0
    OFF_ROAD = 1
    OUTSIDE = 2
    REVERSES = 3
    DEAD_END = 4


KINDS = tuple(CouplingKind)
"""Numbers of the kinds in ``ROSTER``."""

LANES_BEHIND = 4
"""So many lanes behind its own a vehicle's body may reach into: edge, junction, edge, junction."""
UNSEEN = -2
"""Lane of a vehicle that was not looked at before."""

ROSTER = np.dtype(
    [
        ("kind", np.uint8),
        ("way", np.uint8),
        ("yields", np.uint8),
        ("changes_lane", np.bool_),
        ("stops_at_red", np.bool_),
        ("exact_steps", np.int64),
        ("rest_steps", np.int64),
        ("lane", np.int64),
        ("next_lane", np.int64),
        ("road_lane", np.int64),
        ("cleared_lane", np.int64),
        ("told_lane", np.int64),
        ("behind_0", np.int64),
        ("behind_1", np.int64),
        ("behind_2", np.int64),
        ("behind_3", np.int64),
        ("told_m", np.float64),
        ("lateral_m", np.float64),
        ("crossing_m", np.float64),
        ("since_change_m", np.float64),
    ]
)
"""What is kept of a bound vehicle.

``kind`` place of its ``CouplingKind`` in ``KINDS``; ``way`` what wrote it last; ``yields`` why that was the
free coupling; ``changes_lane`` SUMO is to end a lane change of its driver in this step, for the computer
has taken the wheel; ``stops_at_red`` how SUMO plans for it, see ``placing``; ``exact_steps`` steps in a row
in which mirroring was exact, below 0 after a refusal; ``rest_steps`` steps for which it has been held at
rest; ``lane``, ``next_lane`` where it was seen last; ``road_lane`` the last one that was a lane,
``cleared_lane`` the one beside which SUMO has nothing of it left; ``told_lane`` the one in which SUMO was
told last how far it is across, -1: it is to be told, and ``told_m`` what that was; ``behind_0`` to
``behind_3`` the lanes that it has come over, nearest first, -1: no more; ``lateral_m`` where its front
bumper was across its lane in the step before, and ``crossing_m`` before it came onto its present lane;
``since_change_m`` how far it has driven since SUMO's driver changed lanes, as far as that matters.
"""


def new_row(kind: CouplingKind) -> Table:
    """Return the row of a vehicle that has just been bound, shape ``(1,)``."""
    row = np.zeros(1, ROSTER)
    row["kind"] = KINDS.index(kind)
    row["lane"] = row["next_lane"] = UNSEEN
    row["road_lane"] = row["cleared_lane"] = row["told_lane"] = -1
    for number in range(LANES_BEHIND):
        row[f"behind_{number}"] = -1
    row["lateral_m"] = row["crossing_m"] = np.nan
    row["since_change_m"] = np.inf
    return row


class Seen(NamedTuple):
    """The placed vehicles as SUMO has them before the step; every column has shape ``(n,)``."""

    is_here: BoolColumn
    """False: SUMO has the vehicle nowhere for the moment."""
    lane: IntColumn
    """-1 off the road."""
    next_lane: IntColumn
    position_m: FloatColumn
    speed_mps: FloatColumn
    length_m: FloatColumn
    width_m: FloatColumn
    ends_route: BoolColumn
    """Its route ends within this step."""


class Wanted(NamedTuple):
    """The placed vehicles as the plant wants them after the step, likewise."""

    front_x_m: FloatColumn
    front_y_m: FloatColumn
    heading_rad: FloatColumn
    speed_mps: FloatColumn
    travelled_m: FloatColumn
    computer_speed: BoolColumn
    computer_steering: BoolColumn


DECISION = np.dtype(
    [
        ("way", np.uint8),
        ("may_change_lane", np.bool_),
        ("tells", np.bool_),
        ("reaches_out", np.bool_),
        ("stops_at_red", np.bool_),
        ("shifts", np.bool_),
        ("position_m", np.float64),
        ("along_m", np.float64),
        ("lateral_m", np.float64),
        ("body_lateral_m", np.float64),
        ("lane_width_m", np.float64),
    ]
)
"""What the loop found for one vehicle, all 0 where SUMO has it nowhere.

``way`` which coupling is to write it; ``may_change_lane`` SUMO is to be asked whether it is in a lane change;
``tells`` ``yields`` has changed; ``reaches_out`` its body may reach beyond its lane, or there is none;
``stops_at_red`` how SUMO is to plan for it; ``shifts`` SUMO is to be told how far it is across its lane;
``position_m`` where the plant has the front bumper along the lane before the step, maybe past its end;
``along_m`` distance along the lane from where SUMO has the front bumper to where the plant puts it;
``lateral_m`` the front bumper from the centre line of the lane before the step, positive left;
``body_lateral_m`` the centre of the body, likewise; ``lane_width_m`` that lane's width. ``nan`` off the road.
"""
