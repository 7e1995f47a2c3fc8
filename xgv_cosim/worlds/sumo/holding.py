"""Where a user's script steps SUMO: taken hold of there, so that each of its steps becomes one of ours.

The script goes on calling what it always called. Wrapped is the innermost function that all its ways of
stepping lead to, so that ``from traci import simulationStep`` is caught, whenever it was imported. So are
the functions by which it reads vehicles: they show it no ghosts, see ``unseen``. And so is the one that takes
a vehicle out of SUMO, whom the plugin would command otherwise.
"""

from __future__ import annotations

import functools
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, cast

from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.unseen import READINGS

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from xgv_cosim.worlds.sumo.engine import Engine


class Holder(Protocol):
    """Who is told what the script does."""

    def user_steps(self) -> None:
        """The script wants SUMO's next step: make it, by ``Hold.step_once``."""
        ...

    def user_removes(self, vehicle_id: str) -> AbstractContextManager[None]:
        """The script takes a vehicle out of SUMO within the context, which fails if SUMO refuses."""
        ...

    def user_ends(self) -> None:
        """The script is about to end its simulation, or to put another state in its place."""
        ...

    def gives_way(self) -> bool:
        """Let go for somebody else if there is nothing left to do but to take leave; return whether so."""
        ...


class Hold(Protocol):
    """The script's hold on SUMO, shared."""

    @property
    def engine(self) -> Engine | None:
        """Return the interface to the simulation that is open, ghosts and all; None while there is none."""
        ...

    def step_once(self) -> None:
        """Make one step as SUMO makes it; its errors are the script's own."""
        ...

    def settle(self) -> None:
        """Let SUMO have all that it was told: the script may ask and command it from now on."""
        ...

    def let_go(self) -> None:
        """Give everything back as it was."""
        ...

    def let_go_soon(self) -> None:
        """Let go before the script's next call that steps: this one is under way."""
        ...


class Patches:
    """Attributes replaced by wrappers of what they were, to be put back."""

    def __init__(self) -> None:
        self._made: list[tuple[Any, str, object, object]] = []

    def wrap(
        self, owner: object, name: str, make: Callable[[Callable[..., Any]], Callable[..., Any]]
    ) -> None:
        """Replace a function of a module or class by a wrapper; nothing where there is no such function."""
        original = getattr(owner, name, None)
        if original is None:
            return
        wrapper = functools.wraps(original)(make(original))
        is_static = isinstance(vars(owner).get(name), staticmethod)
        before, now = vars(owner)[name], staticmethod(wrapper) if is_static else wrapper
        setattr(owner, name, now)
        self._made.append((owner, name, before, now))

    def undo(self) -> None:
        """Put back what nobody has wrapped again since; other wrappers must pass on by themselves."""
        for owner, name, before, now in reversed(self._made):
            if vars(owner).get(name) is now:
                setattr(owner, name, before)
        self._made.clear()


def who_is_removed(args: tuple[Any, ...], kwargs: dict[str, Any]) -> str:
    """Return the vehicle that a call of ``vehicle.remove`` names; its other argument is a number."""
    return next((value for value in (*args, *kwargs.values()) if isinstance(value, str)), "")


def num_steps_to(time_s: float, engine: Engine) -> int:
    """Return how many steps SUMO makes for ``simulationStep(time_s)``: one for 0, else until it has come."""
    target_ms = round(time_s * 1000.0)
    if target_ms == 0:
        return 1
    now_ms = round(engine.simulation.getTime() * 1000.0)
    step_ms = round(engine.simulation.getDeltaT() * 1000.0)
    num_steps: int = -((now_ms - target_ms) // step_ms)
    return max(0, num_steps)


class LibsumoHold:
    """A script that uses libsumo, under whatever name.

    Args:
        holder: Who is told.

    Raises:
        WorldError: Somebody holds libsumo already.
    """

    held_by: ClassVar[LibsumoHold | None] = None

    def __init__(self, holder: Holder) -> None:
        if LibsumoHold.held_by is not None and not LibsumoHold.held_by.gives_way():
            raise WorldError("libsumo is attached already; use that plugin, or detach() it first")
        self._libsumo = sys.modules["libsumo"]
        self._holder = holder
        self._original: Callable[[float], None]
        self._stepping = False
        self._lets_go = False
        self._patches = Patches()
        native = sys.modules["libsumo._libsumo"]  # where every way through libsumo's Python ends
        self._with_ghosts = _as_it_is(self._libsumo, native)
        for domain, getter in READINGS:
            self._patches.wrap(
                native, f"{domain}_{getter}", functools.partial(self._getter_wrapper, domain, getter)
            )
        self._patches.wrap(native, "simulation_step", self._step_wrapper)
        self._patches.wrap(native, "vehicle_remove", self._remove_wrapper)
        for name in ("start", "close", "load", "loadState"):
            self._patches.wrap(native, f"simulation_{name}", self._end_wrapper)
        LibsumoHold.held_by = self

    @property
    def engine(self) -> Engine | None:
        """Return libsumo while it holds a simulation."""
        is_there = LibsumoHold.held_by is self and self._libsumo.isLoaded()
        return self._with_ghosts if is_there else None

    def step_once(self) -> None:
        """Make one step; the script's listeners are called by libsumo after all steps of its call."""
        self._stepping = True
        try:
            self._original(0.0)
        finally:
            self._stepping = False

    def settle(self) -> None:
        """Do nothing: libsumo has it already."""

    def gives_way(self) -> bool:
        """Return whether the holder has let go now, see ``Holder``."""
        return self._holder.gives_way()

    def let_go_soon(self) -> None:
        """Let go before the script's next call that steps."""
        self._lets_go = True

    def let_go(self) -> None:
        """Put libsumo's functions back; a script that kept a wrapper finds that it only passes on."""
        if LibsumoHold.held_by is self:
            LibsumoHold.held_by = None
            self._patches.undo()

    def _getter_wrapper(self, domain: str, getter: str, original: Callable[..., Any]) -> Callable[..., Any]:
        seen = READINGS[domain, getter]

        def get(*args: Any) -> Any:  # noqa: ANN401 - whatever SUMO's takes and returns
            answer = original(*args)
            return seen(self._with_ghosts, args, answer) if LibsumoHold.held_by is self else answer

        return get

    def _step_wrapper(self, original: Callable[[float], None]) -> Callable[..., None]:
        self._original = original

        def step(time: float = 0.0) -> None:
            if self._lets_go:
                self.let_go()
            is_ours = LibsumoHold.held_by is self and not self._stepping and self._libsumo.isLoaded()
            num_steps = num_steps_to(time, self._libsumo) if is_ours else 0
            if not num_steps:
                original(time)
            for _ in range(num_steps):
                self._holder.user_steps()

        return step

    def _remove_wrapper(self, original: Callable[..., None]) -> Callable[..., None]:
        def remove(*args: Any, **kwargs: Any) -> None:  # noqa: ANN401 - whatever SUMO's takes
            if LibsumoHold.held_by is not self:
                original(*args, **kwargs)
                return
            with self._holder.user_removes(who_is_removed(args, kwargs)):
                original(*args, **kwargs)

        return remove

    def _end_wrapper(self, original: Callable[..., Any]) -> Callable[..., Any]:
        def end(*args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - whatever SUMO's takes and returns
            if LibsumoHold.held_by is self:
                self._holder.user_ends()
            return original(*args, **kwargs)

        return end


def _as_it_is(libsumo: ModuleType, native: ModuleType) -> Engine:
    """Return libsumo's interface with the functions that it has now, whatever they are wrapped by later."""
    own: dict[str, dict[str, object]] = {"vehicle": {"remove": staticmethod(native.vehicle_remove)}}
    for domain, getter in READINGS:
        function = getattr(native, f"{domain}_{getter}", None)
        if function is not None:
            own.setdefault(domain, {})[getter] = staticmethod(function)
    engine: Any = ModuleType("libsumo, with ghosts")
    vars(engine).update(vars(libsumo))
    vars(engine).update(
        {name: type(name, (getattr(libsumo, name),), functions) for name, functions in own.items()}
    )
    return cast("Engine", engine)
