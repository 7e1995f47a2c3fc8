"""What a reader must not overlook: things that were asked for and did not act, or went wrong quietly."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from difflib import get_close_matches
from fnmatch import fnmatchcase

from xgv_cosim.condition import Condition
from xgv_cosim.events import Event
from xgv_cosim.scenario.model import Scenario
from xgv_cosim.scenario.selection import rows_without_vehicle

BRIEF_S = 1.0
"""A stack that sees its engine off starts it within this time; then nobody needs to be warned."""
_MOST_NAMED = 5
_TEXTS = {
    "injection_without_vehicle": "injection {after} at {t_s:g} s did not act",
    "injection_unsupported": "injection {after} at {t_s:g} s did not act",
    "pause_ineffective": "a pause does not brake",
    "pause_weaker_than_set": "a pause brakes less than it is set to",
    "disable_ineffective": "a disable does not brake",
    "disable_weaker_than_full": "a disable brakes less than fully",
    "override_masked": "the manual override does not act",
    "without_drive": "nothing drives it from {t_s:g} s on: {after}",
    "no_command": "nobody commands it from {t_s:g} s on",
    "stack_failed": "the stack failed at {t_s:g} s",
    "stops_ignored": "the computer does not keep the stops that SUMO's demand has for it",
    "controller_failed": "the controller failed at {t_s:g} s",
}


def warnings_of(
    scenario: Scenario,
    events: Sequence[Event],
    lane_ids: Sequence[str] | None = None,
    rows_met: Collection[int] | None = None,
) -> list[str]:
    """Return one line for each thing that had no effect or went wrong, each thing once.

    Args:
        scenario: What was run.
        events: What happened.
        lane_ids: The world's lanes, None where they are not known.
        rows_met: Rows of ``bind`` that have matched a vehicle, None where that is not known.
    """
    nobody_bound = not any(event.kind == "bound" for event in events)
    if rows_met is None:
        rows_met = () if nobody_bound else range(len(scenario.bind))
    lines = rows_without_vehicle([row.vehicles for row in scenario.bind], rows_met)
    if scenario.bind and not lines and nobody_bound:
        lines.append("no vehicle was bound: whom 'bind' matches was not there between from_s and until_s")
    if not scenario.bind and nobody_bound:
        lines.append("no vehicle is bound: there is no row of 'bind'; add one, or --bind VEHICLES")
    lines += _unmet(scenario, events, lane_ids)
    lines += _tight_turns(events)
    told: set[str] = set()
    for event in events:
        if event.kind == "stops_ignored":
            if event.vehicle in told:  # bound again, with the stops that are left
                continue
            told.add(event.vehicle)
        if event.kind in {"without_drive", "no_command"} and not _lasts(event, events):
            continue
        if event.kind in _TEXTS:
            lines.append(_line(event, _TEXTS[event.kind]))
        elif event.kind == "road" and event.after == "off_road":
            lines.append(_line(event, "it left the road at {t_s:g} s"))
    return list(dict.fromkeys(lines))


def _tight_turns(events: Sequence[Event]) -> list[str]:
    """Return one line for all vehicles whose routes turn on a smaller radius than the same car can."""
    whose: dict[str, dict[str, None]] = {}
    where: dict[str, dict[str, None]] = {}
    for event in events:
        if event.kind == "turns_too_tight":
            whose.setdefault(event.after, {})[event.vehicle] = None
            where.setdefault(event.after, {}).update(dict.fromkeys(event.reasons))
    return [
        f"{_few(names, ', ')}: the route turns on less than the {radius} that the rear axle needs, "
        f"so the car cannot keep to its lane there ({_few(where[radius], '; ')})"
        for radius, names in whose.items()
    ]


def _few(words: Collection[str], between: str) -> str:
    more = len(words) - _MOST_NAMED
    return between.join([*list(words)[:_MOST_NAMED], *([f"and {more} more"] if more > 0 else [])])


def _unmet(scenario: Scenario, events: Sequence[Event], lane_ids: Sequence[str] | None) -> list[str]:
    """Return one line for each conditional injection whose condition no vehicle met."""
    met = {(event.after, event.reasons) for event in events if event.kind == "condition_met"}
    waited = [
        (number, row.kind.value, row.when.condition())
        for number, row in enumerate(scenario.injections)
        if row.when is not None
    ]
    return [
        f"injections.{number}: {kind} did not act: {_why_unmet(condition, lane_ids)}"
        for number, kind, condition in waited
        if (kind, condition.words()) not in met
    ]


def _why_unmet(condition: Condition, lane_ids: Sequence[str] | None) -> str:
    pattern = condition.lanes
    if pattern is None or lane_ids is None or any(fnmatchcase(name, pattern) for name in lane_ids):
        return f"no vehicle met its condition ({', '.join(condition.words())})"
    near = get_close_matches(pattern, lane_ids, 1)
    return f"the network has no lane {pattern}" + (f"; did you mean {near[0]!r}?" if near else "")


def _lasts(begun: Event, events: Sequence[Event]) -> bool:
    """Return whether an event begins something that lasts longer than a stack takes to see and end it."""
    ended_s = (
        event.t_s
        for event in events
        if (event.vehicle, event.kind, event.before) == (begun.vehicle, begun.kind, begun.after)
    )
    return bool(begun.after) and min((t_s for t_s in ended_s if t_s >= begun.t_s), default=math.inf) > (
        begun.t_s + BRIEF_S
    )


def _line(event: Event, text: str) -> str:
    what = text.format(after=event.after, t_s=event.t_s)
    who = f"{event.vehicle}: " if event.vehicle else ""
    why = f" ({'; '.join(event.reasons)})" if event.reasons else ""
    return f"{who}{what}{why}"
