"""The vocabulary in which every mode machine answers: who moves each axis, and how.

Controllers, plant, worlds and metrics read only this. They never learn which make of vehicle it is.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum


class Longitudinal(IntEnum):
    """Who governs speed, and how."""

    CLOSED_LOOP = 0
    """The speed controller follows the commanded speed."""
    OPEN_LOOP = 1
    """Throttle and brake effort are commanded directly."""
    CONTROLLED_STOP = 2
    """Brake at a constant, set deceleration; then hold a set effort (XGV-33, XGV-36)."""
    FULL_BRAKE = 3
    """100 % brake, held at standstill (XGV-31)."""
    MAXIMUM_BRAKING = 4
    """As hard as possible short of lock-up (GKC-24)."""
    HOLD = 5
    """Throttle 0 and the holding brake effort, whatever the speed."""
    FREE = 6
    """Nobody: throttle 0, brake free, the car creeps if it is in gear (XGV-64)."""
    DRIVER = 7
    """The world's own driver, in SUMO the car-following model."""


class Lateral(IntEnum):
    """Who governs steering, and how."""

    CLOSED_LOOP = 0
    """The curvature controller follows the commanded curvature."""
    OPEN_LOOP = 1
    """The road-wheel angle is commanded directly."""
    LATCH_LAST = 2
    """The road-wheel angle stays where it is (GKC-23; XGV-35 ``hold_angle``)."""
    FREE = 3
    """Nobody: the wheel self-aligns or stays (``plant.released_steering``)."""
    DRIVER = 4
    """The world's own driver, in SUMO lane keeping and the lane-change model."""


class Gear(IntEnum):
    """Position of the gear selector (XGV-04, XGV-60)."""

    PARK = 0
    REVERSE = 1
    NEUTRAL = 2
    DRIVE = 3
    LOW = 4


class LostFunction(IntEnum):
    """Actuator functions that an error takes away; bits of one word (XGV-38, ``xgv.errors.effect``)."""

    BRAKE = 1
    STEERING = 2
    THROTTLE = 4
    SPEED_FEEDBACK = 8


class Driver(IntEnum):
    """Who sits in the car and takes an axis that the computer releases (XGV-64, ``bind.driver``)."""

    NONE = 0
    """Nobody."""
    RIDER = 1
    """A safety rider, who takes over after a reaction time."""
    WORLD = 2
    """The world's own driver in the same tick: an idealisation."""


class CouplingKind(StrEnum):
    """How a bound vehicle is written into the world."""

    FREE = "free"
    """Pose and speed from the plant, anywhere."""
    LANE = "lane"
    """Speed and lateral position within the lane that the world keeps."""
    AUTO = "auto"
    """Within the lane while the plant's pose is exact there, freely otherwise."""
