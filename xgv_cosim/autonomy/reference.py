"""The reference stack: keeps its lane and its distance through motion profiles.

It behaves as a client of the real car does: it asks for the Motion Profile Driver, resumes both
drivers until they are ready, and repeats a short motion profile at every step (XGV-19, XGV-43). What
keeps the car from driving on, an engine that stands or a parking brake that is set, it undoes where it is
allowed to: the engine also in a pause, the parking brake in drive-by-wire only (XGV-16, XGV-34).

Speed follows the intelligent driver model (Treiber, Hennecke and Helbing, Phys. Rev. E 62, 2000):
``a = A (1 - (v/v0)^4 - (s*/s)^2)`` with ``s* = s0 + v T + v (v - v_leader) / (2 sqrt(A B))``.
Steering is pure pursuit (Coulter, CMU-RI-TR-92-01): the arc through the rear axle, tangent to the
heading, that meets the lane's centre line at the look-ahead distance: ``curvature = 2 y / d^2``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from xgv_cosim.commands import DiscreteDevices, MotionProfile
from xgv_cosim.endpoint import CommandStatus, ReleaseControl, RequestControl, StackMessage
from xgv_cosim.observation import Observation

PD = ComponentId.PRIMITIVE_DRIVER
MPD = ComponentId.MOTION_PROFILE_DRIVER


DRIVES = "drive_by_wire"
PAUSES = frozenset({"software_pause", "estop_pause"})
"""Safety modes in which the engine may be started although the car may not drive (XGV-34)."""


@dataclass(frozen=True, slots=True)
class ReferenceStackSettings:
    """What the reference stack wants of the road."""

    desired_speed_mps: float | None = None
    """Speed on a free road; None: the lane's limit."""
    time_headway_s: float = 1.4
    standstill_gap_m: float = 3.0
    max_accel_mps2: float = 1.5
    comfortable_decel_mps2: float = 2.0
    hardest_decel_mps2: float = 7.5
    lost_decel_mps2: float = 3.0
    """Braking when there is no lane to follow."""
    lookahead_time_s: float = 1.0
    shortest_lookahead_m: float = 8.0
    max_lateral_accel_mps2: float = 3.0
    max_curvature_rate_per_m_s: float = 0.1
    motion_duration_s: float = 0.4
    """Public clients send 200 to 2000 ms (XGV-43)."""
    authority: int = 6


class ReferenceStack:
    """Drives one vehicle along its lane behind its leader.

    Args:
        address: The JAUS address under which it speaks, to know whether it has control.
        settings: What it wants of the road.
    """

    def __init__(self, address: JausAddress, settings: ReferenceStackSettings | None = None) -> None:
        self._address = address
        self._settings = settings or ReferenceStackSettings()

    def act(self, observation: Observation) -> list[StackMessage]:
        """Return the messages of one cycle: session first, then the motion profile."""
        messages = self._session(observation)
        messages.append(self._motion(observation))
        return messages

    def _session(self, seen: Observation) -> list[StackMessage]:
        """Return what is missing for closed-loop control, in the order of the public clients."""
        messages: list[StackMessage] = []
        if seen.component_controller[MPD] != self._address:
            if seen.component_controller[PD] == self._address:
                messages.append(ReleaseControl(PD))
            messages.append(RequestControl(MPD, self._settings.authority))
        messages.extend(
            CommandStatus(component, StatusCommand.RESUME)
            for component in (PD, MPD)
            if seen.component_status[component] == ComponentStatus.STANDBY
        )
        return messages + self._devices(seen)

    def _devices(self, seen: Observation) -> list[StackMessage]:
        """Return what makes a car drive again that stands with its engine off or its parking brake set.

        Only as the one who controls it: a car that another drives is his.
        """
        if seen.component_controller[MPD] != self._address:
            return []
        drives = seen.safety_mode == DRIVES
        starts = not seen.devices.engine_on and (drives or seen.safety_mode in PAUSES)
        releases = seen.devices.parking_brake and drives
        if not (starts or releases):
            return []
        return [DiscreteDevices(engine_on=starts or None, parking_brake=False if releases else None)]

    def _motion(self, seen: Observation) -> MotionProfile:
        accel_mps2 = self.wanted_accel_mps2(seen) if seen.lane_ahead_m else -self._settings.lost_decel_mps2
        # The profile's target lies a second ahead on the wanted acceleration; the limit sets its slope.
        target_mps = max(0.0, seen.speed_mps + accel_mps2)
        return MotionProfile(
            speed_mps=min(target_mps, self._free_speed_mps(seen)),
            max_accel_mps2=max(0.3, abs(accel_mps2)),
            curvature_per_m=self.wanted_curvature_per_m(seen),
            max_curvature_rate_per_m_s=self._settings.max_curvature_rate_per_m_s,
            duration_s=self._settings.motion_duration_s,
        )

    def _free_speed_mps(self, seen: Observation) -> float:
        wanted = self._settings.desired_speed_mps
        return seen.limit_mps if wanted is None else min(wanted, seen.limit_mps)

    def wanted_accel_mps2(self, seen: Observation) -> float:
        """Return the intelligent driver model's acceleration, limited to what the car can do."""
        settings = self._settings
        speed, gap = max(0.0, seen.speed_mps), max(0.1, seen.leader_gap_m)
        accel = settings.max_accel_mps2 * (1.0 - (speed / max(0.1, self._free_speed_mps(seen))) ** 4)
        if math.isfinite(gap):
            closing = speed - seen.leader_speed_mps
            geometric = math.sqrt(settings.max_accel_mps2 * settings.comfortable_decel_mps2)
            dynamic = speed * settings.time_headway_s + speed * closing / (2.0 * geometric)
            wanted_gap = settings.standstill_gap_m + max(0.0, dynamic)
            accel -= settings.max_accel_mps2 * (wanted_gap / gap) ** 2
        return min(max(accel, -settings.hardest_decel_mps2), settings.max_accel_mps2)

    def wanted_curvature_per_m(self, seen: Observation) -> float:
        """Return the pure-pursuit curvature towards the lane's centre line, positive to the left."""
        settings = self._settings
        if not seen.lane_ahead_m:
            return 0.0
        lookahead = max(settings.shortest_lookahead_m, seen.speed_mps * settings.lookahead_time_s)
        x, y = _point_at(seen.lane_ahead_m, lookahead)
        curvature = 2.0 * y / max(1.0, x * x + y * y)
        limit = settings.max_lateral_accel_mps2 / max(1.0, seen.speed_mps) ** 2
        return min(max(curvature, -limit), limit)


def _point_at(points: tuple[tuple[float, float], ...], distance_m: float) -> tuple[float, float]:
    """Return the point of a polyline at a distance from the origin, the last one if it ends before."""
    for (x0, y0), (x1, y1) in pairwise(points):
        near, far = math.hypot(x0, y0), math.hypot(x1, y1)
        if near <= distance_m <= far:
            share = (distance_m - near) / max(1e-9, far - near)
            return x0 + share * (x1 - x0), y0 + share * (y1 - y0)
    return points[-1] if math.hypot(*points[0]) < distance_m else points[0]
