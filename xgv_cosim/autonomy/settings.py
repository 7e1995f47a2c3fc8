"""What the reference stacks want of the road and of their car."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ReferenceStackSettings:
    """What the reference stack wants of the road."""

    desired_speed_mps: float | None = None
    """Speed on a free road; None: the lane's limit."""
    time_headway_s: float = 1.4
    standstill_gap_m: float = 3.0
    """To the leader."""
    stop_line_gap_m: float = 1.0
    """To a line before which it waits."""
    max_accel_mps2: float = 1.5
    comfortable_decel_mps2: float = 2.0
    hardest_decel_mps2: float = 7.5
    lost_decel_mps2: float = 3.0
    """Braking when there is no lane to follow."""
    yellow_decel_mps2: float = 3.0
    """It stops at yellow if this is enough."""
    lookahead_time_s: float = 0.7
    shortest_lookahead_m: float = 4.0
    max_lateral_accel_mps2: float = 3.0
    """In steering."""
    curve_lateral_accel_mps2: float = 2.0
    """For which it slows down before curves."""
    curve_rate_per_m_s: float = 0.1
    """Change of curvature for which it slows down before curves."""
    max_curvature_rate_per_m_s: float = 0.15
    motion_duration_s: float = 0.4
    """Public clients send 200 to 2000 ms (XGV-43)."""
    authority: int = 6
