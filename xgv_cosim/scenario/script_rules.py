"""What a script has asked for, row by row: it holds for each simulation that the script runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from jaus.address import JausAddress
from xgv_cosim.errors import ScenarioError
from xgv_cosim.injection import Injection
from xgv_cosim.links.base import Link
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.observation import Stack
from xgv_cosim.scenario.building import binding_from, injection_of, profile_of
from xgv_cosim.scenario.model import BindSection, InjectionSection, Scenario
from xgv_cosim.scenario.selection import matches, rows_without_vehicle
from xgv_cosim.scenario.stacks import link_to_class, require_callable
from xgv_cosim.simulation import Binding
from xgv_cosim.simulation.binding import LinkFactory
from xgv_cosim.simulation.crash import ContactRule
from xgv_cosim.traveller import Traveller

StackMaker = Callable[..., Stack]
"""A class or function that makes stacks from ``vehicle_id`` and ``address``, each if it takes it."""


@dataclass(slots=True)
class _BindRule:
    section: BindSection
    new_link: LinkFactory | None
    """Makes links to stacks that no scenario can name."""
    binding: Binding
    has_bound: bool = False


class ScriptRules:
    """The rows of ``bind`` and ``injections`` of a script, in the order in which they came.

    Args:
        settings: What all vehicles share.
    """

    def __init__(self, settings: Scenario) -> None:
        self._settings = settings
        self._seed = 0
        self._profile = profile_of(settings)
        self._bind: list[_BindRule] = []
        self._injections: list[InjectionSection] = []
        self._again: dict[str, _BindRule] = {}
        """The rows that have bound vehicles anew, after their release."""

    @property
    def contact(self) -> ContactRule:
        """Return what a contact with a bound vehicle does."""
        return self._settings.world.contact

    @property
    def safety_mode_name(self) -> Callable[[int], str]:
        """Return the profile's names of safety modes."""
        return self._profile.safety_mode_name

    def bind(self, section: BindSection, stack: str | Stack | StackMaker, again: Iterable[str] = ()) -> None:
        """Add a row of ``bind``; ``stack`` wins over the row's own unless it is a name.

        Args:
            section: The row.
            stack: Name, object, class or function, see ``maker_of``.
            again: Vehicles of it that were released: for them it counts before rows that came first.

        Raises:
            ScenarioError: The stack is neither a name, nor has ``act``, nor can be called.
        """
        new_link = None if isinstance(stack, str) else link_to(stack)
        rule = _BindRule(section, new_link, self._ready(section, new_link))
        self._bind.append(rule)
        self._again.update(dict.fromkeys(again, rule))

    def inject(self, section: InjectionSection) -> Injection:
        """Add a row of ``injections`` and return it made ready."""
        self._injections.append(section)
        return injection_of(section, self._seed)

    def begin(self, seed: int) -> list[Injection]:
        """Make everything ready for a new simulation with this seed; return its injections."""
        self._seed = seed
        self._again.clear()
        self._profile = profile_of(self._settings.model_copy(update={"seed": seed}))
        for rule in self._bind:
            rule.binding, rule.has_bound = self._ready(rule.section, rule.new_link), False
        return [injection_of(section, seed) for section in self._injections]

    def select(self, who: Traveller) -> Binding | None:
        """Return how a vehicle is bound by the first row that means it, None: not at all."""
        for rule in (self._again[who.vehicle_id],) if who.vehicle_id in self._again else self._bind:
            if matches(rule.section.vehicles, who, self._seed):
                rule.has_bound = True
                return rule.binding
        return None

    def unmatched(self) -> tuple[str, ...]:
        """Return the rows of ``bind`` that have bound nobody in this simulation, in words."""
        met = {number for number, rule in enumerate(self._bind) if rule.has_bound}
        return tuple(rows_without_vehicle([rule.section.vehicles for rule in self._bind], met))

    def _ready(self, section: BindSection, new_link: LinkFactory | None) -> Binding:
        binding = binding_from(section, self._profile, self._settings.world.environment)
        return binding if new_link is None else replace(binding, new_link=new_link)


def link_to(stack: Stack | StackMaker) -> LinkFactory:
    """Return what makes the links to stacks of a script: of its class or function, or to its one object.

    Raises:
        ScenarioError: It is neither, or cannot be called with what it is given.
    """
    if not isinstance(stack, type) and hasattr(stack, "act"):
        return _OnlyOnce(stack)
    if callable(stack):
        require_callable(stack, {}, f"stack {getattr(stack, '__name__', stack)!r}")
        return link_to_class(stack, {})
    raise ScenarioError(
        f"bind: got stack {stack!r}, expected the name of a stack, an object with act(observation), or a "
        "class or function that makes one"
    )


@dataclass(slots=True)
class _OnlyOnce:
    """One stack object drives one vehicle."""

    stack: Stack
    driven: str = ""

    def __call__(self, vehicle_id: str, address: JausAddress) -> Link:
        if self.driven not in {"", vehicle_id}:
            raise ScenarioError(
                f"bind: the stack object {self.stack!r} drives {self.driven!r} already and cannot drive "
                f"{vehicle_id!r} too; give its class or a function that makes one for each vehicle"
            )
        self.driven = vehicle_id
        return InProcessLink(self.stack, address)
