"""What a contact with a bound vehicle does: both stay where they are, or the run ends, or nothing.

``stay`` is an idealisation: speed 0 at once, no push, no spin. The vehicle's computer goes on; its modes,
messages and axes are what they would be, only the car does not move any more.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from xgv_cosim.columns import BoolColumn
from xgv_cosim.fleet_columns import Motion, copied_motion
from xgv_cosim.simulation.state import RunState
from xgv_cosim.snapshot import Collision, Snapshot
from xgv_cosim.worlds.base import World


class ContactRule(StrEnum):
    """What happens after a contact with a bound vehicle (``world.contact``)."""

    STAY = "stay"
    """Both stay where they are, to the end of the run."""
    END = "end"
    """The run ends with that step."""
    PASS = "pass"  # noqa: S105 - a word, not a password
    """Nothing: they drive on, through each other."""


def note_contacts(state: RunState, world: World, snapshot: Snapshot, rule: ContactRule) -> None:
    """Let the contacts of the last step do what ``rule`` says."""
    if rule is ContactRule.PASS:
        return
    for contact in snapshot.collisions:
        pair = (contact.collider, contact.victim)
        if not any(name in state.vehicles for name in pair):
            continue
        if rule is ContactRule.END:
            state.ended_by = state.ended_by or f"contact of {pair[0]} and {pair[1]} at {state.now_s:g} s"
            continue
        for name, other in (pair, pair[::-1]):
            if name not in state.crashed and name in snapshot.index_of:
                _crash(state, world, contact, name, other)


def _crash(state: RunState, world: World, contact: Collision, name: str, other: str) -> None:
    state.crashed.add(name)
    state.note(name, "crashed", after=other, reasons=(contact.kind,))
    if name in state.vehicles:
        slot = state.fleet.slot_of(name)
        here = np.arange(state.fleet.num_slots) == slot
        state.fleet.motion = _at_rest(state.fleet.motion, state.fleet.motion, here)
        state.fleet.reference.speed_mps[slot] = state.fleet.reference.accel_mps2[slot] = 0.0
    else:
        world.immobilise(name)


def hold_released(state: RunState, world: World, snapshot: Snapshot) -> None:
    """Let the world hold crashed vehicles that are bound no longer."""
    for name in sorted(state.crashed):
        if name not in state.vehicles and name in snapshot.index_of:
            world.immobilise(name)


def crashed_slots(state: RunState) -> BoolColumn:
    """Return which slots hold a crashed vehicle, shape ``(num_slots,)``."""
    column = np.zeros(state.fleet.num_slots, np.bool_)
    if state.crashed:
        column[[slot for slot, name in state.fleet if name in state.crashed]] = True
    return column


def held(state: RunState, before: Motion, after: Motion) -> Motion:
    """Return ``after``, crashed vehicles where they were ``before``, at speed 0."""
    return _at_rest(before, after, crashed_slots(state)) if state.crashed else after


def also_held(state: RunState, by_computer: tuple[BoolColumn, BoolColumn]) -> tuple[BoolColumn, BoolColumn]:
    """Return owners of (speed, steering): no driver of the world's moves a crashed vehicle."""
    if not state.crashed:
        return by_computer
    crashed = crashed_slots(state)
    return by_computer[0] | crashed, by_computer[1] | crashed


def _at_rest(before: Motion, after: Motion, which: BoolColumn) -> Motion:
    motion = copied_motion(after)
    for name in ("x_m", "y_m", "heading_rad"):
        getattr(motion, name)[which] = getattr(before, name)[which]
    for name in ("speed_mps", "accel_mps2", "travelled_m", "speed_error_integral_m"):
        getattr(motion, name)[which] = 0.0
    return motion
