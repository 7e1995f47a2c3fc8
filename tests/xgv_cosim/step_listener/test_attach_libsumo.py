"""What only libsumo in the process has: its other names, and the project's own runs beside it."""

from __future__ import annotations

import subprocess
import sys
from types import ModuleType

import pytest

import xgv_cosim
from tests.xgv_cosim.step_listener.scripts import command, config_of
from xgv_cosim.errors import WorldError

HELLO = config_of("hello")


def test_a_step_function_imported_by_name_is_caught(libsumo: ModuleType) -> None:
    kept = libsumo.simulationStep, libsumo.simulation.step
    with xgv_cosim.attach(libsumo) as plugin:
        libsumo.start(command(HELLO))
        for step in kept:
            step()
        assert plugin.now_s == 0.2
        libsumo.close()


def test_under_the_name_of_traci() -> None:
    """``LIBSUMO_AS_TRACI=1``, with everything imported by name before."""
    code = f"""
import traci
from traci import start, simulationStep, close, load
import xgv_cosim
plugin = xgv_cosim.attach(traci)
plugin.bind("xgv_*")
start({command(HELLO)!r})
simulationStep(1.0)
print(plugin.now_s, plugin.vehicle_ids, traci.isLibsumo())
load({command(HELLO)[1:]!r})
simulationStep()
print(plugin.now_s, plugin.vehicle_ids)
close()
"""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env={"LIBSUMO_AS_TRACI": "quiet", "PATH": "/usr/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-2:] == ["1.0 ('xgv_0', 'xgv_1') True", "0.1 ('xgv_0', 'xgv_1')"]


def test_runs_of_our_own_and_of_a_script_keep_out_of_each_others_way(libsumo: ModuleType) -> None:
    with xgv_cosim.simulate("hello") as simulation:
        simulation.step()
        with pytest.raises(WorldError, match="none of a script"):
            xgv_cosim.attach(libsumo)
        simulation.step()
    plugin = xgv_cosim.attach(libsumo)
    with pytest.raises(WorldError, match="detach"):
        xgv_cosim.simulate("hello")
    plugin.detach()
    with xgv_cosim.simulate("hello") as simulation:
        simulation.step()


def test_a_step_past_the_plugin_is_told(libsumo: ModuleType) -> None:
    kept = libsumo._libsumo.simulation_step
    with xgv_cosim.attach(libsumo):
        libsumo.start(command(HELLO))
        libsumo.simulationStep()
        kept(0.0)
        for seen_s, past_s in ((0.2, 0.3), (0.3, 0.4)):  # as often as the script goes on
            with pytest.raises(WorldError, match=rf"SUMO is at {past_s} s, but .* lead to {seen_s} s"):
                libsumo.simulationStep()
        libsumo.close()


def test_nothing_of_ours_stays_after_detach(libsumo: ModuleType) -> None:
    before = dict(vars(libsumo)), dict(vars(libsumo.simulation)), dict(vars(libsumo._libsumo))
    xgv_cosim.attach(libsumo).detach()
    assert (dict(vars(libsumo)), dict(vars(libsumo.simulation)), dict(vars(libsumo._libsumo))) == before
