"""The parts of a scenario: world, bound vehicles, injections and expectations.

Field docstrings become the descriptions of the JSON Schema, which editors show while one types.
Numbers must be numbers: ``"10"`` for a time is refused, as are NaN and infinity.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.injection import InjectionKind
from xgv_cosim.parameters import preset_names
from xgv_cosim.scenario.condition_section import ConditionSection, ModeName
from xgv_cosim.scenario.problems import word_hint
from xgv_cosim.scenario.section import Section
from xgv_cosim.simulation.crash import ContactRule
from xgv_cosim.vehicles.transmitter import TRANSMITTER_KINDS
from xgv_cosim.vehicles.xgv.errors import ERRORS, near_codes

PATTERN, LIST, QUERY = "|pattern", "|list", "|query"
"""Tags of the three shapes of a selector; ``|`` keeps them apart from keys in error locations."""

STACK_NAMES = ("reference", "reference_wrench", "external", "none")
"""Stacks that have a name of their own."""


def known_error_code(code: int) -> int:
    """Return an error code that the XGV has.

    Raises:
        ValueError: It has no such code; the message names the nearest ones.
    """
    if code not in ERRORS:
        raise ValueError(f"got {code}, but the XGV has no such error; near it: {near_codes(code)}")
    return code


class VehicleQuery(Section):
    """Vehicles chosen by what they are rather than by name; all given conditions must hold."""

    type: Annotated[str, Field(min_length=1)] | None = None
    """The world's vehicle type (in SUMO: vType), or a pattern such as ``xgv_*``."""
    route: Annotated[str, Field(min_length=1)] | None = None
    """The world's name of the route, or a pattern; SUMO's trips have none of note, see ``via``."""
    via: Annotated[str, Field(min_length=1)] | None = None
    """A section of road (in SUMO: edge) that the vehicle's route passes."""
    share: Annotated[float, Field(gt=0, le=1)] | None = None
    """Share of the vehicles, more than 0 up to 1; each vehicle is drawn by its id and the seed."""
    seed: Annotated[int, Field(ge=0)] | None = None
    """Seed of the draw; without it the scenario's seed."""

    @model_validator(mode="after")
    def _asks_for_something(self) -> Self:
        if all(value is None for value in (self.type, self.route, self.via, self.share)):
            raise ValueError("expected at least one of 'type', 'route', 'via', 'share'")
        if self.seed is not None and self.share is None:
            raise ValueError("'seed' goes with 'share'; add 'share' or remove 'seed'")
        return self


def _shape_of_selector(value: object) -> str | None:
    if isinstance(value, str):
        return PATTERN
    if isinstance(value, (list, tuple)):
        return LIST
    return QUERY if isinstance(value, (dict, VehicleQuery)) else None


_VehicleId = Annotated[str, Field(min_length=1)]
_Name = Annotated[str, Field(min_length=1)]

Selector = Annotated[
    Annotated[_VehicleId, Tag(PATTERN)]
    | Annotated[tuple[_VehicleId, ...], Field(min_length=1), Tag(LIST)]
    | Annotated[VehicleQuery, Tag(QUERY)],
    Discriminator(_shape_of_selector),
]
"""An id or pattern (``xgv_*``), a list of them, or a ``VehicleQuery``."""


class SumoSection(Section):
    """Traffic simulated by SUMO."""

    config: Annotated[str, Field(min_length=1)]
    """The .sumocfg file, relative to the scenario file."""
    options: tuple[str, ...] = ()
    """Further SUMO options, for example ``["--time-to-teleport", "-1"]``."""


class EnvironmentSection(Section):
    """The road under the bound vehicles."""

    friction: Annotated[float, Field(ge=0.05, le=1.5)] | None = None
    """Friction of tyre and road: 0.85 dry, 0.5 wet, 0.2 snow; without it, the preset's."""
    grade: Annotated[float, Field(ge=-0.3, le=0.3)] = 0.0
    """Rise of the road per distance in each vehicle's heading, positive uphill."""


class WorldSection(Section):
    """The traffic around the bound vehicles."""

    sumo: SumoSection
    """Traffic simulated by SUMO."""
    environment: EnvironmentSection = EnvironmentSection()
    """The road under the bound vehicles."""
    contact: ContactRule = ContactRule.STAY
    """After a contact with a bound vehicle: both stay where they are, the run ends there (end), or they drive
    on through each other (pass)."""


class ImperfectionsSection(Section):
    """What the vehicle's sensors and actuators lack; nothing by default. Drawn by its id and the seed."""

    speed_quantum_mps: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Step in which the vehicle measures and reports its speed."""
    speed_noise_mps: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Standard deviation of the measured speed while the car rolls; another draw on each control tick."""
    command_latency_s: Annotated[float, Field(ge=0, le=0.05)] = 0.0
    """Time from a message's arrival at the vehicle until it acts."""
    command_jitter_s: Annotated[float, Field(ge=0, le=0.05)] = 0.0
    """Up to this much longer, drawn for each message; both together at most 0.05 s."""
    steer_backlash_rad: Annotated[float, Field(ge=0, le=0.1)] = 0.0
    """Play of the steering, as an angle of the road wheel."""

    @model_validator(mode="after")
    def _stays_within_50_ms(self) -> Self:
        if self.command_latency_s + self.command_jitter_s > 0.05 + 1e-9:
            raise ValueError("command_latency_s and command_jitter_s: expected at most 0.05 s together")
        return self


class PlantSection(Section):
    """What differs from the preset and from ``world.environment`` for these vehicles."""

    released_steering: Literal["self_align", "hold"] = "self_align"
    """What a wheel does that nobody holds: turn back as the car rolls, or stay (XGV-64)."""
    friction: Annotated[float, Field(ge=0.05, le=1.5)] | None = None
    """Friction of tyre and road; without it, that of ``world.environment``."""
    grade: Annotated[float, Field(ge=-0.3, le=0.3)] | None = None
    """Grade of the road; without it, that of ``world.environment``."""
    imperfections: ImperfectionsSection = ImperfectionsSection()
    """What the vehicle's sensors and actuators lack; nothing by default."""


class BindSection(Section):
    """Vehicles of the traffic that become emulated drive-by-wire vehicles."""

    vehicles: Selector
    """Which vehicles: an id or pattern, a list of them, or a mapping of type, route, via, share, seed."""
    profile: Literal["xgv"] = "xgv"
    """Make of vehicle."""
    preset: Annotated[str, Field(min_length=1)] = "ford_escape_hybrid"
    """Geometry, actuators and road load of the vehicle."""
    coupling: CouplingKind = CouplingKind.AUTO
    """How the vehicle is written into the traffic: free (any pose), lane (the traffic keeps the lane) or auto
    (in its lane while its pose there is exact, free otherwise)."""
    start: Literal["handover", "cold"] = "handover"
    """handover: the traffic drives it until drive-by-wire is reached; cold: powered up at standstill."""
    driver: Literal["rider", "none", "world"] = "rider"
    """Who sits in the car and takes what the computer releases (XGV-64)."""
    driver_reaction_s: Annotated[float, Field(ge=0)] = 1.0
    """Time after which the rider takes an axis that was released without his doing."""
    partial: Literal["full", "manual_steering", "manual_speed", "both_manual"] = "full"
    """Partial mode: which axes the computer leaves to the human (XGV-39, XGV-41)."""
    partial_forced: bool = False
    """Allow a partial mode with driver: none; a pause with manual speed then has no effect (XGV-41)."""
    from_s: Annotated[float, Field(ge=0)] = 0.0
    """Time of the run from which on the vehicles are bound; who is under way by then is bound as it moves."""
    until_s: Annotated[float, Field(gt=0)] | None = None
    """Time of the run at which they are given back to the traffic's own driver; without it never."""
    transmitter: _Name | None = None
    """Name of the SafeStop transmitter that these vehicles hear; all with the same name share one radio
    (XGV-42). Without it each vehicle has one of its own."""
    plant: PlantSection = PlantSection()
    """What differs from the preset and from ``world.environment``."""
    stack: str = "reference"
    """The autonomy stack: reference (follows the route), reference_wrench (the same by wrench efforts),
    external (a client that speaks JAUS, with ``--jaus``), none, or a class of your own as ``module:Class``,
    beside this file or on Python's path."""
    stack_options: Annotated[dict[str, Any], Field(default_factory=dict)]
    """Keyword arguments for a class of your own."""
    desired_speed_mps: Annotated[float, Field(gt=0)] | None = None
    """Speed the reference stacks drive at; without it the lane's limit."""

    @field_validator("stack")
    @classmethod
    def _stack_has_a_shape(cls, stack: str) -> str:
        if stack not in STACK_NAMES and not re.fullmatch(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*", stack):
            hint = word_hint(stack, STACK_NAMES)
            raise ValueError(
                f"got {stack!r}, expected {', '.join(STACK_NAMES)} or module:Class, for example "
                f"my_stack:MyStack{f' ({hint})' if hint else ''}"
            )
        return stack

    @field_validator("preset")
    @classmethod
    def _preset_exists(cls, preset: str) -> str:
        known = preset_names()
        if preset not in known:
            hint = word_hint(preset, known)
            raise ValueError(
                f"got {preset!r}, expected one of {', '.join(known)}{f' ({hint})' if hint else ''}"
            )
        return preset

    @model_validator(mode="after")
    def _agrees_with_itself(self) -> Self:
        if self.partial != "full" and self.driver == "none" and not self.partial_forced:
            raise ValueError(
                f"partial: {self.partial} leaves an axis to a human, but with driver: none nobody is aboard; "
                "use driver: rider, driver: world or partial: full (XGV-41), or partial_forced: true"
            )
        if self.until_s is not None and self.until_s <= self.from_s:
            raise ValueError(
                f"until_s {self.until_s:g} is not after from_s {self.from_s:g}; give a later end"
            )
        if self.desired_speed_mps is not None and not self.stack.startswith("reference"):
            raise ValueError("desired_speed_mps is read by the reference stacks only; remove one of the two")
        if self.stack_options and ":" not in self.stack:
            raise ValueError("stack_options go with a class of your own, stack: module:Class; remove them")
        return self


class InjectionSection(Section):
    """Something that happens to some bound vehicles at some time, at some place or on some condition."""

    at_s: Annotated[float, Field(ge=0)] | None = None
    """When it begins, in seconds since the start of the run; with 'when', from when on it waits for that."""
    when: ConditionSection | None = None
    """It begins for each of the vehicles by itself, once, when this holds."""
    vehicles: Selector | None = None
    """Which of the bound vehicles."""
    transmitter: _Name | None = None
    """Instead of vehicles: a SafeStop transmitter (``bind.transmitter``) that is used or loses its radio."""
    kind: InjectionKind
    """What happens."""
    duration_s: Annotated[float, Field(gt=0)] | None = None
    """How long it lasts; without it, to the end (latching is the vehicle's business)."""
    code: int | None = None
    """Error code, for kind error."""

    @property
    def begin_s(self) -> float:
        """Return when it begins, or begins to wait for its condition."""
        return self.at_s or 0.0

    @model_validator(mode="after")
    def _says_when(self) -> Self:
        if self.at_s is None and self.when is None:
            raise ValueError("expected at_s (seconds), when (a condition), or both")
        if self.when is not None and self.transmitter is not None:
            raise ValueError("a condition is one of vehicles, not of a transmitter; name 'vehicles' instead")
        return self

    @model_validator(mode="after")
    def _says_where(self) -> Self:
        if (self.vehicles is None) == (self.transmitter is None):
            got = "neither" if self.vehicles is None else "both"
            raise ValueError(f"expected exactly one of vehicles, transmitter; got {got}")
        if self.transmitter is not None and self.kind not in TRANSMITTER_KINDS:
            kinds = ", ".join(TRANSMITTER_KINDS)
            raise ValueError(
                f"a transmitter takes kind {kinds}, not {self.kind}; say which 'vehicles' have it instead"
            )
        return self

    @model_validator(mode="after")
    def _code_belongs_to_error(self) -> Self:
        if self.kind is InjectionKind.ERROR and self.code is None:
            raise ValueError("kind: error needs 'code', the number of the error, for example 9109")
        if self.kind is not InjectionKind.ERROR and self.code is not None:
            raise ValueError(f"'code' goes with kind: error, not with kind: {self.kind}; remove it")
        return self

    @field_validator("code")
    @classmethod
    def _code_is_known(cls, code: int | None) -> int | None:
        return None if code is None else known_error_code(code)


class ExpectationSection(Section):
    """What the run has to show; a run that does not show it ends with exit code 1."""

    vehicle: _VehicleId | None = None
    """Id of a bound vehicle; without it the whole run (no_collision and min_gap_m only)."""
    mode: ModeName | None = None
    """Safety mode that is in force at by_s, or always."""
    standstill: Literal[True] | None = None
    """The vehicle stands at by_s, or always: slower than 0.1 m/s for at least 0.5 s."""
    no_collision: Literal[True] | None = None
    """No collision up to by_s, or ever."""
    min_gap_m: Annotated[float, Field(ge=0)] | None = None
    """Smallest gap, bumper to bumper, to the vehicles ahead and behind, up to by_s, or ever."""
    by_s: Annotated[float, Field(ge=0)] | None = None
    """Time of the run at which, or up to which, it has to hold."""
    always: Literal[True] | None = None
    """It has to hold through the whole run; a mode from the vehicle's hand-over on (or, for start: cold,
    from the first change of the mode in which it starts up)."""

    @model_validator(mode="after")
    def _says_one_thing(self) -> Self:
        facts = {
            "mode": self.mode,
            "standstill": self.standstill,
            "no_collision": self.no_collision,
            "min_gap_m": self.min_gap_m,
        }
        given = [name for name, value in facts.items() if value is not None]
        if len(given) != 1:
            raise ValueError(
                f"expected exactly one of {', '.join(facts)}; got {' and '.join(given) or 'none of them'}"
            )
        if (self.by_s is None) == (self.always is None):
            raise ValueError(
                f"expected exactly one of by_s, always; got {'neither' if self.always is None else 'both'}"
            )
        if self.vehicle is None and given[0] in {"mode", "standstill"}:
            raise ValueError(f"{given[0]} needs 'vehicle', the id of a bound vehicle")
        return self

    @property
    def what(self) -> Literal["mode", "standstill", "no_collision", "min_gap_m"]:
        """Return the name of the one fact that is expected."""
        if self.mode is not None:
            return "mode"
        if self.standstill is not None:
            return "standstill"
        return "no_collision" if self.no_collision is not None else "min_gap_m"
