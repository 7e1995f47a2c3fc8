"""The packaged scenarios are found, described, valid, and their files are there."""

from __future__ import annotations

import itertools
import subprocess
import sys

import jsonschema
import pytest
from ruamel.yaml import YAML

import sumo_scenarios
from xgv_cosim.scenario.files import file_problems
from xgv_cosim.scenario.loading import load_scenario
from xgv_cosim.scenario.model import json_schema
from xgv_cosim.scenario.selection import matches
from xgv_cosim.traveller import Traveller

NAMES = ("curve", "freeway_estop", "hello", "link_loss", "merge", "urban_grid")


def test_lists_every_scenario_by_name():
    assert tuple(info.name for info in sumo_scenarios.list_scenarios()) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_folder_description_and_name_agree_with_the_file(name):
    info = next(info for info in sumo_scenarios.list_scenarios() if info.name == name)
    data = YAML(typ="safe", pure=True).load((info.folder / "scenario.yaml").read_text())
    assert sumo_scenarios.load(name) == info.folder
    assert info.description == data["description"]
    assert info.description
    assert data["name"] == name


@pytest.mark.parametrize("name", NAMES)
def test_is_valid_by_model_and_by_schema_and_names_files_that_exist(name):
    scenario = load_scenario(name)
    assert file_problems(scenario) == ()
    data = YAML(typ="safe", pure=True).load(scenario.source.text)
    jsonschema.Draft202012Validator(json_schema()).validate(data)


def test_unknown_name_says_what_there_is():
    with pytest.raises(
        LookupError,
        match=rf"no packaged scenario 'helo'; there are: {', '.join(NAMES)}",
    ):
        sumo_scenarios.load("helo")


def test_freeway_estop_injects_the_five_stops_far_apart_on_bound_vehicles():
    scenario = load_scenario("freeway_estop")
    kinds = [row.kind.value for row in scenario.injections]
    assert kinds == ["estop_pause", "estop_disable", "override", "door", "cmd_loss"]
    times = [row.at_s for row in scenario.injections]
    assert min(b - a for a, b in itertools.pairwise(times)) >= 10.0
    for row in scenario.injections:
        assert isinstance(row.vehicles, str)
        assert matches(scenario.bind[0].vehicles, Traveller(row.vehicles, "xgv"), scenario.seed)
        assert any(expected.vehicle == row.vehicles and expected.mode for expected in scenario.expect)


def test_imports_nothing_of_the_plugin():
    script = "import sys, sumo_scenarios; sumo_scenarios.list_scenarios(); print('xgv_cosim' in sys.modules)"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "False"
