"""Rows of the teleports in ``result.json``: who, when, from where, and why, as far as SUMO says."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

from xgv_cosim.events import Event

_SAID = re.compile(r"Teleporting vehicle '(?P<vehicle>.+?)'; (?P<why>.+?), lane='(?P<lane>.*?)'")
"""Message of SUMO as it takes a vehicle off the road."""


def teleport_rows(events: Iterable[Event], messages: Sequence[str]) -> list[dict[str, Any]]:
    """Return one row for each teleport.

    Args:
        events: Of the whole run, in order.
        messages: SUMO's warnings, in order.
    """
    said: dict[str, list[tuple[str, str]]] = {}
    for found in filter(None, map(_SAID.search, messages)):
        said.setdefault(found["vehicle"], []).append((found["why"], found["lane"]))
    rows = []
    for event in events:
        if event.kind == "teleport":
            heard = said.get(event.vehicle)
            why, lane = heard.pop(0) if heard else (None, "")
            place, is_bound = event.reasons[0], event.before == "bound"
            rows.append(
                {
                    "t_s": event.t_s,
                    "vehicle": event.vehicle,
                    "bound": is_bound,
                    "place": place if is_bound or not lane else f"lane {lane}",
                    "why": why,
                }
            )
    return rows
