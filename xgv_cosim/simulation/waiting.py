"""The injections that wait for a condition, and whom they have met."""

from __future__ import annotations

from dataclasses import dataclass, field

from xgv_cosim.columns import BoolColumn
from xgv_cosim.injection import Injection


@dataclass(slots=True)
class Waiting:
    """Conditional injections of a run."""

    injections: list[Injection] = field(default_factory=list)
    met: set[tuple[int, str]] = field(default_factory=set)
    """(index in ``injections``, vehicle id): each vehicle is met once."""
    lanes: dict[str, BoolColumn] = field(default_factory=dict)
    """Which lanes of the world each pattern means, shape ``(number of lanes,)``; filled at need."""
