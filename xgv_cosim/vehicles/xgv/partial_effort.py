"""Set Wrench Effort with fewer than its three axes (XGV-59)."""

from __future__ import annotations

from dataclasses import dataclass

from xgv_cosim.commands import MotionProfile, WrenchEffort

NO_EFFORT = WrenchEffort(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class PartialWrenchEffort(WrenchEffort):
    """Efforts of which some axes are left out; what those are is decided when it acts (XGV-59).

    An axis that is left out has the value 0 here, which means nothing.
    """

    gives_throttle: bool = True
    gives_brake: bool = True
    gives_steering: bool = True

    def completed(self, in_force: MotionProfile | WrenchEffort | None) -> WrenchEffort:
        """Return all three axes; those left out keep what is in force, and are none where no effort is.

        Args:
            in_force: The command of the same sender that the car executes now.
        """
        kept = in_force if isinstance(in_force, WrenchEffort) else NO_EFFORT
        return WrenchEffort(
            throttle=self.throttle if self.gives_throttle else kept.throttle,
            brake=self.brake if self.gives_brake else kept.brake,
            steering=self.steering if self.gives_steering else kept.steering,
        )
