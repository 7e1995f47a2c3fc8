"""A scenario becomes a simulation: world, bindings, stacks and injections are made from its data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from xgv_cosim.actuation import Driver
from xgv_cosim.clock import tick_at_or_after
from xgv_cosim.errors import ScenarioError
from xgv_cosim.injection import Injection
from xgv_cosim.parameters import VehicleParameters, load_preset
from xgv_cosim.scenario.model import BindSection, InjectionSection, Scenario
from xgv_cosim.scenario.model import Selector as VehicleSelector
from xgv_cosim.scenario.script_rows import bind_row
from xgv_cosim.scenario.sections import EnvironmentSection
from xgv_cosim.scenario.selection import binding_of, in_words, matches
from xgv_cosim.scenario.stacks import new_link_of
from xgv_cosim.simulation import Binding, Observer, Simulation
from xgv_cosim.simulation.binding import Selector, StartKind
from xgv_cosim.simulation.painting import ModePainter
from xgv_cosim.simulation.requests import PARTIAL_NAMES
from xgv_cosim.traveller import Traveller
from xgv_cosim.vehicles.base import VehicleProfile
from xgv_cosim.vehicles.xgv.profile import XgvProfile
from xgv_cosim.worlds.base import World
from xgv_cosim.worlds.sumo.world import SumoWorld

_DRIVERS = {"none": Driver.NONE, "rider": Driver.RIDER, "world": Driver.WORLD}
_WILDCARDS = frozenset("*?[")


class WindowOptions(NamedTuple):
    """How a run is shown."""

    delay_ms: float | None = None
    """Wall time of each step at least; None: as long as it simulates."""


class ScenarioSimulation(Simulation):
    """A simulation that knows its scenario, so that vehicles can be bound in the words of a ``bind`` row.

    Args:
        scenario: The scenario that ``world`` belongs to.
        world: Its world, not yet started.
        observers: Recorders and metrics.
    """

    def __init__(self, scenario: Scenario, world: World, observers: Sequence[Observer] = ()) -> None:
        self.rows_met: set[int] = set()
        """Indices of the rows of ``bind`` that have matched a vehicle."""
        self._environment = scenario.world.environment
        self._profile = profile_of(scenario)
        self._seed = scenario.seed
        self._folder = scenario.source.folder
        super().__init__(
            world,
            selector_of(scenario, self._profile, self.rows_met),
            [injection_of(row, scenario.seed, number) for number, row in enumerate(scenario.injections)],
            step_s=scenario.step_s,
            observers=observers,
            contact=scenario.world.contact,
        )

    def bind(self, *vehicles: str, **row: Any) -> tuple[str, ...]:  # noqa: ANN401 - checked as a row
        """Bind vehicles that are in the world now, moving or not; return their ids.

        Args:
            *vehicles: Ids or patterns; a pattern leaves out who is bound already.
            **row: Keys of a ``bind`` row, for example ``driver="none"`` or ``coupling="lane"``.

        Raises:
            ScenarioError: A key is unknown or a value wrong, an id is not in the world or is bound already,
                or nobody matches a pattern.
        """
        section = bind_row(vehicles, {}, row)
        binding = binding_from(section, self._profile, self._environment, self._folder)
        present = [self.world.traveller(name) for name in self.snapshot.ids if name not in self.vehicle_ids]
        matching = [who.vehicle_id for who in present if matches(section.vehicles, who, self._seed)]
        chosen = tuple(dict.fromkeys((*named_vehicles(section.vehicles), *matching)))
        if not chosen:
            raise ScenarioError(f"bind: no unbound vehicle matches {', '.join(vehicles)} at {self.now_s:g} s")
        for name in chosen:
            self.bind_vehicle(name, binding)
        return chosen


def build(
    scenario: Scenario, observers: Sequence[Observer] = (), window: WindowOptions | None = None
) -> ScenarioSimulation:
    """Return the simulation of a scenario, its world opened and before its first step.

    Args:
        scenario: The scenario.
        observers: Recorders and metrics.
        window: Show it in a window of sumo-gui, bound vehicles in the colours of their modes.

    Raises:
        ScenarioError: A preset is unknown, or a binding cannot be made.
        WorldError: SUMO cannot start, or runs in this process already.
    """
    sumo = scenario.world.sumo
    opens = SumoWorld.headless if window is None else partial(SumoWorld.windowed, delay_ms=window.delay_ms)
    world = opens(
        scenario.source.folder / sumo.config,
        step_s=scenario.step_s,
        seed=scenario.seed,
        options=sumo.options,
    )
    if window is not None:
        observers = [*observers, ModePainter(world.paint, profile_of(scenario).safety_mode_name)]
    try:
        return ScenarioSimulation(scenario, world, observers)
    except BaseException:
        world.close()
        raise


def profile_of(scenario: Scenario) -> XgvProfile:
    """Return the XGV profile with the scenario's settings and seed."""
    settings = replace(scenario.xgv.settings(), safestop=scenario.safestop.settings())
    return XgvProfile(settings, scenario.seed)


def selector_of(scenario: Scenario, profile: VehicleProfile, rows_met: set[int]) -> Selector:
    """Return the function that says how each vehicle of the world is bound.

    Args:
        scenario: The scenario.
        profile: Make of its vehicles.
        rows_met: Where the indices of rows go that have matched a vehicle.
    """
    environment, folder = scenario.world.environment, scenario.source.folder
    made = {
        id(row): (number, binding_from(row, profile, environment, folder))
        for number, row in enumerate(scenario.bind)
    }

    def select(who: Traveller) -> Binding | None:
        row = binding_of(scenario.bind, who, scenario.seed)
        if row is None:
            return None
        number, binding = made[id(row)]
        rows_met.add(number)
        return binding

    return select


def binding_from(
    row: BindSection, profile: VehicleProfile, environment: EnvironmentSection, folder: Path | None = None
) -> Binding:
    """Return one ``bind`` row made ready.

    Args:
        row: The row.
        profile: Make of vehicle.
        environment: The road of the scenario.
        folder: Where classes of the user's are looked for first, None: the working folder.

    Raises:
        ScenarioError: ``stack`` names a class that cannot be had.
    """
    parameters = parameters_of(row, environment)
    return Binding(
        profile=profile,
        parameters=parameters,
        coupling=row.coupling,
        start=StartKind(row.start),
        driver=_DRIVERS[row.driver],
        driver_reaction_s=row.driver_reaction_s,
        partial_mode=PARTIAL_NAMES.index(row.partial),
        transmitter=row.transmitter or "",
        from_tick=tick_at_or_after(row.from_s),
        until_tick=None if row.until_s is None else tick_at_or_after(row.until_s),
        new_link=new_link_of(row, parameters, folder or Path.cwd()),
    )


def parameters_of(row: BindSection, environment: EnvironmentSection) -> VehicleParameters:
    """Return the preset of a ``bind`` row on the road of the scenario, with the row's own changes."""
    preset, plant = load_preset(row.preset), row.plant
    frictions = (plant.friction, environment.friction, preset.friction)
    return replace(
        preset,
        friction=next(friction for friction in frictions if friction is not None),
        grade=environment.grade if plant.grade is None else plant.grade,
        released_steering_self_aligns=float(plant.released_steering == "self_align"),
        **plant.imperfections.model_dump(),
    )


def injection_of(row: InjectionSection, seed: int, number: int | None = None) -> Injection:
    """Return one ``injections`` row on control ticks, its vehicles named or described.

    Args:
        row: The row.
        seed: Seed of the scenario.
        number: Its place in the scenario, for messages.
    """
    begin = tick_at_or_after(row.begin_s)
    end = None if row.duration_s is None else tick_at_or_after(row.begin_s + row.duration_s)
    condition = None if row.when is None else row.when.condition()
    selector = row.vehicles
    if selector is None:
        return Injection(begin, row.kind, end_tick=end, code=row.code, transmitter=row.transmitter or "")

    @cache
    def chosen(who: Traveller) -> bool:
        return matches(selector, who, seed)

    named = named_vehicles(selector)
    words = in_words(selector) + ("" if number is None else f" (injections.{number})")
    return Injection(begin, row.kind, named, chosen, end, row.code, selector=words, condition=condition)


def named_vehicles(selector: VehicleSelector | None) -> tuple[str, ...]:
    """Return the vehicles that a selector names outright, without a pattern."""
    patterns = (selector,) if isinstance(selector, str) else selector if isinstance(selector, tuple) else ()
    return tuple(pattern for pattern in patterns if not _WILDCARDS & set(pattern))
