"""``when`` of an injection: what must hold of a vehicle before something happens to it."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from xgv_cosim.condition import Condition, Disc
from xgv_cosim.scenario.section import Section

ModeName = Literal[
    "drive_by_wire",
    "software_pause",
    "estop_pause",
    "manual_override",
    "emergency_manual_override",
    "estop_disable",
    "inactive",
]
"""Safety modes that a vehicle may be expected to be in."""


class DiscSection(Section):
    """A place: all points within a distance of its centre, in the world's coordinates."""

    x_m: float
    """East of the world's origin."""
    y_m: float
    """North of the world's origin."""
    radius_m: Annotated[float, Field(gt=0)]
    """Distance from the centre."""


class ModeOfSection(Section):
    """Another bound vehicle that is in a safety mode."""

    vehicle: Annotated[str, Field(min_length=1)]
    """Its id."""
    mode: ModeName
    """The safety mode."""


class ConditionSection(Section):
    """What must hold of a vehicle, all that is given at once, at the end of a world step."""

    speed_above_mps: Annotated[float, Field(ge=0)] | None = None
    """It is faster than this."""
    speed_below_mps: Annotated[float, Field(gt=0)] | None = None
    """It is slower than this."""
    gap_below_m: Annotated[float, Field(gt=0)] | None = None
    """The gap to its leader, bumper to bumper, is less."""
    lane: Annotated[str, Field(min_length=1)] | None = None
    """It is on this lane of the world (in SUMO: EDGE_NUMBER), or on one that the pattern means: ramp_*."""
    position_above_m: Annotated[float, Field(ge=0)] | None = None
    """Its front is further than this from the beginning of its lane."""
    near: DiscSection | None = None
    """Its front is within a distance of a point."""
    mode_of: ModeOfSection | None = None
    """Another bound vehicle is in a safety mode."""

    @model_validator(mode="after")
    def _asks_for_something(self) -> Self:
        names = type(self).model_fields
        if all(getattr(self, name) is None for name in names):
            raise ValueError(f"expected at least one of {', '.join(names)}")
        if self.position_above_m is not None and self.lane is None:
            raise ValueError("position_above_m counts from the beginning of a lane; say which 'lane' too")
        return self

    def condition(self) -> Condition:
        """Return it as the simulation takes it."""
        return Condition(
            speed_above_mps=self.speed_above_mps,
            speed_below_mps=self.speed_below_mps,
            gap_below_m=self.gap_below_m,
            lanes=self.lane,
            position_above_m=self.position_above_m,
            near=None if self.near is None else Disc(self.near.x_m, self.near.y_m, self.near.radius_m),
            other=None if self.mode_of is None else (self.mode_of.vehicle, self.mode_of.mode),
        )
