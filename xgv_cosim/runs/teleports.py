"""Rows of the teleports in ``result.json``: who, when, from where, and why, as far as SUMO says."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

from xgv_cosim.events import Event

_SAID = re.compile(r"Teleporting vehicle '(?P<vehicle>.+?)'; (?P<why>.+?), lane='")
"""Message of SUMO as it takes a vehicle off the road."""


def teleport_rows(events: Iterable[Event], messages: Sequence[str]) -> list[dict[str, Any]]:
    """Return one row for each teleport.

    Args:
        events: Of the whole run, in order.
        messages: SUMO's warnings, in order.
    """
    said: dict[str, list[str]] = {}
    for found in filter(None, map(_SAID.search, messages)):
        said.setdefault(found["vehicle"], []).append(found["why"])
    rows = []
    for event in events:
        if event.kind == "teleport":
            whys = said.get(event.vehicle)
            rows.append(
                {
                    "t_s": event.t_s,
                    "vehicle": event.vehicle,
                    "bound": event.before == "bound",
                    "place": event.reasons[0] if event.reasons else None,
                    "why": whys.pop(0) if whys else None,
                }
            )
    return rows
