"""On which side of the road a network drives; SUMO tells it to no client."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.sumo.inputs import TRUE, network_attributes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from xgv_cosim.columns import FloatMatrix
    from xgv_cosim.worlds.sumo.engine import Engine


def is_left_hand(engine: Engine, shapes: Mapping[str, FloatMatrix]) -> bool:
    """Return whether the network of the open simulation drives on the left.

    Its file says so. Where that cannot be read here (SUMO runs on another machine), the lanes do: the next
    higher number lies nearer to the middle of the road, so in a left-hand network further to the right. One
    that has no two lanes side by side is taken for a right-hand one then.

    Args:
        engine: SUMO.
        shapes: Centre line of each lane.
    """
    attributes = network_attributes(Path(engine.simulation.getOption("net-file")))
    if attributes is not None:
        return attributes.get("lefthand", "").lower() in TRUE
    return _rightwards_m(shapes) > 0.0


def _rightwards_m(shapes: Mapping[str, FloatMatrix]) -> float:
    """Return how far right of their neighbours the next higher lanes begin, all together."""
    total_m = 0.0
    for lane_id, shape in shapes.items():
        edge_id, _, number = lane_id.rpartition("_")
        higher = shapes.get(f"{edge_id}_{int(number) + 1}")
        if higher is not None and not lane_id.startswith(":"):
            along, across = shape[1] - shape[0], higher[0] - shape[0]
            total_m += float(along[1] * across[0] - along[0] * across[1]) / float(np.hypot(*along))
    return total_m
