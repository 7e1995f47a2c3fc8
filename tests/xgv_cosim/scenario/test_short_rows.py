"""``--bind``, ``--inject`` and a SUMO configuration without a scenario file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from xgv_cosim.errors import ScenarioError, WorldConfigurationError
from xgv_cosim.scenario.loading import load_scenario
from xgv_cosim.scenario.model import VehicleQuery

HELLO = Path(__file__).parents[3] / "sumo_scenarios" / "hello" / "hello.sumocfg"


@pytest.mark.parametrize(
    ("text", "vehicles"),
    [
        ("veh_1", "veh_1"),
        ("xgv_*", "xgv_*"),
        ("a,b", ("a", "b")),
        ("share=0.25", VehicleQuery(share=0.25)),
        ("via=road,route=r_*", VehicleQuery(via="road", route="r_*")),
        ("type=bus*,share=0.5,seed=7", VehicleQuery(type="bus*", share=0.5, seed=7)),
    ],
)
def test_bind_says_which_vehicles(text: str, vehicles: object) -> None:
    assert load_scenario(HELLO, bind=[text]).bind[0].vehicles == vehicles


def test_bind_takes_the_keys_of_a_row_and_of_its_sections() -> None:
    row = load_scenario(HELLO, bind=["xgv_*,coupling=lane,driver=none,plant.friction=0.5"]).bind[0]
    assert (row.coupling.value, row.driver, row.plant.friction) == ("lane", "none", 0.5)


def test_inject_says_who_when_what_and_how_long() -> None:
    row = load_scenario("hello", inject=["a,b@3.5 error code=9109 duration_s=5"]).injections[-1]
    assert (row.vehicles, row.at_s, row.kind.value) == (("a", "b"), 3.5, "error")
    assert (row.code, row.duration_s) == (9109, 5)


def test_inject_waits_for_a_condition() -> None:
    text = "xgv_*@speed_above_mps=10,mode_of.vehicle=xgv_0,mode_of.mode=estop_pause,at_s=2 door"
    row = load_scenario("hello", inject=[text]).injections[-1]
    assert row.at_s == 2
    assert row.when is not None
    assert row.when.condition().words() == ("speed above 10 m/s", "xgv_0 in estop_pause")


def test_an_id_may_hold_an_at_sign() -> None:
    assert load_scenario("hello", inject=["car@home@2 door"]).injections[-1].vehicles == "car@home"


def test_rows_come_behind_those_of_the_scenario() -> None:
    plain = load_scenario("hello")
    more = load_scenario("hello", bind=["share=1"], inject=["*@3 door"])
    assert (more.bind[:-1], more.injections[:-1]) == (plain.bind, plain.injections)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"bind": [""]}, "--bind : no vehicles are named; expected VEHICLES[,key=value...]"),
        ({"bind": ["a,share=0.5"]}, "got names (a) and share=0.5; use one of the two"),
        ({"bind": ["a,coupling=bus"]}, "--bind a,coupling=bus: bind.1.coupling: got 'bus'"),
        ({"bind": ["a,couplng=free"]}, "unknown key (did you mean 'coupling'?)"),
        ({"bind": ["a,preset.x.y=1,preset=2"]}, "bind.1.preset"),
        ({"bind": ["a,=1"]}, "got '=1' where key=value should stand"),
        ({"bind": ["a,coupling=[1"]}, "'[1' is not a value"),
        ({"bind": ["share=2"]}, "--bind share=2: bind.1.vehicles.share: got 2, expected 1 or less"),
        ({"inject": [""]}, "got '' where VEHICLES@WHEN should stand"),
        ({"inject": ["a estop_pause"]}, "got 'a' where VEHICLES@WHEN should stand"),
        ({"inject": ["@3 door"]}, "no vehicles are named"),
        ({"inject": ["a@3"]}, "it does not say what happens"),
        ({"inject": ["a@3 code=9109"]}, "it does not say what happens"),
        ({"inject": ["a@soon door"]}, "at_s: got 'soon', expected a number (seconds)"),
        ({"inject": ["a@3 dor"]}, "did you mean 'door'?"),
        ({"inject": ["a@speed_above=3 door"]}, "(did you mean 'speed_above_mps' (m/s)?)"),
        ({"inject": ["a@position_above_m=3 door"]}, "say which 'lane' too"),
        ({"inject": ["a@mode_of.vehicle=b door"]}, "injections.1.when.mode_of.mode: is missing"),
        ({"inject": ["a@3 door 5"]}, "got '5' where key=value should stand"),
    ],
)
def test_a_wrong_row_names_its_option(options: dict[str, list[str]], problem: str) -> None:
    with pytest.raises(ScenarioError) as raised:
        load_scenario("hello", **options)  # type: ignore[arg-type]
    assert problem in "\n".join(raised.value.problems)


def test_a_configuration_runs_from_its_begin_to_its_end_in_our_step() -> None:
    scenario = load_scenario(HELLO)
    assert (scenario.name, scenario.step_s) == ("hello", 0.1)
    assert scenario.source.resolve(scenario.world.sumo.config) == HELLO.resolve()


def config(folder: Path, inside: str) -> Path:
    file = folder / "my net.sumocfg"
    file.write_text(f"<configuration>{inside}</configuration>")
    return file


@pytest.mark.parametrize(
    ("inside", "expected"),
    [
        ('<begin value="25200"/><end value="28800"/>', {"duration_s": 3600.0}),
        ('<b v="0:10:00"/><e v="1:00:10:30"/>', {"duration_s": 86430.0}),
        ("", {"duration_s": 300.0}),
        ('<begin value="100"/><end value="-1"/>', {"duration_s": 300.0}),
        ('<seed value="42"/>', {"seed": 42}),
        ("", {"seed": 1, "name": "my_net"}),
    ],
)
def test_times_and_seed_come_from_the_configuration(
    tmp_path: Path, inside: str, expected: dict[str, Any]
) -> None:
    scenario = load_scenario(config(tmp_path, inside))
    assert {key: getattr(scenario, key) for key in expected} == expected


def test_keep_step_takes_the_step_of_the_configuration(tmp_path: Path) -> None:
    fine = config(tmp_path, '<step-length value="0.05"/>')
    assert load_scenario(fine, keep_step=True).step_s == 0.05
    assert load_scenario(fine).step_s == 0.1


def test_a_step_that_cannot_be_kept_names_the_option(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as raised:
        load_scenario(config(tmp_path, ""), keep_step=True)
    assert raised.value.problems == (
        "--keep-step: step_s: got 1.0, expected 0.3 or less (leave --keep-step out: then the step is 0.1 s)",
    )


def test_a_configuration_that_is_not_there_is_a_file_and_no_packaged_scenario(tmp_path: Path) -> None:
    there = config(tmp_path, "")
    (tmp_path / "empty").mkdir()
    near = f" (did you mean {there.name!r}?)"
    for name, hint in (("my nett.sumocfg", near), ("empty/hello.sumocfg", "")):
        with pytest.raises(ScenarioError) as raised:
            load_scenario(tmp_path / name)
        assert str(raised.value) == f"no such file: {tmp_path / name}{hint}"


def test_keep_step_has_no_meaning_for_a_scenario() -> None:
    with pytest.raises(ScenarioError, match=r"--keep-step is for a SUMO configuration \(\.sumocfg\)"):
        load_scenario("hello", keep_step=True)


def test_a_time_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="begin: got 'dawn', expected seconds or"):
        load_scenario(config(tmp_path, '<begin value="dawn"/>'))


def test_a_configuration_that_is_not_xml(tmp_path: Path) -> None:
    file = tmp_path / "x.sumocfg"
    file.write_text("<configuration>")
    with pytest.raises(WorldConfigurationError, match="not well-formed XML"):
        load_scenario(file)
