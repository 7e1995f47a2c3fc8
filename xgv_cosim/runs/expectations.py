"""Holds a finished run against what its scenario expects of it. Pure: no clock, no file.

``by_s`` reads "at this time": the mode is in force, the vehicle stands, whenever that began. So
"drive_by_wire by 50" says something about a vehicle that was paused at 20, although it drove by wire
before as well. For ``no_collision`` and ``min_gap_m`` it reads "up to this time".

``always`` with a mode begins at the vehicle's hand-over: every car starts in software pause while the
world's driver still drives, and no mode but that one could ever hold from the first tick on.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.metrics.standstill import is_held, is_slow, stops_of
from xgv_cosim.scenario.problems import word_hint

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from xgv_cosim.columns import BoolColumn, FloatColumn
    from xgv_cosim.scenario.model import ExpectationSection

_TOLERANCE_S = 1e-6
"""Far below the control tick; forgives the rounding of times."""
_NO_MOTION = "nothing was recorded of its motion"


class Outcome(StrEnum):
    """What came of one expectation."""

    OK = "ok"
    FAILED = "failed"
    NOT_REACHED = "not_reached"
    """The run ended too early to say; what it showed until then was as expected."""


@dataclass(frozen=True, slots=True)
class VehicleFacts:
    """What one bound vehicle did; measured values, all times since the start of the run.

    ``speed_mps`` belongs to ``t_s``, shape ``(k,)``, ascending; the gaps to ``gap_t_s`` likewise. They may
    be empty where they are not known.
    """

    t_s: FloatColumn
    speed_mps: FloatColumn
    """Negative in reverse."""
    gap_t_s: FloatColumn
    """Times with a gap; enough of them that the least gap up to any time is among them."""
    gap_ahead_m: FloatColumn
    """Bumper to bumper, ``inf`` without a vehicle ahead, NaN where unknown."""
    gap_behind_m: FloatColumn
    """Bumper to bumper, ``inf`` without a vehicle behind, NaN where unknown."""
    mode_t_s: Sequence[float]
    """When each of ``modes`` came into force, ascending; exact to the control tick."""
    modes: Sequence[str]
    """Safety modes by name, in the order in which they came into force."""
    handover_s: float = -np.inf
    """Since when the computer has the vehicle; ``always`` does not look at modes before."""


@dataclass(frozen=True, slots=True)
class CollisionFact:
    """One contact that the world reported."""

    t_s: float
    vehicles: tuple[str, str]
    """Collider and victim."""


@dataclass(frozen=True, slots=True)
class RunFacts:
    """What a run did."""

    end_s: float
    """Time at which the run ended."""
    duration_s: float
    """Time at which it should have ended; later than ``end_s`` for a run that was cut short."""
    vehicles: Mapping[str, VehicleFacts]
    """Facts of each vehicle that was ever bound, by id."""
    collisions: Sequence[CollisionFact] = field(default=())

    @property
    def is_complete(self) -> bool:
        """Return whether the run went on to its end."""
        return self.end_s >= self.duration_s - _TOLERANCE_S


@dataclass(frozen=True, slots=True)
class ExpectationResult:
    """One expectation, what came of it, and what was seen."""

    expected: str
    """For example ``xgv_2: mode estop_pause at 20.1 s``."""
    seen: str
    """For example ``in force since 20.00 s``."""
    outcome: Outcome

    @property
    def text(self) -> str:
        """Return both as one line."""
        return f"{self.expected}: {self.seen}"


def evaluate(expectations: Sequence[ExpectationSection], facts: RunFacts) -> list[ExpectationResult]:
    """Return what came of each expectation, in order."""
    return [_evaluate(row, facts) for row in expectations]


def _evaluate(row: ExpectationSection, facts: RunFacts) -> ExpectationResult:
    expected = describe(row)
    if row.vehicle is not None and row.vehicle not in facts.vehicles:
        return ExpectationResult(expected, _unknown(row.vehicle, tuple(facts.vehicles)), Outcome.FAILED)
    check = {"mode": _mode, "standstill": _standstill, "no_collision": _no_collision, "min_gap_m": _min_gap}
    outcome, seen = check[row.what](row, facts)
    if outcome is Outcome.OK and not _can_be_judged(row, facts):
        until = f"the run ended at {_time(facts.end_s)}"
        return ExpectationResult(expected, f"{until}; {seen}" if seen else until, Outcome.NOT_REACHED)
    return ExpectationResult(expected, seen, outcome)


def describe(row: ExpectationSection) -> str:
    """Return an expectation in words."""
    who = row.vehicle or "whole run"
    what = {
        "mode": f"mode {row.mode}",
        "standstill": "standstill",
        "no_collision": "no collision",
        "min_gap_m": f"gaps of at least {row.min_gap_m} m",
    }[row.what]
    if row.by_s is None:
        return f"{who}: {what}, always"
    return f"{who}: {what} {'at' if row.what in {'mode', 'standstill'} else 'up to'} {_time(row.by_s)}"


def _unknown(vehicle_id: str, known: tuple[str, ...]) -> str:
    hint = word_hint(vehicle_id, known)
    shown = ", ".join(known[:6]) + (", ..." if len(known) > 6 else "")
    return f"no such vehicle was ever bound{f' ({hint})' if hint else ''}; bound were: {shown or 'none'}"


def _can_be_judged(row: ExpectationSection, facts: RunFacts) -> bool:
    needed_s = facts.duration_s if row.by_s is None else row.by_s
    return facts.end_s >= needed_s - _TOLERANCE_S


def _time(time_s: float) -> str:
    return f"{round(time_s, 3):g} s"


def _facts_of(row: ExpectationSection, facts: RunFacts) -> VehicleFacts:
    assert row.vehicle is not None  # noqa: S101 - the section refuses mode and standstill without it
    return facts.vehicles[row.vehicle]


def _left_early(vehicle: VehicleFacts, at_s: float, facts: RunFacts) -> str | None:
    """Return a text for a vehicle that was gone at ``at_s``, as far as its samples show it."""
    if vehicle.t_s.size == 0:
        return None
    step_s = float(np.median(np.diff(vehicle.t_s))) if vehicle.t_s.size > 1 else facts.end_s - vehicle.t_s[0]
    last_s = float(vehicle.t_s[-1])
    gone = min(at_s, facts.end_s) > last_s + step_s + _TOLERANCE_S
    return f"it left the simulation at {_time(last_s)}" if gone else None


def _mode(row: ExpectationSection, facts: RunFacts) -> tuple[Outcome, str]:
    vehicle = _facts_of(row, facts)
    spans = [*zip(vehicle.mode_t_s, vehicle.modes, strict=True)]
    if row.by_s is None:
        ended = [t_s <= vehicle.handover_s + _TOLERANCE_S for t_s, _ in spans[1:]] + [False]
        judged = [span for span, is_over in zip(spans, ended, strict=False) if not is_over]
        other = next(((t_s, mode) for t_s, mode in judged if mode != row.mode), None)
        if other is not None:
            return Outcome.FAILED, f"{other[1]} from {_time(other[0])}"
        return (Outcome.OK, _throughout(vehicle)) if spans else (Outcome.FAILED, "it had no mode at all")
    at_s = min(row.by_s, facts.end_s)
    left = _left_early(vehicle, at_s, facts)
    if left is not None:
        return Outcome.FAILED, left
    begun = [(t_s, mode) for t_s, mode in spans if t_s <= at_s + _TOLERANCE_S]
    if not begun:
        return _early_or_failed(
            row, facts, f"it was bound only at {_time(spans[0][0])}" if spans else "it had no mode"
        )
    since_s, mode = begun[-1]
    if mode == row.mode:
        return Outcome.OK, f"in force since {_time(_first_of_last_span(begun))}"
    return _early_or_failed(
        row, facts, f"{mode} since {_time(since_s)}; {_when_in_force(spans, row.mode, facts.end_s)}"
    )


def _throughout(vehicle: VehicleFacts) -> str:
    since = f" since the hand-over at {_time(vehicle.handover_s)}" if vehicle.handover_s > 0.0 else ""
    return f"in force throughout{since}"


def _early_or_failed(row: ExpectationSection, facts: RunFacts, seen: str) -> tuple[Outcome, str]:
    """A state may still come when the run was cut short before ``by_s``."""
    if _can_be_judged(row, facts):
        return Outcome.FAILED, seen
    return Outcome.NOT_REACHED, f"the run ended at {_time(facts.end_s)}; {seen}"


def _first_of_last_span(spans: Sequence[tuple[float, str]]) -> float:
    """Return since when the last mode is in force, though it may be listed more than once."""
    since_s, last = spans[-1]
    for t_s, mode in reversed(spans):
        if mode != last:
            break
        since_s = t_s
    return since_s


def _when_in_force(spans: Sequence[tuple[float, str]], mode: str | None, end_s: float) -> str:
    ends = [t_s for t_s, _ in spans[1:]] + [end_s]
    times = [
        f"{_time(t_s)} to {_time(to_s)}"
        for (t_s, name), to_s in zip(spans, ends, strict=True)
        if name == mode
    ]
    return f"{mode} was in force {', '.join(times)}" if times else f"{mode} was never in force"


def _standstill(row: ExpectationSection, facts: RunFacts) -> tuple[Outcome, str]:
    vehicle = _facts_of(row, facts)
    if vehicle.t_s.size == 0:
        return Outcome.FAILED, _NO_MOTION
    slow = is_slow(vehicle.speed_mps)
    if row.by_s is None:
        return _standstill_always(vehicle, slow)
    return _standstill_at(row, row.by_s, facts, slow)


def _standstill_always(vehicle: VehicleFacts, slow: BoolColumn) -> tuple[Outcome, str]:
    if slow.all():
        return Outcome.OK, "stood throughout"
    first = int(np.argmin(slow))
    return Outcome.FAILED, f"{vehicle.speed_mps[first]:.2f} m/s at {_time(float(vehicle.t_s[first]))}"


def _standstill_at(
    row: ExpectationSection, by_s: float, facts: RunFacts, slow: BoolColumn
) -> tuple[Outcome, str]:
    vehicle = _facts_of(row, facts)
    at_s = min(by_s, facts.end_s)
    left = _left_early(vehicle, at_s, facts)
    if left is not None:
        return Outcome.FAILED, left
    stops = stops_of(vehicle.t_s, slow)
    long_enough = [stop for stop in stops if is_held(*stop)]
    here = [
        stop for stop in stops if stop[0] <= at_s + _TOLERANCE_S and stop[1] >= _last_sample(vehicle, at_s)
    ]
    if here and here[0] in long_enough:
        return Outcome.OK, f"stood since {_time(here[0][0])}"
    still_there = _left_early(vehicle, facts.end_s, facts) is None
    if here and here[0][1] >= vehicle.t_s[-1] and still_there:
        return (
            Outcome.NOT_REACHED,
            f"stood since {_time(here[0][0])} when the run ended at {_time(facts.end_s)}",
        )
    return _early_or_failed(row, facts, _how_it_moved(vehicle, at_s, long_enough))


def _last_sample(vehicle: VehicleFacts, at_s: float) -> float:
    """Return the time of the last sample not after ``at_s``, or of the first one."""
    index = int(np.searchsorted(vehicle.t_s, at_s + _TOLERANCE_S, side="right")) - 1
    return float(vehicle.t_s[max(index, 0)]) - _TOLERANCE_S


def _how_it_moved(vehicle: VehicleFacts, at_s: float, stops: Sequence[tuple[float, float]]) -> str:
    before = vehicle.t_s <= at_s + _TOLERANCE_S
    if not before.any():
        return f"it was bound only at {_time(float(vehicle.t_s[0]))}"
    text = f"{float(vehicle.speed_mps[before][-1]):.2f} m/s at {_time(float(vehicle.t_s[before][-1]))}"
    times = ", ".join(f"{_time(begin)} to {_time(end)}" for begin, end in stops)
    return f"{text}; it stood {times}" if times else f"{text}; it never stood"


def _no_collision(row: ExpectationSection, facts: RunFacts) -> tuple[Outcome, str]:
    until_s = facts.end_s if row.by_s is None else row.by_s
    found = [
        collision
        for collision in facts.collisions
        if collision.t_s <= until_s + _TOLERANCE_S
        and (row.vehicle is None or row.vehicle in collision.vehicles)
    ]
    if not found:
        return Outcome.OK, "none"
    first = min(found, key=lambda collision: collision.t_s)
    more = f", and {len(found) - 1} more" if len(found) > 1 else ""
    return Outcome.FAILED, f"{first.vehicles[0]} hit {first.vehicles[1]} at {_time(first.t_s)}{more}"


def _min_gap(row: ExpectationSection, facts: RunFacts) -> tuple[Outcome, str]:
    until_s = facts.end_s if row.by_s is None else row.by_s
    smallest: tuple[float, float, str, str] | None = None
    chosen = facts.vehicles if row.vehicle is None else {row.vehicle: facts.vehicles[row.vehicle]}
    for vehicle_id, vehicle in chosen.items():
        within = vehicle.gap_t_s <= until_s + _TOLERANCE_S
        for side, gaps_m in (("ahead", vehicle.gap_ahead_m), ("behind", vehicle.gap_behind_m)):
            known = within & ~np.isnan(gaps_m)
            if known.any():
                index = int(np.argmin(gaps_m[known]))
                here = (float(gaps_m[known][index]), float(vehicle.gap_t_s[known][index]), vehicle_id, side)
                smallest = here if smallest is None or here < smallest else smallest
    if smallest is None:
        return Outcome.FAILED, "no gap was measured"
    gap_m, t_s, vehicle_id, side = smallest
    if np.isinf(gap_m):
        return Outcome.OK, "nobody was near"
    whose = f" of {vehicle_id}" if row.vehicle is None else ""
    assert row.min_gap_m is not None  # noqa: S101 - this is the expectation about it
    outcome = Outcome.OK if gap_m >= row.min_gap_m else Outcome.FAILED
    return outcome, f"smallest gap {gap_m:.2f} m {side}{whose} at {_time(t_s)}"
