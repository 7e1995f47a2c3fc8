"""A script that speaks to SUMO through traci, over a socket."""

from __future__ import annotations

import inspect
import sys
from functools import partial
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar

from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.holding import Patches, num_steps_to, who_is_removed
from xgv_cosim.worlds.sumo.socket_engine import SocketEngine
from xgv_cosim.worlds.sumo.unseen import NOBODY, READINGS

if TYPE_CHECKING:
    from collections.abc import Callable

    from xgv_cosim.worlds.sumo.holding import Holder


class SocketHold:
    """The hold on one connection of a script, and on the one that it opens in its place.

    Args:
        given: The module ``traci``, or one of its connections. Of the module, the connection that is current
            when it is needed first, and each later one that steps while none is held. Of a connection, it
            and each later one with its label.
        holder: Who is told.

    Raises:
        WorldError: The module or connection is held already.
    """

    everybody: ClassVar[list[SocketHold]] = []

    def __init__(self, given: Any, holder: Holder) -> None:  # noqa: ANN401 - traci carries no types
        self._holder = holder
        self._home: Any = given if isinstance(given, ModuleType) else sys.modules[type(given).__module__]
        self._home = self._home.connection if isinstance(given, ModuleType) else self._home
        self._label: str | None = None if isinstance(given, ModuleType) else given.getLabel()
        self._follows_all = isinstance(given, ModuleType)
        self._connection: Any = None
        self._engine: SocketEngine | None = None
        self._answers: list[Any] = []
        self._is_stepping = False
        self._lets_go = False
        for other in [other for other in self.everybody if other._is_in_the_way_of(self, given)]:
            other._holder.gives_way()
        if self._follows_all and any(other._follows_all for other in self.everybody):
            raise WorldError("traci is attached already; use that plugin, or detach() it first")
        self._original: Callable[..., Any]
        self.everybody.append(self)
        try:
            self._take_current() if self._follows_all else self._take(given)
        except WorldError:
            self.everybody.remove(self)
            raise
        self._patches = Patches()
        self._patches.wrap(self._home.Connection, "simulationStep", self._step_wrapper)
        for name in ("load", "close"):
            self._patches.wrap(self._home.Connection, name, self._end_wrapper)
        domain = sys.modules["traci._simulation"].SimulationDomain
        self._patches.wrap(domain, "loadState", self._load_state_wrapper)
        self._patches.wrap(sys.modules["traci._vehicle"].VehicleDomain, "remove", self._remove_wrapper)
        for owner, getter in _where_read():
            self._patches.wrap(owner, getter, partial(self._getter_wrapper, getter))

    @property
    def engine(self) -> SocketEngine | None:
        """Return the interface to the connection that is held, None while none is open."""
        if self not in self.everybody:
            return None
        if self._connection is None and self._follows_all:
            self._take_current()
        if self._connection is None or self._connection._socket is None:
            return None
        if self._engine is None:
            self._engine = SocketEngine(self._connection)
        return self._engine

    def step_once(self) -> None:
        """Make one step; the script's listeners are called after all steps of its call."""
        self._is_stepping = True
        try:
            self._answers = self._original(self._connection, 0.0)
        finally:
            self._is_stepping = False

    def settle(self) -> None:
        """Send what is kept, and trust no answer from now on."""
        if self._engine is not None:
            self._engine.send()
            self._engine.forget()

    def let_go_soon(self) -> None:
        """Let go before the script's next call that steps."""
        self._lets_go = True

    def let_go(self) -> None:
        """Put traci back; a script that kept a wrapper finds that it only passes on."""
        if self in self.everybody:
            self.everybody.remove(self)
            self._drop()
            self._patches.undo()

    def _take_current(self) -> None:
        if self._home.has("") and not self._is_taken(self._home.check()):
            self._take(self._home.check())

    def _is_in_the_way_of(self, other: SocketHold, given: object) -> bool:
        """Return whether a new hold on ``given`` asks for what this one holds."""
        if other._follows_all:
            current = self._home.check() if self._home.has("") else None
            return self._follows_all or self._connection is current
        return self._connection is given

    def _is_taken(self, connection: object) -> bool:
        """Return whether somebody else holds a connection, or waits for one with its label."""
        return any(
            other is not self and (other._connection is connection or other._awaits(connection))
            for other in self.everybody
        )

    def _awaits(self, connection: Any) -> bool:  # noqa: ANN401 - traci carries no types
        return self._label is not None and connection._label == self._label

    def _take(self, connection: Any) -> None:  # noqa: ANN401 - traci carries no types
        if self._is_taken(connection):
            raise WorldError("this connection is attached already; use that plugin, or detach() it first")
        self._connection = connection

        def only_in_our_steps(_step: float = 0.0) -> None:
            """Stand in for the script's step listeners, who are called when all steps of a call are made."""
            if not self._is_stepping:
                raise WorldError(
                    "the script has stepped SUMO past the plugin, by a simulationStep that it kept from "
                    "before attach(); let it call traci.simulationStep, or take the method anew"
                )

        connection.manageStepListeners = only_in_our_steps

    def _drop(self) -> None:
        if self._connection is not None:
            del self._connection.manageStepListeners  # of the object; that of its class is traci's
        self._connection = self._engine = None

    def _holds(self, connection: Any) -> bool:  # noqa: ANN401 - traci carries no types
        """Return whether a connection that steps is ours, and take it if it takes the place of ours."""
        if self not in self.everybody or self._connection is not None:
            return self in self.everybody and connection is self._connection
        if self._awaits(connection) or (self._follows_all and not self._is_taken(connection)):
            self._take(connection)
        return connection is self._connection

    def _step_wrapper(self, original: Callable[..., Any]) -> Callable[..., Any]:
        self._original = original

        def simulation_step(connection: Any, step: float = 0.0) -> Any:  # noqa: ANN401 - traci carries no types
            if self._lets_go:
                self.let_go()
            engine = self.engine if not self._is_stepping and self._holds(connection) else None
            num_steps = num_steps_to(step, engine) if engine else 0
            if engine is None or not num_steps:
                return self._pass_on(connection, original, step)
            engine.remember()
            try:
                for _ in range(num_steps):
                    self._holder.user_steps()
                self.settle()
            finally:
                if self._engine is not None:
                    self._engine.forget()
            type(connection).manageStepListeners(connection, step)
            return self._answers

        return simulation_step

    def _pass_on(self, connection: Any, original: Callable[..., Any], step: float) -> Any:  # noqa: ANN401 - traci carries no types
        """Step a connection that is not ours, or ours where SUMO makes no step."""
        if connection is not self._connection or self._is_stepping:
            return original(connection, step)
        self._is_stepping = True
        try:
            answers = original(connection, step)
        finally:
            self._is_stepping = False
        type(connection).manageStepListeners(connection, step)
        return answers

    def _remove_wrapper(self, original: Callable[..., None]) -> Callable[..., None]:
        def remove(domain: Any, *args: Any, **kwargs: Any) -> None:  # noqa: ANN401 - traci carries no types
            if self._connection is None or domain._connection is not self._connection:
                original(domain, *args, **kwargs)
                return
            with self._holder.user_removes(who_is_removed(args, kwargs)):
                original(domain, *args, **kwargs)
            if self._engine is not None:
                self._engine.lose(who_is_removed(args, kwargs))

        return remove

    def _end_wrapper(self, original: Callable[..., Any]) -> Callable[..., Any]:
        def end(connection: Any, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - traci carries no types
            if connection is self._connection:
                self._holder.user_ends()
                self._engine = None
                if original.__name__ == "close":
                    self._drop()
            return original(connection, *args, **kwargs)

        return end

    def _load_state_wrapper(self, original: Callable[..., Any]) -> Callable[..., Any]:
        def load_state(domain: Any, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - traci carries no types
            if self._connection is not None and domain._connection is self._connection:
                self._holder.user_ends()
                self._engine = None
            return original(domain, *args, **kwargs)

        return load_state

    def _getter_wrapper(self, getter: str, original: Callable[..., Any]) -> Callable[..., Any]:
        def get(domain: Any, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - whatever traci takes and returns
            answer = original(domain, *args, **kwargs)
            seen = READINGS.get((domain._name, getter))
            is_ours = self._connection is not None and domain._connection is self._connection
            engine = self.engine if seen is not None and is_ours else None
            if seen is None or engine is None:
                return answer
            named = inspect.signature(original).bind(domain, *args, **kwargs).args[1:] if kwargs else args
            answer = seen(engine, named, answer)
            is_no_leader = getter == "getLeader" and answer == NOBODY
            return None if is_no_leader and sys.modules["traci._vehicle"]._legacyGetLeader else answer

        return get


def _where_read() -> list[tuple[type, str]]:
    """Return traci's classes and the getters there, each once, through which a script reads vehicles."""
    found: dict[tuple[type, str], None] = {}
    for domain in sys.modules["traci.domain"].DOMAINS:
        for name, getter in READINGS:
            owners = [kind for kind in type(domain).__mro__ if name == domain._name and getter in vars(kind)]
            found.update(dict.fromkeys((owner, getter) for owner in owners[:1]))
    return list(found)
