"""A scenario as data: one run's world, bound vehicles, settings, injections and expectations."""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator, model_validator

from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.scenario.checks import disagreements
from xgv_cosim.scenario.condition_section import ModeName
from xgv_cosim.scenario.safestop_section import SafeStopSection
from xgv_cosim.scenario.section import Section
from xgv_cosim.scenario.sections import (
    BindSection,
    ExpectationSection,
    InjectionSection,
    Selector,
    SumoSection,
    VehicleQuery,
    WorldSection,
)
from xgv_cosim.scenario.source import ScenarioSource
from xgv_cosim.scenario.xgv_section import XgvSection

__all__ = [
    "DISAGREEMENTS_LATER",
    "SCHEMA",
    "BindSection",
    "ExpectationSection",
    "InjectionSection",
    "ModeName",
    "SafeStopSection",
    "Scenario",
    "Selector",
    "SumoSection",
    "VehicleQuery",
    "WorldSection",
    "XgvSection",
    "json_schema",
]

SCHEMA: Final = "xgv-cosim/scenario/1"
"""Name and version of the file format."""

DISAGREEMENTS_LATER = "disagreements_later"
"""Key of the validation context: the caller looks for disagreements between sections itself."""


class Scenario(Section):
    """One run as data: what is simulated, what happens to whom, and what has to come of it."""

    schema_name: Literal["xgv-cosim/scenario/1"] = Field(default=SCHEMA, alias="schema")
    """Name and version of this file format."""
    name: Annotated[str, Field(min_length=1, pattern=r"^[A-Za-z0-9_.-]+$")]
    """Short name; run folders are named after it."""
    description: str = ""
    """One line: what the scenario shows."""
    duration_s: Annotated[float, Field(gt=0)]
    """Length of the run in simulated seconds, rounded up to whole world steps."""
    step_s: Annotated[float, Field(gt=0, le=0.3)] = 0.1
    """World step, a whole multiple of 0.01 s, at most 0.3 s: a stack's command lives 0.4 s."""
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 1
    """Seed of everything random in the run."""
    world: WorldSection
    """The traffic around the bound vehicles."""
    bind: tuple[BindSection, ...] = ()
    """Which vehicles are bound, and as what; for a vehicle that several rows match, the first row counts."""
    xgv: XgvSection = XgvSection()
    """Settings of all vehicles with profile xgv."""
    safestop: SafeStopSection = SafeStopSection()
    """Radio and receivers of the wireless emergency stop."""
    injections: tuple[InjectionSection, ...] = ()
    """What happens to which vehicles, from when to when."""
    expect: tuple[ExpectationSection, ...] = ()
    """What the run has to show."""

    _source: ScenarioSource = PrivateAttr(default_factory=ScenarioSource)

    @field_validator("step_s")
    @classmethod
    def _step_is_whole_ticks(cls, step_s: float) -> float:
        ticks = round(step_s / CONTROL_TICK_S)
        if ticks < 1 or not math.isclose(ticks * CONTROL_TICK_S, step_s, rel_tol=0, abs_tol=1e-9):
            raise ValueError(
                f"got {step_s!r}, expected a whole multiple of the control tick {CONTROL_TICK_S} s"
            )
        return step_s

    @model_validator(mode="after")
    def _sections_agree(self, info: ValidationInfo) -> Self:
        if info.context and info.context.get(DISAGREEMENTS_LATER):
            return self
        found = disagreements(
            self.duration_s,
            self.step_s,
            dict(enumerate(self.bind)),
            dict(enumerate(self.injections)),
            dict(enumerate(self.expect)),
            allow_both=self.xgv.partial.allow_both,
        )
        if found:
            raise ValueError("; ".join(f"{'.'.join(map(str, path))}: {message}" for path, message in found))
        return self

    @property
    def source(self) -> ScenarioSource:
        """Return where the scenario came from and where its relative paths begin."""
        return self._source

    def with_source(self, source: ScenarioSource) -> Self:
        """Return the same scenario with another origin."""
        copy = self.model_copy()
        copy._source = source  # noqa: SLF001 - the same class
        return copy

    def to_mapping(self) -> dict[str, Any]:
        """Return the scenario, defaults written out, as data that JSON and YAML can hold."""
        return self.model_dump(mode="json", by_alias=True)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of scenario files, for editors and other tools."""
    schema = Scenario.model_json_schema(by_alias=True)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": SCHEMA, **schema}
