"""The commands ``scenarios``, ``init`` and ``check``: output, exit codes, and JSON alone on stdout."""

from __future__ import annotations

import json

import jsonschema
import pytest

import sumo_scenarios
from xgv_cosim.cli import main
from xgv_cosim.scenario.loading import load_scenario


@pytest.fixture
def xgv_cosim(capsys):
    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(list(map(str, arguments)))
        captured = capsys.readouterr()
        return caught.value.code, captured.out, captured.err

    return call


def test_scenarios_shows_what_each_is_and_how_to_run_it(xgv_cosim):
    code, out, _ = xgv_cosim("scenarios")
    assert code == 0
    for info in sumo_scenarios.list_scenarios():
        assert f"xgv-cosim run {info.name}" in out
        assert info.description.split(",", maxsplit=1)[0][:20] in out


def test_scenarios_json(xgv_cosim):
    code, out, err = xgv_cosim("scenarios", "--json")
    rows = json.loads(out)
    assert (code, err) == (0, "")
    assert [row["name"] for row in rows] == [info.name for info in sumo_scenarios.list_scenarios()]
    assert {"curve", "freeway_estop", "hello", "link_loss", "merge", "urban_grid"} == {
        row["name"] for row in rows
    }
    assert set(rows[0]) == {"name", "description", "command", "folder"}


def test_init_makes_a_scenario_that_checks_and_loads(xgv_cosim, tmp_path):
    folder = tmp_path / "mine"
    code, out, _ = xgv_cosim("init", folder)
    assert code == 0
    assert out.splitlines()[-1] == f"next: xgv-cosim run {folder / 'scenario.yaml'}"
    assert xgv_cosim("check", folder / "scenario.yaml")[0] == 0
    assert load_scenario(folder).source.folder == folder
    assert not [entry for entry in folder.rglob("*") if entry.suffix in {".py", ".pyc"}]


def test_init_takes_an_empty_folder_and_refuses_others(xgv_cosim, tmp_path):
    assert xgv_cosim("init", tmp_path)[0] == 0
    before = sorted(tmp_path.iterdir())
    code, _, err = xgv_cosim("init", tmp_path)
    assert code == 2
    assert "is not empty; give the name of a new or empty folder" in err
    assert sorted(tmp_path.iterdir()) == before
    code, _, err = xgv_cosim("init", tmp_path / "scenario.yaml")
    assert (code, "is a file" in err) == (2, True)


def test_init_under_a_file_is_a_system_error(xgv_cosim, tmp_path):
    (tmp_path / "file").write_text("")
    code, _, err = xgv_cosim("init", tmp_path / "file" / "mine")
    assert code == 3
    assert "cannot be written" in err


def test_check_says_ok_in_one_line(xgv_cosim):
    code, out, err = xgv_cosim("check", "freeway_estop")
    assert (code, err, len(out.splitlines())) == (0, "", 1)
    assert out.endswith("freeway_estop/scenario.yaml: ok\n")


BAD = "name: b\nduration_s: 3s\nworld: {sumo: {config: b.sumocfg}}\nbidn: []\n"


def test_check_lists_every_problem_and_ends_with_2(xgv_cosim, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "b.yaml").write_text(BAD)
    code, out, err = xgv_cosim("check", "b.yaml")
    assert (code, out) == (2, "")
    assert err.splitlines() == [
        (
            "b.yaml:2:13: duration_s: got '3s', expected a number (seconds) "
            "(write the bare number; its unit stands in the key)"
        ),
        "b.yaml:4:1: bidn: unknown key (did you mean 'bind'?)",
        "b.yaml: 2 problems",
    ]


def test_check_json_parses_whether_good_bad_or_missing(xgv_cosim, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "b.yaml").write_text(BAD)
    code, out, _ = xgv_cosim("check", "b.yaml", "--json")
    report = json.loads(out)
    assert (code, report["valid"]) == (2, False)
    assert report["problems"][1] == {
        "place": "b.yaml:4:1", "key": "bidn", "message": "unknown key", "hint": "did you mean 'bind'?"
    }  # fmt: skip
    code, out, _ = xgv_cosim("check", "hello", "--json")
    assert (code, json.loads(out)["problems"]) == (0, [])
    code, out, _ = xgv_cosim("check", "nowhere.yaml", "--json")
    assert (code, json.loads(out)["valid"]) == (2, False)


def test_check_finds_missing_sumo_files(xgv_cosim):
    code, _, err = xgv_cosim("check", "hello", "--set", "world.sumo.config=helo.sumocfg")
    assert code == 2
    assert "--set world.sumo.config=helo.sumocfg: world.sumo.config: no file 'helo.sumocfg'" in err
    assert "did you mean 'hello.sumocfg'?" in err


def test_check_schema_prints_a_json_schema(xgv_cosim):
    code, out, _ = xgv_cosim("check", "--schema")
    assert code == 0
    jsonschema.Draft202012Validator.check_schema(json.loads(out))


@pytest.mark.parametrize(
    "arguments", [("check",), ("check", "nowhere.yaml"), ("init",), ("scenarios", "--jsn")]
)
def test_wrong_usage_ends_with_2(xgv_cosim, arguments):
    code, out, err = xgv_cosim(*arguments)
    assert (code, out) == (2, "")
    assert err
