"""Which vehicles a selector means: by id, pattern, type, route or share.

A share draws each vehicle by its own id and the seed alone, so the answer for one vehicle never
depends on which others there are, nor on the order in which they come.
"""

from __future__ import annotations

import hashlib
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from xgv_cosim.scenario.model import BindSection, Selector, VehicleQuery
from xgv_cosim.traveller import Traveller

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence


def matches(selector: Selector, who: Traveller, seed: int) -> bool:
    """Return whether a selector means this vehicle.

    Args:
        selector: An id or pattern (``*``, ``?``, ``[...]``), several of them, or a ``VehicleQuery``.
        who: The vehicle.
        seed: The scenario's seed, for a share that has none of its own.
    """
    if isinstance(selector, str):
        return fnmatchcase(who.vehicle_id, selector)
    if isinstance(selector, VehicleQuery):
        return _meets(selector, who, seed)
    return any(fnmatchcase(who.vehicle_id, pattern) for pattern in selector)


def in_words(selector: Selector) -> str:
    """Return a selector as its author could have written it with ``--bind``."""
    if isinstance(selector, str):
        return selector
    if isinstance(selector, VehicleQuery):
        given = selector.model_dump(exclude_none=True)
        return ",".join(f"{key}={value}" for key, value in given.items())
    return ",".join(selector)


def rows_without_vehicle(selectors: Sequence[Selector], met: Collection[int]) -> list[str]:
    """Return a warning for each row of ``bind`` that has matched no vehicle.

    Args:
        selectors: Whom each row means.
        met: Indices of the rows that have matched one.
    """
    return [
        f"bind.{number}: no vehicle that has departed matches {in_words(selector)}"
        f"{', but for those that earlier rows take' if number else ''}"
        for number, selector in enumerate(selectors)
        if number not in met
    ]


def _meets(query: VehicleQuery, who: Traveller, seed: int) -> bool:
    """Return whether all conditions hold that the query has."""
    if query.type is not None and not fnmatchcase(who.type_id, query.type):
        return False
    if query.route is not None and not fnmatchcase(who.route_id, query.route):
        return False
    if query.via is not None and query.via not in who.edges:
        return False
    if query.share is None:
        return True
    return draw(who.vehicle_id, seed if query.seed is None else query.seed) < query.share


def binding_of(bind: Sequence[BindSection], who: Traveller, seed: int) -> BindSection | None:
    """Return the first row of ``bind`` that means this vehicle, or None."""
    return next((row for row in bind if matches(row.vehicles, who, seed)), None)


def draw(vehicle_id: str, seed: int) -> float:
    """Return a number from 0 up to 1, the same for the same id and seed on every machine."""
    digest = hashlib.blake2b(vehicle_id.encode(), digest_size=8, key=str(seed).encode()).digest()
    return int.from_bytes(digest, "big") / 2**64
