"""The ledger's facts: only what had an effect counts."""

from __future__ import annotations

import dataclasses

from xgv_cosim.events import Event
from xgv_cosim.runs.effects import facts_that_acted, handovers_s


def mode(t_s: float, name: str) -> Event:
    return Event(t_s, "xgv_0", "safety_mode", after=name)


BOUND = Event(0.0, "xgv_0", "bound", after="xgv", reasons=("coupling free", "start handover"))
COLD = Event(0.0, "xgv_0", "bound", after="xgv", reasons=("coupling free", "start cold"))
START = (
    mode(0.0, "software_pause"),
    Event(0.2, "xgv_0", "component_control", "Primitive Driver: nobody", "Primitive Driver: 1-2-2-1"),
    mode(0.4, "drive_by_wire"),
    Event(0.4, "xgv_0", "handover", "world_driver", "computer"),
)
PAUSE = (Event(5.0, "xgv_0", "injection", after="estop_pause"), mode(5.0, "estop_pause"))
ENDED = Event(9.0, "xgv_0", "injection", before="estop_pause")


def test_starting_up_exercises_no_pause_no_rearming_and_no_preemption() -> None:
    """XGV-36, XGV-37 and XGV-20: until the hand-over the world's driver drives."""
    facts = facts_that_acted([BOUND, *START])
    assert facts.isdisjoint({"safety_mode:software_pause", "rearmed", "preempted"})
    assert {"reported:software_pause", "safety_mode:drive_by_wire", "handover"} <= facts


def test_changes_on_the_very_tick_of_the_handover_count_by_their_order() -> None:
    """A stack that is quick takes control on the tick of binding."""
    at_once = [dataclasses.replace(event, t_s=0.1) for event in (BOUND, *START)]
    assert facts_that_acted(at_once) == facts_that_acted([BOUND, *START])


def test_a_pause_after_the_handover_acts_and_rearms_when_it_ends() -> None:
    paused = [BOUND, *START, *PAUSE]
    assert "safety_mode:estop_pause" in facts_that_acted(paused)
    assert "rearmed" not in facts_that_acted(paused)
    assert "rearmed" in facts_that_acted([*paused, ENDED, mode(9.0, "drive_by_wire")])


def test_drive_by_wire_that_no_injections_end_brought_back_is_no_rearming() -> None:
    """A command that came late paused the car; XGV-37 is about stop demands that end."""
    late = [mode(6.0, "software_pause"), mode(7.0, "drive_by_wire")]
    assert "rearmed" not in facts_that_acted([BOUND, *START, *late])


def test_a_stop_that_forces_the_handover_acts_from_that_tick_on() -> None:
    forced = [BOUND, START[0], mode(1.0, "estop_disable"), Event(1.0, "xgv_0", "handover")]
    assert "safety_mode:estop_disable" in facts_that_acted(forced)
    assert "safety_mode:software_pause" not in facts_that_acted(forced)


def test_preemption_is_one_controller_after_another() -> None:
    taken = Event(3.0, "xgv_0", "component_control", "Primitive Driver: 1-2-2-1", "Primitive Driver: 9-1-2-1")
    lost = Event(3.0, "xgv_0", "component_control", "Primitive Driver: 1-2-2-1", "Primitive Driver: nobody")
    assert "preempted" in facts_that_acted([BOUND, *START, taken])
    assert "preempted" not in facts_that_acted([BOUND, *START, lost])


def test_the_time_of_the_handover() -> None:
    assert handovers_s([BOUND, START[0]]) == {}
    assert handovers_s([BOUND, *START]) == {"xgv_0": 0.4}
    assert handovers_s([COLD, *START[:3]]) == {"xgv_0": 0.4}
