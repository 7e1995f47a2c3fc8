"""The reference stack: drives along its route through motion profiles.

It behaves as a client of the real car does: it asks for the Motion Profile Driver, resumes both
drivers until they are ready, and repeats a short motion profile at every step (XGV-19, XGV-43). What
keeps the car from driving on, an engine that stands or a parking brake that is set, it undoes where it is
allowed to: the engine also in a pause, the parking brake in drive-by-wire only (XGV-16, XGV-34).
"""

from __future__ import annotations

from jaus.address import JausAddress
from xgv_cosim.autonomy.driving import RouteDriving, Wish
from xgv_cosim.autonomy.longitudinal import free_speed_mps
from xgv_cosim.autonomy.session import closed_loop_session
from xgv_cosim.autonomy.settings import ReferenceStackSettings
from xgv_cosim.commands import MotionProfile
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.observation import Observation

__all__ = ["ReferenceStack", "ReferenceStackSettings"]


class ReferenceStack:
    """Drives one vehicle along its route behind its leader.

    Args:
        address: The JAUS address under which it speaks, to know whether it has control.
        settings: What it wants of the road.
    """

    def __init__(self, address: JausAddress, settings: ReferenceStackSettings | None = None) -> None:
        self._address = address
        self._settings = settings or ReferenceStackSettings()
        self._driving = RouteDriving(self._settings)

    def act(self, observation: Observation) -> list[StackMessage]:
        """Return the messages of one cycle: session first, then the motion profile."""
        wish = self._driving.wish(observation)
        messages = closed_loop_session(
            observation,
            self._address,
            self._settings.authority,
            takes_over=self._driving.may_take_over(observation, wish),
        )
        messages.append(self._motion(observation, wish))
        return messages

    def _motion(self, seen: Observation, wish: Wish) -> MotionProfile:
        # The profile's target lies a second ahead on the wanted acceleration; the limit sets its slope.
        target_mps = max(0.0, seen.speed_mps + wish.accel_mps2)
        return MotionProfile(
            speed_mps=min(target_mps, max(0.0, free_speed_mps(seen, self._settings))),
            max_accel_mps2=max(0.3, abs(wish.accel_mps2)),
            curvature_per_m=wish.curvature_per_m,
            max_curvature_rate_per_m_s=self._settings.max_curvature_rate_per_m_s,
            duration_s=self._settings.motion_duration_s,
        )
