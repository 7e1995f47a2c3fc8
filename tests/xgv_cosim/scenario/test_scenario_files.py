"""Files that a scenario names must be there."""

from __future__ import annotations

import pytest

from xgv_cosim.errors import ScenarioError
from xgv_cosim.scenario.files import file_problems, require_files
from xgv_cosim.scenario.loading import load_scenario, scenario_from_mapping

TEXT = "name: f\nduration_s: 1\nworld: {sumo: {config: f.sumocfg}}\n"
CONFIG = """<configuration><input>
<net-file value="f.net.xml"/><route-files value="a.rou.xml, b.rou.xml"/>
</input></configuration>"""


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(TEXT)
    return load_scenario("s.yaml")


def test_all_there(scenario, tmp_path):
    (tmp_path / "f.sumocfg").write_text(CONFIG)
    for name in ("f.net.xml", "a.rou.xml", "b.rou.xml"):
        (tmp_path / name).write_text("<x/>")
    assert file_problems(scenario) == ()
    require_files(scenario)


def test_missing_configuration_is_located_with_a_near_name(scenario, tmp_path):
    (tmp_path / "ff.sumocfg").write_text(CONFIG)
    (problem,) = map(str, file_problems(scenario))
    assert problem.startswith("s.yaml:3:24: world.sumo.config: no file 'f.sumocfg' in ")
    assert problem.endswith("(did you mean 'ff.sumocfg'?)")


def test_every_missing_input_is_named(scenario, tmp_path):
    (tmp_path / "f.sumocfg").write_text(CONFIG)
    (tmp_path / "a.rou.xml").write_text("<x/>")
    problems = [str(problem) for problem in file_problems(scenario)]
    assert [problem.split("'")[3] for problem in problems] == ["f.net.xml", "b.rou.xml"]
    with pytest.raises(ScenarioError, match="f: files are missing") as caught:
        require_files(scenario)
    assert len(caught.value.problems) == 2


def test_a_configuration_that_is_no_xml_is_refused(scenario, tmp_path):
    (tmp_path / "f.sumocfg").write_text("<configuration>")
    (problem,) = file_problems(scenario)
    assert "is not XML" in problem.message


def test_without_a_file_the_place_is_the_key(tmp_path):
    data = {"name": "f", "duration_s": 1, "world": {"sumo": {"config": "f.sumocfg"}}}
    (problem,) = file_problems(scenario_from_mapping(data, tmp_path))
    assert str(problem).startswith("world.sumo.config: no file 'f.sumocfg'")
