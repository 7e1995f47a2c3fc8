"""Rows of a scenario that a script gives one by one, as keyword arguments: checked like those of a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from xgv_cosim.errors import ScenarioError
from xgv_cosim.scenario.loading import scenario_from_mapping

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from xgv_cosim.scenario.model import BindSection, InjectionSection, Scenario

ENDLESS_S = 1e9
"""Length of a run whose end only the script knows."""
_FRAME = {
    "name": "attached",
    "duration_s": ENDLESS_S,
    "world": {"sumo": {"config": "the script's own"}},
}


def script_scenario(
    *,
    xgv: Mapping[str, Any] | None = None,
    safestop: Mapping[str, Any] | None = None,
    environment: Mapping[str, Any] | None = None,
    contact: str = "stay",
) -> Scenario:
    """Return a scenario without rows, for the settings that all vehicles of a script share.

    Args:
        xgv: Keys as in a scenario's ``xgv``.
        safestop: Keys as in a scenario's ``safestop``.
        environment: Keys as in a scenario's ``world.environment``.
        contact: As a scenario's ``world.contact``.

    Raises:
        ScenarioError: A key is unknown or a value wrong.
    """
    world = {**_FRAME["world"], "environment": dict(environment or {}), "contact": contact}  # type: ignore[dict-item]
    return _checked({"world": world, "xgv": dict(xgv or {}), "safestop": dict(safestop or {})})


def bind_row(
    vehicles: str | Sequence[str] | None, query: Mapping[str, Any], keys: Mapping[str, Any]
) -> BindSection:
    """Return a row of ``bind``.

    Args:
        vehicles: Id, pattern or several of them; None: chosen by ``query``.
        query: ``type``, ``share`` and ``seed``; what is None is left out.
        keys: Further keys of the row.

    Raises:
        ScenarioError: A key is unknown or a value wrong, or it is not clear which vehicles are meant.
    """
    row = {"vehicles": _selector("bind", vehicles, query), **keys}
    return _checked({"bind": [row]}).bind[0]


def injection_row(
    vehicles: str | Sequence[str] | None, query: Mapping[str, Any], keys: Mapping[str, Any]
) -> InjectionSection:
    """Return a row of ``injections``; see :func:`bind_row`.

    Raises:
        ScenarioError: A key is unknown or a value wrong, or it is not clear which vehicles are meant.
    """
    transmitter = keys.get("transmitter")
    listener = {"vehicles": "*"} | ({} if transmitter is None else {"transmitter": transmitter})
    row = dict(keys)
    if transmitter is None or vehicles is not None:
        row["vehicles"] = _selector("inject", vehicles, query)
    return _checked({"bind": [listener], "injections": [row]}).injections[0]


def _selector(verb: str, vehicles: str | Sequence[str] | None, query: Mapping[str, Any]) -> object:
    asked = {key: value for key, value in query.items() if value is not None}
    if (vehicles is None) == (not asked):
        raise ScenarioError(
            f"{verb}: expected either ids or patterns of vehicles, or type=, share= and seed=; got "
            f"{'both' if asked else 'neither'}"
        )
    if vehicles is None:
        return asked
    return vehicles if isinstance(vehicles, str) else list(vehicles)


def _checked(sections: Mapping[str, Any]) -> Scenario:
    return scenario_from_mapping({**_FRAME, **sections}, Path.cwd())
