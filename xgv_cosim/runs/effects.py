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
    found: dict[str, float] = {}
    for name, own in by_vehicle(events).items():
        handed = [event.t_s for event in own if event.kind == "handover"]
        cold = any(event.kind == "bound" and "start cold" in event.reasons for event in own)
        started = [event.t_s for event in own if event.kind == "safety_mode"][1:] if cold else []
        if handed or started:
            found[name] = (handed or started)[0]
    return found


def facts_that_acted(events: Sequence[Event]) -> set[str]:
    """Return the facts ``kind`` and ``kind:after`` of all events that had an effect, and three more.

    A safety or control mode acts once the computer has the vehicle; before, the world's driver drives.
    The three more: ``reported:MODE`` (the safety mode was reported, whether or not it acted),
    ``preempted`` (a controller lost a component to another) and ``rearmed`` (drive-by-wire came back
    after a stop that acted and whose injection has ended).
    """
    handed_over = handovers_s(events)
    facts: set[str] = set()
    for name, own in by_vehicle(events).items():
        since_s = handed_over.get(name)
        for event in own:
            acted = since_s is not None and event.t_s >= since_s
            facts.add(event.kind)
            if acted or event.kind not in _ACT_AFTER_THE_HANDOVER:
                facts.add(f"{event.kind}:{event.after}")
            if event.kind == "safety_mode":
                facts.add(f"reported:{event.after}")
            elif event.kind == "component_control" and _is_preemption(event):
                facts.add("preempted")
        if since_s is not None and _is_rearmed(own, since_s):
            facts.add("rearmed")
    return facts


def _is_preemption(event: Event) -> bool:
    """Return whether a component went from one controller to another ("Component: controller")."""
    before, after = (text.rpartition(": ")[2] for text in (event.before, event.after))
    return _NOBODY not in (before, after) and before != after


def _is_rearmed(own: Sequence[Event], since_s: float) -> bool:
    stopped = ended = False
    for event in own:
        if event.kind == "injection" and not event.after:
            ended = stopped
        elif event.kind == "safety_mode" and event.t_s >= since_s:
            if event.after != _DRIVING:
                stopped = True
            elif ended:
                return True
            else:
                stopped = False
    return False
