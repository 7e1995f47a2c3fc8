"""A case of the benchmark: its drives taken in turn, several times, and what comes out in the middle."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.bench.calls import POSE_CALLS, CallLog
from xgv_cosim.bench.drives import (
    HAND_OVER_STEPS,
    BoundSetup,
    Setup,
    drive_bound,
    record_plain,
    time_floor,
    time_plain,
)
from xgv_cosim.bench.extras import STACK_EXTRAS, Extra
from xgv_cosim.bench.traffic import Traffic
from xgv_cosim.errors import ScenarioError
from xgv_cosim.kernel import warm_up

if TYPE_CHECKING:
    from collections.abc import Callable

MOST_VEHICLE_STEPS = 40_000
FEWEST_STEPS = 20
MOST_STEPS = 200
LONGEST_STEPS = 500
"""More than this, and the commands of a drive would end before it."""


def usual_steps(num_vehicles: int) -> int:
    """Return how many world steps are timed unless told: more for few vehicles, whose steps are short."""
    return max(FEWEST_STEPS, min(MOST_STEPS, MOST_VEHICLE_STEPS // num_vehicles))


@dataclass(frozen=True, slots=True)
class Case:
    """What is measured.

    Raises:
        ScenarioError: A number is out of range, or two of the extras exclude each other.
    """

    traffic: Traffic
    coupling: CouplingKind
    share: float = 1.0
    """How many of the vehicles are bound: all, or every second, third, ..."""
    extras: frozenset[Extra] = frozenset()
    steady: bool = False
    """Targets stay as they are, instead of changing in each step."""
    steps: int = 0
    """World steps that are timed; 0: as many as is usual for so many vehicles."""

    def __post_init__(self) -> None:
        if not 0.0 < self.share <= 1.0:
            raise ScenarioError(f"share: got {self.share:g}, expected more than 0 and at most 1")
        if not 0 <= self.steps <= LONGEST_STEPS:
            raise ScenarioError(f"steps: got {self.steps}, expected 1 to {LONGEST_STEPS}")
        if len(self.extras & STACK_EXTRAS) > 1:
            names = ", ".join(sorted(self.extras & STACK_EXTRAS))
            raise ScenarioError(f"with: got {names} together, expected one of them: a car has one stack")

    @property
    def timed_steps(self) -> int:
        """Return how many world steps are timed."""
        return self.steps or usual_steps(self.traffic.num_vehicles)


@dataclass(frozen=True, slots=True)
class Cost:
    """What a case costs; times are medians of the repeats, processor time in µs per world step."""

    case: Case
    num_bound: int
    plain_us: float
    bound_us: float
    floor_us: float
    ratio_to_plain: float
    """Median of the repeats' own ratios: the machine drifts, but not much within one of them."""
    ratio_to_floor: float
    emulator_us: float
    """Per bound vehicle and world step: all but the world, and without the extras."""
    extras_us: float | None
    """Per bound vehicle and world step: what the extras add; None without any."""
    in_lane_frame: float
    """Share of cars and steps that were written as speed and lateral position in the lane."""
    beside_m: float
    """How far a car was from the way of SUMO's driver at most."""
    floor_off_m: float
    """How far apart a car was at the end of floor and bound drive at most."""
    calls: dict[str, float]
    """Commands to SUMO per bound vehicle and world step that place it."""
    other_calls: dict[str, float]
    """Further ones, hand-over included, which the floor does without once the cars are handed over."""


def measure(case: Case, repeats: int = 3, tell: Callable[[str], None] | None = None) -> Cost:
    """Measure one case.

    Args:
        case: What.
        repeats: How often each drive is timed; they take turns.
        tell: Told of each drive before it begins.

    Raises:
        ScenarioError: The network has no room for so many vehicles.
        WorldError: SUMO failed, or a simulation is open in this process.
    """
    if repeats < 1:
        raise ScenarioError(f"repeat: got {repeats}, expected 1 or more")
    say = tell or (lambda _: None)
    warm_up()
    driving = BoundSetup(case.coupling, case.share, steady=case.steady)
    with tempfile.TemporaryDirectory(prefix="xgv-cosim-bench-") as folder:
        setup = Setup(case.traffic, case.traffic.write(Path(folder)), case.timed_steps)
        say("recording SUMO's drivers")
        recording = record_plain(setup)
        log = CallLog()
        say("recording the calls of a bound drive")
        recorded = drive_bound(setup, driving, recording, log)
        times: list[tuple[float, ...]] = []
        off_m = 0.0
        for number in range(1, repeats + 1):
            say(f"SUMO alone, {number} of {repeats}")
            plain_us = time_plain(setup)
            say(f"bound, {number} of {repeats}")
            bound = drive_bound(setup, driving, recording)
            say(f"floor, {number} of {repeats}")
            floor_us, end_m = time_floor(setup, log, bound.ids)
            with_us = bound.step_us
            if case.extras:
                say(f"bound, with {', '.join(sorted(case.extras))}, {number} of {repeats}")
                with_us = drive_bound(setup, driving._replace(extras=case.extras), recording).step_us
            off_m = max(off_m, float(np.hypot(*(end_m - bound.end_m).T).max()))
            times.append((plain_us, bound.step_us, floor_us, bound.emulator_us, with_us))
    num_bound = len(recorded.ids)
    plain, bare, floor, emulator, total = np.array(times).T
    counts = log.counts(HAND_OVER_STEPS)
    per_car = 1.0 / (num_bound * setup.steps)
    return Cost(
        case=case,
        num_bound=num_bound,
        plain_us=_middle(plain),
        bound_us=_middle(total),
        floor_us=_middle(floor),
        ratio_to_plain=_middle(total / plain),
        ratio_to_floor=_middle(total / floor),
        emulator_us=_middle(emulator) / num_bound,
        extras_us=_middle(total - bare) / num_bound if case.extras else None,
        in_lane_frame=recorded.in_lane_frame,
        beside_m=recorded.beside_m,
        floor_off_m=off_m,
        calls={name: counts[name] * per_car for name in POSE_CALLS if counts[name]},
        other_calls={
            name: number * per_car for name, number in sorted(log.counts(0).items()) if name not in POSE_CALLS
        },
    )


def _middle(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(np.median(values))
