"""The stacks that a scenario may name: the reference stacks, and classes of the user's own.

``module:Class`` is looked for beside the scenario file first, then on Python's path. The class is called
with ``vehicle_id`` and ``address``, each if its constructor takes it, and with ``stack_options``.
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import re
import sys
import traceback
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from xgv_cosim.autonomy.reference import ReferenceStack, ReferenceStackSettings
from xgv_cosim.autonomy.wrench import ReferenceWrenchStack
from xgv_cosim.errors import ScenarioError
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.scenario.problems import word_hint

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import ModuleType

    from jaus.address import JausAddress
    from xgv_cosim.endpoint import StackMessage
    from xgv_cosim.links.base import Link
    from xgv_cosim.observation import Observation, Stack
    from xgv_cosim.parameters import VehicleParameters
    from xgv_cosim.scenario.sections import BindSection
    from xgv_cosim.simulation.binding import LinkFactory

USERS_CLASS = re.compile(r"(?P<module>[A-Za-z_]\w*(\.[A-Za-z_]\w*)*):(?P<name>[A-Za-z_]\w*)")
GIVEN = ("vehicle_id", "address")
"""What a class is called with if its constructor takes it."""


class _StillbornStack:
    """Stands in for a stack whose constructor has raised: says so whenever it is asked."""

    def __init__(self, error: Exception) -> None:
        self._error = error

    def act(self, observation: Observation) -> list[StackMessage]:  # noqa: ARG002 - the shape of a stack
        """Raise what the constructor raised."""
        raise self._error


def new_link_of(row: BindSection, parameters: VehicleParameters, folder: Path) -> LinkFactory | None:
    """Return what makes the link of a vehicle and its stack, None: it has no stack.

    Args:
        row: A row of ``bind``.
        parameters: What a stack of ours may know of its car.
        folder: Where classes of the user's are looked for first.

    Raises:
        ScenarioError: The class cannot be imported, is none, or has no ``act``.
    """
    settings = ReferenceStackSettings(desired_speed_mps=row.desired_speed_mps)
    if row.stack in {"none", "external"}:
        return None
    if row.stack == "reference":
        return lambda _, address: InProcessLink(ReferenceStack(address, settings), address)
    if row.stack == "reference_wrench":
        return lambda _, address: InProcessLink(ReferenceWrenchStack(address, parameters, settings), address)
    return link_to_class(stack_class(row.stack, folder, row.stack_options), row.stack_options)


def link_to_class(kind: Callable[..., Stack], options: dict[str, Any]) -> LinkFactory:
    """Return what makes the link of a vehicle and its stack, of a class or a function that makes stacks."""
    taken = _taken(kind)

    def new_link(vehicle_id: str, address: JausAddress) -> Link:
        given = {"vehicle_id": vehicle_id, "address": address}
        try:
            stack: Stack = kind(**{name: given[name] for name in taken}, **options)
        except Exception as error:  # noqa: BLE001 - a user's class may raise anything; the run goes on
            stack = _StillbornStack(error)
        return InProcessLink(stack, address)

    return new_link


def stack_class(text: str, folder: Path, options: dict[str, Any]) -> type[Stack]:
    """Return the class that ``module:Class`` names.

    Raises:
        ScenarioError: It cannot be imported, is no class, has no ``act``, or does not take the options.
    """
    found = USERS_CLASS.fullmatch(text)
    if found is None:
        raise ScenarioError(f"got {text!r}, expected module:Class, for example my_stack:MyStack")
    module, name = _imported(found["module"], folder), found["name"]
    where = getattr(module, "__file__", found["module"])
    kind = getattr(module, name, None)
    if kind is None:
        classes = [key for key, value in vars(module).items() if inspect.isclass(value)]
        hint = word_hint(name, classes)
        raise ScenarioError(f"{where} has no class {name!r}{f' ({hint})' if hint else ''}")
    if not inspect.isclass(kind):
        raise ScenarioError(f"{text} is {type(kind).__name__}, expected a class with act(observation)")
    if not callable(getattr(kind, "act", None)):
        raise ScenarioError(f"class {name} in {where} has no method act(self, observation); write one")
    made = cast("type[Stack]", kind)
    require_callable(made, options, f"class {name} in {where}")
    return made


def require_callable(kind: Callable[..., Stack], options: dict[str, Any], called: str) -> None:
    """Check that a class or function can be called with what it is given.

    Raises:
        ScenarioError: It cannot; ``called`` says what it is.
    """
    try:
        inspect.signature(kind).bind(**dict.fromkeys(_taken(kind)), **options)
    except TypeError as error:
        given = ", ".join([*_taken(kind), *options]) or "nothing"
        raise ScenarioError(
            f"{called} cannot be made with {given}: {error}; change its constructor or 'stack_options'"
        ) from None


def _taken(kind: Callable[..., Stack]) -> list[str]:
    """Return which of ``GIVEN`` a class's constructor, or a function, takes."""
    parameters = inspect.signature(kind).parameters
    takes_all = any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values())
    return [name for name in GIVEN if takes_all or name in parameters]


def _imported(name: str, folder: Path) -> ModuleType:
    """Return a module, from ``folder`` if it has one of that name.

    Raises:
        ScenarioError: It is not there, or raises when it is imported.
    """
    file = folder.joinpath(*name.split(".")).with_suffix(".py")
    try:
        with _first_on_path(folder):
            loaded = sys.modules.get(name)
            if not file.is_file():
                return importlib.import_module(name)
            if loaded is not None and Path(getattr(loaded, "__file__", "") or "").resolve() == file.resolve():
                return loaded
            return _executed(name, file)
    except ModuleNotFoundError as error:
        if error.name == name or (error.name and name.startswith(f"{error.name}.")):
            raise ScenarioError(
                f"there is no module {name!r}: neither {file} nor on Python's path; "
                "write that file, or install the module"
            ) from None
        raise ScenarioError(f"module {name!r} needs {error.name!r}, which is not installed") from None
    except Exception as error:  # noqa: BLE001 - a user's module may raise anything when it is imported
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise ScenarioError(
            f"module {name!r} cannot be imported: {type(error).__name__}: {error} "
            f"({last.filename}:{last.lineno})"
        ) from None


def _executed(name: str, file: Path) -> ModuleType:
    """Return the module of a file, executed under its name."""
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ScenarioError(f"{file} is no Python module")
    module = importlib.util.module_from_spec(spec)
    before = sys.modules.get(name)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        if before is None:
            del sys.modules[name]
        else:
            sys.modules[name] = before
        raise
    return module


@contextmanager
def _first_on_path(folder: Path) -> Iterator[None]:
    """Let modules beside the scenario import each other meanwhile."""
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
