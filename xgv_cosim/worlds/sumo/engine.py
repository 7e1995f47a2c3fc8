"""SUMO as it is spoken to: the interface that libsumo and traci share, and who holds a simulation."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from typing import Any, Protocol, runtime_checkable


class Engine(Protocol):
    """The module libsumo, the module traci, or a connection of traci: one object for each domain.

    The domains are described by SUMO's documentation only; neither module carries types.
    """

    vehicle: Any
    vehicletype: Any
    simulation: Any
    lane: Any
    edge: Any
    route: Any
    trafficlight: Any


def errors_of(engine: Engine) -> tuple[type[Exception], ...]:
    """Return the classes of the errors that an engine raises."""
    home: Any = engine if hasattr(engine, "FatalTraCIError") else sys.modules[type(engine).__module__]
    return (home.TraCIException, home.FatalTraCIError)


@runtime_checkable
class OverSocket(Protocol):
    """An engine that keeps commands and answers, see ``socket_engine``."""

    def send(self) -> None:
        """Send the commands that are kept."""
        ...

    def look_ahead(self) -> None:
        """Ask again what was asked after the last step, all at once; SUMO has just made another."""
        ...

    def remember(self) -> None:
        """Trust answers from now on."""
        ...

    def forget(self) -> None:
        """Trust no answer from now on."""
        ...


def direct(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return what a function of the module libsumo hands its arguments to, or the function itself.

    Most of libsumo's functions are Python functions that do nothing but call one of its compiled part;
    for a fleet these calls count (measured: a quarter of what it takes to tell SUMO a speed). A function
    that does more, or that somebody has put in their place, is returned as it is.
    """
    match getattr(getattr(function, "__code__", None), "co_names", ()):
        case ("_libsumo", name):
            core = getattr(sys.modules.get(function.__module__), "_libsumo", None)
            behind: Callable[..., Any] = getattr(core, name, function)
            return behind
    return function


def for_each(function: Callable[..., object], *columns: Iterable[object]) -> None:
    """Call a function of SUMO's with the values of columns, row by row; a third cheaper than a loop."""
    deque(map(direct(function), *columns), maxlen=0)


def of_each(function: Callable[..., Any], names: Iterable[str]) -> list[Any]:
    """Return what a function of SUMO's answers about each of some vehicles."""
    return list(map(direct(function), names))


class OpenSimulation(Protocol):
    """A simulation that has been opened, by us or by a user's script."""

    @property
    def engine(self) -> Engine:
        """Return the interface by which to speak to it."""
        ...

    @property
    def begin_s(self) -> float:
        """Return SUMO's time when it was opened: 0 in the time of the run."""
        ...

    @property
    def is_open(self) -> bool:
        """Return whether it still runs."""
        ...

    @property
    def goes_on(self) -> bool:
        """Return whether SUMO runs on after ``close``."""
        ...

    @property
    def messages(self) -> tuple[str, ...]:
        """Return SUMO's warnings and errors so far, oldest first."""
        ...

    def step(self) -> None:
        """Advance SUMO by one step.

        Raises:
            WorldError: SUMO failed.
        """
        ...

    def failures(self) -> AbstractContextManager[None]:
        """Return a context that makes SUMO's errors ``WorldError``; whatever talks to it stands inside."""
        ...

    def close(self) -> None:
        """End it, or let go of it if it is the user's; does nothing the second time."""
        ...
