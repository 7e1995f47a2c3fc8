"""Files that a scenario names must be there."""

from __future__ import annotations

import pytest

from xgv_cosim.errors import ScenarioError
from xgv_cosim.scenario.files import file_problems, input_files, require_files
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
    assert "f.sumocfg is not well-formed XML" in problem.message
    assert problem.key == "world.sumo.config"


def test_without_a_file_the_place_is_the_key(tmp_path):
    data = {"name": "f", "duration_s": 1, "world": {"sumo": {"config": "f.sumocfg"}}}
    (problem,) = file_problems(scenario_from_mapping(data, tmp_path))
    assert str(problem).startswith("world.sumo.config: no file 'f.sumocfg'")


@pytest.mark.parametrize(
    "entries",
    [
        '<net-file v="f.net.xml"/><routes v="a.rou.xml"/>',
        '<n value="f.net.xml"/><r value="a.rou.xml"/>',
        "<net>f.net.xml</net><route-files>a.rou.xml</route-files>",
    ],
)
def test_every_spelling_that_sumo_takes_names_a_file(scenario, tmp_path, entries):
    (tmp_path / "f.sumocfg").write_text(f"<configuration>{entries}</configuration>")
    problems = file_problems(scenario)
    assert [problem.message.split("'")[3] for problem in problems] == ["f.net.xml", "a.rou.xml"]
    for name in ("f.net.xml", "a.rou.xml"):
        (tmp_path / name).write_text("<x/>")
    assert input_files(scenario) == tuple(tmp_path / name for name in ("f.sumocfg", "f.net.xml", "a.rou.xml"))


def with_options(folder, *words):
    sumo = {"config": "f.sumocfg", "options": list(words)}
    return scenario_from_mapping({"name": "f", "duration_s": 1, "world": {"sumo": sumo}}, folder)


def test_files_named_in_options_lie_beside_the_configuration_and_replace_its_own(
    tmp_path, tmp_path_factory, monkeypatch
):
    (tmp_path / "f.sumocfg").write_text(CONFIG)
    (tmp_path / "f.net.xml").write_text("<x/>")
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    scenario = with_options(tmp_path, "-r", "c.rou.xml", "--load-state=s.xml")
    route, state = file_problems(scenario)
    assert route.message.startswith("--route-files names the file 'c.rou.xml', which is not there")
    assert state.message.startswith("--load-state names the file 's.xml'")
    assert route.key == "world.sumo.options"
    for name in ("c.rou.xml", "s.xml"):
        (tmp_path / name).write_text("<x/>")
    names = ("f.sumocfg", "f.net.xml", "c.rou.xml", "s.xml")
    assert input_files(scenario) == tuple(tmp_path / name for name in names)


def test_an_option_that_is_for_the_scenario_to_say_is_a_problem_of_the_scenario(tmp_path):
    (tmp_path / "f.sumocfg").write_text("<configuration/>")
    (problem,) = file_problems(with_options(tmp_path, "--seed", "4"))
    assert problem.key == "world.sumo.options"
    assert "--seed cannot be given" in problem.message
