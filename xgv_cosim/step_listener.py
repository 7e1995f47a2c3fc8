"""Bound vehicles in a SUMO simulation that somebody else's script runs: three lines, its loop unchanged.

::

    import xgv_cosim
    plugin = xgv_cosim.attach(traci)
    plugin.bind("veh0")

Each SUMO step that the script makes is then a step of ours: the same loop as in a headless run, around
the script's own SUMO.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from xgv_cosim.plugin import Plugin
from xgv_cosim.scenario.script_rows import script_scenario
from xgv_cosim.scenario.script_rules import ScriptRules
from xgv_cosim.simulation import Observer


def attach(
    traci_or_libsumo: object,
    *,
    seed: int | None = None,
    xgv: Mapping[str, Any] | None = None,
    safestop: Mapping[str, Any] | None = None,
    environment: Mapping[str, Any] | None = None,
    contact: str = "stay",
    colours: bool = False,
    observers: Sequence[Observer] = (),
) -> Plugin:
    """Take part in the steps of a script that runs SUMO itself; before or after it starts SUMO.

    Args:
        traci_or_libsumo: The module ``traci`` or ``libsumo``, or a connection of traci.
        seed: Seed of everything random in the bound vehicles; None: SUMO's own seed.
        xgv: Settings of the vehicles, as in a scenario's ``xgv``.
        safestop: Settings of the wireless stop, as in a scenario's ``safestop``.
        environment: The road, as in a scenario's ``world.environment``.
        contact: After a contact with a bound vehicle, as in a scenario's ``world.contact``; with ``"end"``
            the plugin says so in ``ended_by``, and the script decides.
        colours: Give bound vehicles the colours of their safety modes, for a script that runs sumo-gui.
        observers: Told of each step and event.

    Raises:
        WorldError: It is none of these, attached already, or runs in steps that do not fit.
        ScenarioError: A key is unknown or a value wrong.
    """
    rules = ScriptRules(script_scenario(xgv=xgv, safestop=safestop, environment=environment, contact=contact))
    return Plugin(traci_or_libsumo, rules, seed, observers, colours=colours)
