"""A scenario made from a SUMO configuration alone, for runs that need no scenario file."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from xgv_cosim.errors import ScenarioError
from xgv_cosim.worlds.sumo.inputs import configured_options

if TYPE_CHECKING:
    from pathlib import Path

SUFFIX = ".sumocfg"
DEFAULT_DURATION_S = 300.0
"""Length of a run whose configuration names no end; SUMO itself would wait for the last vehicle."""
SUMO_STEP_S = 1.0
"""SUMO's own step length, in force unless a configuration names another."""


def mapping_of_config(config: Path, *, keep_step: bool = False) -> dict[str, Any]:
    """Return the data of a scenario that runs a SUMO configuration from its begin to its end.

    Args:
        config: The ``.sumocfg`` file.
        keep_step: Take the configuration's step length rather than the scenario's default.

    Raises:
        WorldConfigurationError: The configuration is not well-formed XML.
        ScenarioError: A time in it is none.
    """
    values = {option.name: option.value for option in configured_options(config)}
    begin_s = _seconds(values.get("begin", "0"), "begin", config)
    end_s = _seconds(values.get("end", "-1"), "end", config)
    data: dict[str, Any] = {
        "schema": "xgv-cosim/scenario/1",
        "name": re.sub(r"[^A-Za-z0-9_.-]", "_", config.stem),
        "description": f"{config.name}, without a scenario file",
        "duration_s": end_s - begin_s if end_s > begin_s else DEFAULT_DURATION_S,
        "world": {"sumo": {"config": config.name}},
    }
    if keep_step:
        data["step_s"] = _seconds(values.get("step-length", str(SUMO_STEP_S)), "step-length", config)
    if values.get("seed", "").isdecimal():
        data["seed"] = int(values["seed"])
    return data


def _seconds(text: str, option: str, config: Path) -> float:
    """Return a time of a configuration: seconds, or ``[days:]hours:minutes:seconds``."""
    parts = text.strip().split(":")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) not in {1, 3, 4}:
        raise ScenarioError(
            f"{config}: {option}: got {text!r}, expected seconds or [days:]hours:minutes:seconds"
        )
    scales = (1.0,) if len(numbers) == 1 else (86400.0, 3600.0, 60.0, 1.0)[-len(numbers) :]
    return sum(number * scale for number, scale in zip(numbers, scales, strict=True))
