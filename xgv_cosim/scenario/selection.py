"""Which vehicles a selector means: by id, pattern, type or share.

A share draws each vehicle by its own id and the seed alone, so the answer for one vehicle never
depends on which others there are, nor on the order in which they come.
"""

from __future__ import annotations

import hashlib
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from xgv_cosim.scenario.model import BindSection, Selector, VehicleQuery

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


def matches(selector: Selector, vehicle_id: str, type_id: str, seed: int) -> bool:
    """Return whether a selector means this vehicle.

    Args:
        selector: An id or pattern (``*``, ``?``, ``[...]``), several of them, or a ``VehicleQuery``.
        vehicle_id: Id of the vehicle.
        type_id: The world's type of the vehicle.
        seed: The scenario's seed, for a share that has none of its own.
    """
    if isinstance(selector, str):
        return fnmatchcase(vehicle_id, selector)
    if isinstance(selector, VehicleQuery):
        if selector.type is not None and not fnmatchcase(type_id, selector.type):
            return False
        if selector.share is None:
            return True
        return draw(vehicle_id, seed if selector.seed is None else selector.seed) < selector.share
    return any(fnmatchcase(vehicle_id, pattern) for pattern in selector)


def select(selector: Selector, vehicles: Iterable[tuple[str, str]], seed: int) -> tuple[str, ...]:
    """Return the ids of the vehicles that a selector means, in the order given.

    Args:
        selector: See ``matches``.
        vehicles: (id, type) of each vehicle.
        seed: The scenario's seed.
    """
    return tuple(name for name, type_id in vehicles if matches(selector, name, type_id, seed))


def binding_of(bind: Sequence[BindSection], vehicle_id: str, type_id: str, seed: int) -> BindSection | None:
    """Return the first row of ``bind`` that means this vehicle, or None."""
    return next((row for row in bind if matches(row.vehicles, vehicle_id, type_id, seed)), None)


def draw(vehicle_id: str, seed: int) -> float:
    """Return a number from 0 up to 1, the same for the same id and seed on every machine."""
    digest = hashlib.blake2b(vehicle_id.encode(), digest_size=8, key=str(seed).encode()).digest()
    return int.from_bytes(digest, "big") / 2**64
