"""Signals and right of way: before which lines a car has to wait.

It yields by times: each foe is in the area where the ways meet from the earliest moment at which he can
be there until he has left it; the car goes where it has left the area before, or comes after.
"""

from __future__ import annotations

import math

from xgv_cosim.autonomy.longitudinal import curve_mps
from xgv_cosim.autonomy.settings import ReferenceStackSettings
from xgv_cosim.observation import Observation
from xgv_cosim.surroundings import Foe, Junction

FOE_ACCEL_MPS2 = 1.5
"""So hard a foe is taken to speed up towards the place where the ways meet."""
OWN_ACCEL_MPS2 = 1.2
BEFORE_S = 1.2
"""So long before a foe comes the car has to have left."""
AFTER_S = 0.4
"""So long after a foe has left it may come."""
STANDS_MPS = 0.3
PATIENCE_S = 4.0
"""So long the car waits for a foe with the right of way who stands."""
AT_LINE_M = 4.0
"""Nearer than this it stands at the line."""
BEYOND_STOPPING_MPS2 = 6.0
"""A line that could only be kept with harder braking is crossed."""
OCCUPIED_GAP_M = 4.5
"""Room to somebody who stands where the ways meet: he may stand askew, so that he reaches further."""
CLEARANCE_M = 2.0
"""Room to be kept behind the own car on the far side of a junction."""


def arrival_s(distance_m: float, speed_mps: float, accel_mps2: float, top_mps: float = math.inf) -> float:
    """Return when somebody who speeds up, but not beyond ``top_mps``, is at a distance."""
    if distance_m <= 0.0:
        return 0.0
    if speed_mps >= top_mps:
        return distance_m / top_mps
    faster_m = (top_mps * top_mps - speed_mps * speed_mps) / (2.0 * accel_mps2)
    if distance_m > faster_m:
        return (top_mps - speed_mps) / accel_mps2 + (distance_m - faster_m) / top_mps
    return (math.sqrt(speed_mps**2 + 2.0 * accel_mps2 * distance_m) - speed_mps) / accel_mps2


def needed_decel_mps2(speed_mps: float, distance_m: float) -> float:
    """Return the deceleration that stops within a distance."""
    return speed_mps * speed_mps / (2.0 * max(0.1, distance_m))


def turn_mps(seen: Observation, distance_m: float, settings: ReferenceStackSettings) -> float:
    """Return the speed to which the curves on the next metres hold the car."""
    tightest = max((abs(per_m) for at_m, per_m in seen.curvature_ahead if at_m <= distance_m), default=0.0)
    return min(max(0.1, seen.limit_mps), curve_mps(tightest, settings))


class Crossings:
    """Decides before which lines to wait; remembers how long it has waited at the present one."""

    def __init__(self, settings: ReferenceStackSettings) -> None:
        self._settings = settings
        self._waits_since_s: float | None = None
        self._stood = False
        self._line_m = math.inf

    def stop_m(self, seen: Observation) -> float:
        """Return how far ahead the front bumper has to stop, ``inf``: nowhere."""
        return min(self._signal_m(seen), self._junction_m(seen))

    def _signal_m(self, seen: Observation) -> float:
        """Return where to stop for a signal: at red always, at yellow if it can."""
        signal, settings = seen.signal, self._settings
        if signal is None or signal.colour not in {"red", "yellow"}:
            return math.inf
        needed = needed_decel_mps2(seen.speed_mps, signal.line_m)
        enough = settings.yellow_decel_mps2 if signal.colour == "yellow" else settings.hardest_decel_mps2
        return signal.line_m - settings.stop_line_gap_m if needed <= enough else math.inf

    def _junction_m(self, seen: Observation) -> float:
        junction = seen.junction
        if junction is None:
            self._line_m, self._waits_since_s, self._stood = math.inf, None, False
            return math.inf
        if junction.line_m > self._line_m + 2.0:
            self._waits_since_s, self._stood = None, False
        self._line_m = junction.line_m
        if junction.line_m < AT_LINE_M and seen.speed_mps < STANDS_MPS:
            self._stood = True
            if self._waits_since_s is None:
                self._waits_since_s = seen.time_s
        stop_m = self._occupied_m(seen, junction)
        stoppable = needed_decel_mps2(seen.speed_mps, junction.line_m) < BEYOND_STOPPING_MPS2
        if junction.line_m > 0.0 and stoppable and self._has_to_wait(seen, junction):
            stop_m = min(stop_m, junction.line_m - self._settings.stop_line_gap_m)
        return stop_m

    def _has_to_wait(self, seen: Observation, junction: Junction) -> bool:
        """Return whether the car may not cross the junction's line now."""
        if self._would_block(seen, junction):
            return True
        if junction.right_of_way in {"stop", "allway_stop"} and not self._stood:
            return True
        waited_s = 0.0 if self._waits_since_s is None else seen.time_s - self._waits_since_s
        return any(
            not self._passes(seen, junction, foe)
            for foe in junction.foes
            if foe.first
            and not (waited_s > PATIENCE_S and foe.speed_mps < STANDS_MPS and foe.foe_entry_m > 1.0)
        )

    def _would_block(self, seen: Observation, junction: Junction) -> bool:
        """Return whether there is no room behind the junction, so that others could not cross."""
        if not (junction.foes or junction.must_yield) or seen.leader_speed_mps > 2.0:
            return False
        room_m = seen.leader_gap_m - junction.exit_m
        return -0.5 * seen.length_m < room_m < seen.length_m + CLEARANCE_M

    def _passes(self, seen: Observation, junction: Junction, foe: Foe) -> bool:
        """Return whether the car crosses before a foe comes, or enters the junction after he has left.

        Not only the place where the ways meet: a foe brakes for whoever enters before him.
        """
        accel, top_mps = OWN_ACCEL_MPS2, turn_mps(seen, foe.own_exit_m, self._settings)
        in_s = arrival_s(min(foe.own_entry_m, junction.line_m), seen.speed_mps, accel)
        out_s = arrival_s(foe.own_exit_m + seen.length_m, seen.speed_mps, accel, top_mps)
        foe_top_mps = max(foe.speed_mps, seen.limit_mps)
        foe_in_s = arrival_s(foe.foe_entry_m, foe.speed_mps, FOE_ACCEL_MPS2, foe_top_mps)
        foe_out_s = max(0.0, foe.foe_exit_m + foe.length_m) / max(0.5, foe.speed_mps)
        return out_s + BEFORE_S < foe_in_s or (
            foe_out_s + AFTER_S < in_s and (foe.speed_mps > STANDS_MPS or foe.foe_entry_m <= 0.0)
        )

    def _occupied_m(self, seen: Observation, junction: Junction) -> float:
        """Return where to stop for those who are where the ways meet, right of way or not."""
        found = math.inf
        for foe in junction.foes:
            if foe.foe_entry_m > 0.0 or foe.own_entry_m <= 0.0:
                continue
            foe_out_s = max(0.0, foe.foe_exit_m + foe.length_m) / max(0.3, foe.speed_mps)
            if arrival_s(foe.own_entry_m, seen.speed_mps, OWN_ACCEL_MPS2) < foe_out_s + AFTER_S:
                found = min(found, max(0.0, foe.own_entry_m - OCCUPIED_GAP_M))
        return found
