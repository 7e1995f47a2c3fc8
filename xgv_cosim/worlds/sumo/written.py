"""What a step wrote into SUMO, and what follows from it without asking SUMO."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.base import Placement
from xgv_cosim.worlds.sumo.placing_tables import DECISION, Seen, Way

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn, UInt8Column
    from xgv_cosim.worlds.sumo.lane_table import Table

_MARGIN_M = 0.3
"""So far inside its lane a freely placed front bumper is surely on it."""
_END_M = 10.0
"""So far from both ends of the lane."""


_FREE, _LANE, _MIRROR = int(Way.FREE), int(Way.LANE), int(Way.MIRROR)


@dataclass(frozen=True)
class Written:
    """The placed vehicles of a step; every column has shape ``(n,)``."""

    placement: Placement
    rows_before: IntColumn
    """Their rows in the snapshot before the step, -1: not there."""
    way: UInt8Column
    """``Way`` by which each was written, ``NONE``: it was not."""
    found: Table
    """Rows of ``placing_tables.DECISION``."""
    seen: Seen

    @cached_property
    def in_lane_frame(self) -> BoolColumn:
        """Return who was written as speed and lateral position in its lane."""
        in_frame: BoolColumn = (self.way == _LANE) | (self.way == _MIRROR)
        return in_frame

    @cached_property
    def is_posed(self) -> BoolColumn:
        """Return whose pose is the plant's, by ``moveToXY`` or as exact as ``auto`` mirrors."""
        placed = (self.way == _FREE) & ~self.seen.ends_route
        both = self.placement.computer_speed & self.placement.computer_steering
        posed: BoolColumn = (placed | (self.way == _MIRROR)) & both
        return posed

    @cached_property
    def along_m(self) -> FloatColumn:
        """Return how far those in the frame of a lane were told to go."""
        along_m = np.where(self.way == _LANE, self.placement.travelled_m, self.found["along_m"])
        return np.maximum(along_m, 0.0)

    def places(
        self, lane_length_m: FloatColumn, inside_junction: BoolColumn
    ) -> tuple[BoolColumn, FloatColumn]:
        """Return who is still on the lane it was on, for certain, and how far along.

        SUMO moves those in the frame of a lane just as it is told. Who is placed freely stays on its lane
        well inside of it; in junctions lanes lie over each other.
        """
        in_frame = self.in_lane_frame
        at_m = np.where(in_frame, self.seen.position_m + self.along_m, self.found["position_m"])
        within = (self.seen.lane >= 0) & (at_m < lane_length_m)
        inside = np.abs(self.found["lateral_m"]) < 0.5 * self.found["lane_width_m"] - _MARGIN_M
        freely = self.is_posed & inside & ~inside_junction & (at_m > _END_M) & (at_m < lane_length_m - _END_M)
        return within & (in_frame | freely), at_m


def nothing_written() -> Written:
    """Return the columns of no vehicle."""
    numbers, words, flags = np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.bool_)
    placement = Placement((), numbers, numbers, numbers, numbers, numbers, flags, flags)
    seen = Seen(flags, words, words, numbers, numbers, numbers, numbers, flags)
    return Written(placement, words, np.zeros(0, np.uint8), np.zeros(0, DECISION), seen)
