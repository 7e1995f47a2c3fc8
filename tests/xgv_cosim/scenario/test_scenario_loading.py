"""Bad scenario files: every mistake at once, each with file, line, column and what was meant."""

# ruff: noqa: E501 - in the tables one row is one mistake
from __future__ import annotations

import pytest

from xgv_cosim.errors import ScenarioError
from xgv_cosim.scenario.loading import load_scenario, scenario_from_mapping

GOOD = """\
schema: xgv-cosim/scenario/1
name: small
duration_s: 30
world: {sumo: {config: small.sumocfg}}
bind:
  - vehicles: xgv_*
injections:
  - {at_s: 5.0, vehicles: xgv_0, kind: estop_pause, duration_s: 12.0}
expect:
  - {vehicle: xgv_0, mode: estop_pause, by_s: 5.1}
"""


@pytest.fixture
def in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def problems_of(folder, text, *overrides):
    (folder / "s.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        load_scenario("s.yaml", overrides)
    return caught.value.problems


def changed(old, new):
    assert old in GOOD
    return GOOD.replace(old, new)


def test_good_file_loads_with_its_source(in_folder):
    (in_folder / "s.yaml").write_text(GOOD)
    scenario = load_scenario(in_folder / "s.yaml")
    assert scenario.injections[0].at_s == 5.0
    assert scenario.step_s == 0.1
    assert scenario.source.path == in_folder / "s.yaml"
    assert scenario.source.text == GOOD
    assert scenario.source.resolve("small.sumocfg") == in_folder / "small.sumocfg"
    assert scenario.source.where("injections", 0, "vehicles") == "s.yaml:8:27: injections.0.vehicles"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        # unknown keys
        ("kind: estop_pause", "knid: estop_pause", "s.yaml:8:34: injections.0.knid: unknown key (did you mean 'kind'?)"),
        ("name: small", "name: small\nbindings: []", "s.yaml:3:1: bindings: unknown key"),
        # the right key with the wrong unit
        ("at_s: 5.0", "at_ms: 5000", "s.yaml:8:6: injections.0.at_ms: unknown key (did you mean 'at_s' (seconds)?)"),
        ("duration_s: 30", "duration: 30", "s.yaml:3:1: duration: unknown key (did you mean 'duration_s' (seconds)?)"),
        ("expect:", "xgv: {pause: {decel_kmh: 9}}\nexpect:",
         "s.yaml:9:15: xgv.pause.decel_kmh: unknown key (did you mean 'decel_mps2' (m/s²)?)"),
        ("vehicles: xgv_*", "vehicles: xgv_*\n    desired_speed_kmh: 100",
         "s.yaml:7:5: bind.0.desired_speed_kmh: unknown key (did you mean 'desired_speed_mps' (m/s)?)"),
        # wrong types; a text that looks like a number is no number
        ("duration_s: 30", "duration_s: 30s", ("s.yaml:3:13: duration_s: got '30s', expected a number (seconds) "
         "(write the bare number; its unit stands in the key)")),
        ("duration_s: 30", 'duration_s: "30"', "s.yaml:3:13: duration_s: got '30', expected a number (seconds)"),
        ("duration_s: 30", "duration_s: true", "s.yaml:3:13: duration_s: got true, expected a number (seconds)"),
        ("duration_s: 30", "duration_s: 30\nseed: 1.5", "s.yaml:4:7: seed: got 1.5, expected a whole number"),
        ("vehicles: xgv_*", "vehicles: 7", "s.yaml:6:15: bind.0.vehicles: got 7, expected an id or pattern"),
        ("vehicles: xgv_*", "vehicles: {}", "s.yaml:6:15: bind.0.vehicles: expected at least one of 'type', 'route', 'via', 'share'"),
        ("vehicles: xgv_*", "vehicles: {share: 1.5}", "s.yaml:6:23: bind.0.vehicles.share: got 1.5, expected 1 or less"),
        ("vehicles: xgv_*", "vehicles: []", "s.yaml:6:15: bind.0.vehicles: got [], expected at least one entry"),
        ("- vehicles: xgv_*", "- 7", "s.yaml:6:5: bind.0: got 7, expected a mapping of keys"),
        ("world: {sumo: {config: small.sumocfg}}", "world: {sumo: {}}", "s.yaml:4:15: world.sumo.config: is missing"),
        # unknown words
        ("kind: estop_pause", "kind: estop_puase", "(did you mean 'estop_pause'?)"),
        ("mode: estop_pause", "mode: estop", "s.yaml:10:28: expect.0.mode: got 'estop', expected one of drive_by_wire"),
        ("vehicles: xgv_*", "vehicles: xgv_*\n    driver: ridder", "(did you mean 'rider'?)"),
        ("vehicles: xgv_*", "vehicles: xgv_*\n    preset: ford_escape", "s.yaml:7:13: bind.0.preset: got 'ford_escape'"),
        # numbers that are none, or lie outside
        ("at_s: 5.0", "at_s: .nan", "s.yaml:8:12: injections.0.at_s: got nan, expected a finite number"),
        ("duration_s: 30", "duration_s: .inf", "s.yaml:3:13: duration_s: got inf, expected a finite number"),
        ("expect:", "xgv: {pause: {decel_mps2: .nan}}\nexpect:",
         "s.yaml:9:27: xgv.pause.decel_mps2: got nan, expected a finite number"),
        ("at_s: 5.0", "at_s: -1", "s.yaml:8:12: injections.0.at_s: got -1, expected 0 or more"),
        ("duration_s: 12.0", "duration_s: -12", "s.yaml:8:65: injections.0.duration_s: got -12, expected more than 0"),
        ("duration_s: 30", "duration_s: 30\nstep_s: 0.105",
         "s.yaml:4:9: step_s: got 0.105, expected a whole multiple of the control tick 0.01 s"),
        # things that do not fit together
        ("at_s: 5.0", "at_s: 30", ("s.yaml:8:12: injections.0.at_s: got 30, but the run ends at duration_s 30; "
         "make the run longer or inject earlier")),
        ("by_s: 5.1", "by_s: 30.01", "s.yaml:10:47: expect.0.by_s: got 30.01, but the run ends at duration_s 30"),
        ("expect:", "  - {at_s: 5.0, vehicles: xgv_0, kind: estop_pause, duration_s: 12}\nexpect:",
         "s.yaml:9:5: injections.1: the same as injections.0"),
        ("vehicles: xgv_*", "vehicles: xgv_*\n  - {vehicles: xgv_*, driver: none}",
         "s.yaml:7:16: bind.1.vehicles: never matches: bind.0 takes the same vehicles"),
        ("vehicles: xgv_*", "{vehicles: xgv_*, partial: manual_speed, driver: none}",
         "use driver: rider, driver: world or partial: full (XGV-41)"),
        ("vehicles: xgv_*", "{vehicles: xgv_*, partial: both_manual}",
         "s.yaml:6:32: bind.0.partial: both axes manual are refused (XGV-41)"),
        ("vehicles: xgv_*", "{vehicles: xgv_*, stack: none, desired_speed_mps: 20}", "read by the reference stacks only"),
        ("kind: estop_pause", "kind: error", "s.yaml:8:5: injections.0: kind: error needs 'code'"),
        ("kind: estop_pause", "kind: door, code: 9109", "s.yaml:8:5: injections.0: 'code' goes with kind: error"),
        ("kind: estop_pause", "kind: error, code: 9112",
         "s.yaml:8:53: injections.0.code: got 9112, but the XGV has no such error; near it: 9110 brake communication"),
        ("expect:", "xgv: {errors: {effect: {brake: [9109, 42]}}}\nexpect:",
         "s.yaml:9:39: xgv.errors.effect.brake.1: got 42, but the XGV has no such error; near it: 9101"),
        ("expect:", "xgv: {errors: {latch: hardwear}}\nexpect:", "(did you mean 'hardware'?)"),
        ("expect:", "xgv: {firmware: 1.3}\nexpect:", "s.yaml:9:17: xgv.firmware: got '1.3', expected one of 1.0, 1.1"),
        ("expect:", "xgv: {control: {controller_timeout_s: -1}}\nexpect:", "controller_timeout_s: got -1, expected 0 or"),
        ("mode: estop_pause, ", "", "s.yaml:10:5: expect.0: expected exactly one of mode, standstill"),
        ("mode: estop_pause, ", "mode: estop_pause, standstill: true, ", "got mode and standstill"),
        ("by_s: 5.1", "by_s: 5.1, always: true", "expected exactly one of by_s, always; got both"),
        (", by_s: 5.1", "", "expected exactly one of by_s, always; got neither"),
        ("vehicle: xgv_0, ", "", "mode needs 'vehicle'"),
        ("duration_s: 30", "duration_s: 0.05", "s.yaml:3:13: duration_s: got 0.05, expected at least one step of 0.1 s"),
        ("bind:\n  - vehicles: xgv_*\n", "", "s.yaml:6:3: injections: there are injections but no vehicle is bound"),
        # YAML itself
        ("name: small", "name: small\nname: again", "s.yaml:3:1: name: this key stands in line 2 already"),
        ("bind:", "bind: [", "s.yaml:6:3: not valid YAML"),
        ("name: small", "\tname: small", "s.yaml:2:1: not valid YAML"),
    ],
)  # fmt: skip
def test_one_mistake_is_located_and_explained(in_folder, old, new, expected):
    problems = problems_of(in_folder, changed(old, new))
    assert any(expected in problem for problem in problems), problems


def test_a_misspelt_key_is_one_problem_not_two(in_folder):
    problems = problems_of(in_folder, changed("kind: estop_pause", "knid: estop_pause"))
    assert len(problems) == 1


def test_all_mistakes_are_reported_at_once_in_the_order_of_the_file(in_folder):
    text = """\
name: small
duration_s: ten
step_s: 0.015
world: {sumo: {konfig: a.sumocfg}}
bind:
  - {vehicles: xgv_*, driver: none, partial: manual_steering}
injections:
  - {at_s: .inf, vehicles: xgv_0, kind: dor}
  - {at_ms: 3, vehicles: xgv_0, kind: door}
expect:
  - {vehicle: xgv_0, by_s: 5}
"""
    places = [problem.split(": ")[:2] for problem in problems_of(in_folder, text, "named=x")]
    assert places == [
        ["s.yaml:2:13", "duration_s"],
        ["s.yaml:3:9", "step_s"],
        ["s.yaml:4:16", "world.sumo.konfig"],
        ["s.yaml:6:5", "bind.0"],
        ["s.yaml:8:12", "injections.0.at_s"],
        ["s.yaml:8:41", "injections.0.kind"],
        ["s.yaml:9:6", "injections.1.at_ms"],
        ["s.yaml:11:5", "expect.0"],
        ["--set named=x", "named"],
    ]


def test_disagreements_are_found_beside_a_mistake_elsewhere(in_folder):
    text = changed("at_s: 5.0", "at_s: 31").replace("name: small", "name: 3")
    assert [problem.split(": ")[1] for problem in problems_of(in_folder, text)] == [
        "name",
        "injections.0.at_s",
    ]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", "the file is empty"),
        ("# only a comment\n", "the file is empty"),
        ("- a\n- b\n", "expected keys such as"),
    ],
)
def test_a_file_without_keys_is_no_scenario(in_folder, content, expected):
    (problem,) = problems_of(in_folder, content)
    assert problem.startswith("s.yaml: not a scenario")
    assert expected in problem


def test_none_and_no_are_words_and_merge_keys_work(in_folder):
    text = changed(
        "  - vehicles: xgv_*\n",
        "  - &base {vehicles: xgv_*, driver: none}\n  - {<<: *base, vehicles: car_*}\n",
    )
    (in_folder / "s.yaml").write_text(text)
    rows = load_scenario("s.yaml").bind
    assert [(row.vehicles, row.driver) for row in rows] == [("xgv_*", "none"), ("car_*", "none")]


def test_a_mistake_behind_a_merge_key_is_located_where_it_stands(in_folder):
    text = changed(
        "  - vehicles: xgv_*\n", "  - &base {vehicles: xgv_*, driver: no}\n  - {<<: *base, vehicles: car_*}\n"
    )
    problems = problems_of(in_folder, text)
    assert [problem.split(": ")[:2] for problem in problems] == [
        ["s.yaml:6:37", "bind.0.driver"],
        ["s.yaml:6:37", "bind.1.driver"],
    ]


def test_an_alias_of_itself_is_refused(in_folder):
    assert any(
        "contains itself" in problem
        for problem in problems_of(in_folder, changed("bind:", "bind: &b [*b]\nx:"))
    )


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ("freeway_estp", ("no scenario 'freeway_estp': neither a file or folder nor a packaged scenario "
         "(did you mean 'freeway_estop'?); packaged: curve, freeway_estop, hello, link_loss, merge, urban_grid")),
        ("small.yml", "(did you mean 'small.yaml'?)"),
        ("nowhere/small.yaml", "no scenario 'nowhere/small.yaml'"),
        ("folder", "folder: a folder without scenario.yaml"),
    ],
)  # fmt: skip
def test_a_missing_file_names_what_is_near(in_folder, asked, expected):
    (in_folder / "small.yaml").write_text(GOOD)
    (in_folder / "folder").mkdir()
    with pytest.raises(ScenarioError) as caught:
        load_scenario(asked)
    assert expected in str(caught.value)


def test_a_folder_and_a_packaged_name_load(in_folder):
    (in_folder / "hello").mkdir()
    (in_folder / "hello" / "scenario.yaml").write_text(GOOD)
    assert load_scenario("hello").name == "hello"
    assert load_scenario("./hello").name == "small"
    assert load_scenario(in_folder / "hello").name == "small"


def test_a_file_that_is_no_text_is_refused(in_folder):
    (in_folder / "s.yaml").write_bytes(b"name: \xff\xfe")
    with pytest.raises(ScenarioError, match=r"s\.yaml: not UTF-8 text \(byte 6\)"):
        load_scenario("s.yaml")


def test_a_mapping_is_checked_like_a_file(tmp_path):
    data = {"name": "m", "duration_s": float("nan"), "world": {"sumo": {"config": "a"}}, "bidn": []}
    with pytest.raises(ScenarioError) as caught:
        scenario_from_mapping(data, tmp_path)
    assert caught.value.problems == (
        "duration_s: got nan, expected a finite number",
        "bidn: unknown key (did you mean 'bind'?)",
    )
