"""Which facts of the event log had an effect: what the ledger of assumptions may call exercised."""

from __future__ import annotations

from collections.abc import Sequence

from xgv_cosim.events import Event
from xgv_cosim.runs.vehicles import by_vehicle

_DRIVING = "drive_by_wire"
_NOBODY = "nobody"
_ACT_AFTER_THE_HANDOVER = frozenset({"safety_mode", "control_mode"})


def handovers_s(events: Sequence[Event]) -> dict[str, float]:
    """Return when the computer got each vehicle; one that it never got is absent.

    A cold start has no hand-over, the computer has it from binding on. There the time is that of the first
    change of the safety mode in which it starts up, if there is one.
    """
    places = {name: (own, _place_of_handover(own)) for name, own in by_vehicle(events).items()}
    return {name: own[place].t_s for name, (own, place) in places.items() if place is not None}


def _place_of_handover(own: Sequence[Event]) -> int | None:
    """Return the place of the event that ``handovers_s`` names; several may lie on its tick."""
    for place, event in enumerate(own):
        if event.kind == "handover":
            return place
    if not any(event.kind == "bound" and "start cold" in event.reasons for event in own):
        return None
    modes = [place for place, event in enumerate(own) if event.kind == "safety_mode"]
    return modes[1] if len(modes) > 1 else None


def facts_that_acted(events: Sequence[Event]) -> set[str]:
    """Return the facts ``kind`` and ``kind:after`` of all events that had an effect, and three more.

    A safety or control mode acts if it is in force at the hand-over or later; before, the world's driver
    drives. The three more: ``reported:MODE`` (the safety mode was reported, whether or not it acted),
    ``preempted`` (a controller lost a component to another) and ``rearmed`` (drive-by-wire came back
    after a stop that acted and whose injection has ended).
    """
    facts: set[str] = set()
    for own in by_vehicle(events).values():
        overtaken = _overtaken_before_the_handover(own)
        acted = [event for place, event in enumerate(own) if place not in overtaken]
        facts.update(event.kind for event in own)
        facts.update(f"{event.kind}:{event.after}" for event in acted)
        facts.update(f"reported:{event.after}" for event in own if event.kind == "safety_mode")
        if any(event.kind == "component_control" and _is_preemption(event) for event in own):
            facts.add("preempted")
        if _is_rearmed(acted):
            facts.add("rearmed")
    return facts


def _overtaken_before_the_handover(own: Sequence[Event]) -> set[int]:
    """Return the places of mode changes that were over when the computer got the vehicle."""
    handover = _place_of_handover(own)
    overtaken: set[int] = set()
    for kind in _ACT_AFTER_THE_HANDOVER:
        places = [place for place, event in enumerate(own) if event.kind == kind]
        if handover is None:
            overtaken.update(places)
        else:
            overtaken.update([place for place in places if place <= handover][:-1])
    return overtaken


def _is_preemption(event: Event) -> bool:
    """Return whether a component went from one controller to another ("Component: controller")."""
    before, after = (text.rpartition(": ")[2] for text in (event.before, event.after))
    return _NOBODY not in (before, after) and before != after


def _is_rearmed(acted: Sequence[Event]) -> bool:
    stopped = ended = False
    for event in acted:
        if event.kind == "injection" and not event.after:
            ended = stopped
        elif event.kind == "safety_mode":
            if event.after != _DRIVING:
                stopped = True
            elif ended:
                return True
            else:
                stopped = False
    return False
