"""What was asked for and did not act is told aloud: result, terminal, report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import xgv_cosim
from xgv_cosim.cli.summary import print_summary
from xgv_cosim.events import Event
from xgv_cosim.recording import REPORT, RESULT
from xgv_cosim.runs.warnings import warnings_of
from xgv_cosim.scenario.loading import load_scenario
from xgv_cosim.scenario.selection import in_words

IDLE = [
    "duration_s=2",
    "expect=[]",
    "bind.0.driver=rider",
    "injections=[{at_s: 0.5, vehicles: 'foo_*', kind: door}, {at_s: 1, vehicles: xgv_0, kind: reinit}]",
]
NOBODY = "matches no vehicle that is bound now"


def test_injections_without_effect_are_warnings(tmp_path: Path, capsys: object) -> None:
    result = xgv_cosim.run("hello", out=tmp_path / "out", set=IDLE)
    assert result.data["warnings"] == [
        f"injection door at 0.5 s did not act (its selector foo_* (injections.0) {NOBODY})",
        "xgv_0: injection reinit at 1 s did not act (profile xgv has no reinit)",
    ]
    assert "xgv_0: injection reinit at 1 s did not act" in (tmp_path / "out" / REPORT).read_text()
    print_summary(result.data, tmp_path / "out")
    assert "warning: injection door at 0.5 s did not act" in capsys.readouterr().out  # type: ignore[attr-defined]


def test_a_run_that_binds_nothing_says_so(tmp_path: Path) -> None:
    overrides = ["duration_s=1", "expect=[]", "injections=[]", "bind.0.vehicles={type: nothing}"]
    xgv_cosim.run("hello", out=tmp_path / "out", set=overrides, report=False)
    warnings = json.loads((tmp_path / "out" / RESULT).read_text())["warnings"]
    assert warnings == ["bind.0: no vehicle that has departed matches type=nothing"]


def test_the_same_is_said_where_only_the_events_are_known() -> None:
    scenario = load_scenario("hello")
    (words,) = {in_words(row.vehicles) for row in scenario.bind}
    assert warnings_of(scenario, []) == [f"bind.0: no vehicle that has departed matches {words}"]


def test_a_run_that_ends_before_its_vehicles_are_bound_says_so(tmp_path: Path) -> None:
    overrides = ["duration_s=1", "expect=[]", "injections=[]", "bind.0.from_s=5"]
    result = xgv_cosim.run("hello", out=tmp_path / "out", set=overrides, report=False)
    told = "no vehicle was bound: whom 'bind' matches was not there between from_s and until_s"
    assert result.data["warnings"] == [told]


def test_rows_that_match_nobody_and_lanes_that_are_not_there_are_named(tmp_path: Path) -> None:
    rows = [
        "{at_s: 1, vehicles: {via: nowhere, type: xgv}, kind: door}",
        "{when: {lane: raod_0}, vehicles: xgv_0, kind: door}",
        "{when: {lane: road_1, position_above_m: 9000}, vehicles: xgv_0, kind: door}",
    ]
    overrides = ["duration_s=2", "expect=[]", f"injections=[{', '.join(rows)}]"]
    bind = ["via=nowhere", "route=r_*,share=0.5", "type=bus*"]
    out = tmp_path / "out"
    result = xgv_cosim.run("hello", out=out, set=overrides, bind=bind, report=False)
    first = len(load_scenario("hello").bind)
    expected = [
        f"bind.{number}: no vehicle that has departed matches {words}, but for those that earlier rows take"
        for number, words in enumerate(("via=nowhere", "route=r_*,share=0.5", "type=bus*"), first)
    ]
    unmet = "no vehicle met its condition (on lane road_1, beyond 9000 m of the lane)"
    assert result.data["warnings"] == [
        *expected,
        "injections.1: door did not act: the network has no lane raod_0; did you mean 'road_0'?",
        f"injections.2: door did not act: {unmet}",
        f"injection door at 1 s did not act (its selector type=xgv,via=nowhere (injections.0) {NOBODY})",
    ]


def test_a_run_without_rows_of_bind_says_so_in_one_line(tmp_path: Path) -> None:
    overrides = ["duration_s=0.2", "expect=[]", "injections=[]", "bind=[]"]
    result = xgv_cosim.run("hello", out=tmp_path / "out", set=overrides, report=False)
    told = "no vehicle is bound: there is no row of 'bind'; add one, or --bind VEHICLES"
    assert result.data["warnings"] == [told]


@pytest.mark.parametrize(("ended_s", "is_told"), [(10.1, False), (11.0, False), (14.0, True), (None, True)])
def test_a_car_that_stands_because_its_engine_is_off_is_told(ended_s: float | None, is_told: bool) -> None:
    """XGV-31: not where its stack started it at once; another car's engine says nothing of this one's."""
    begun = Event(10.0, "xgv_0", "without_drive", "", "engine off", ("nothing drives the car",))
    events = [Event(1.0, "xgv_0", "bound"), begun, Event(10.1, "xgv_1", "without_drive", "engine off", "")]
    if ended_s is not None:
        events.append(Event(ended_s, "xgv_0", "without_drive", "engine off", "", ("lasted",)))
    told = warnings_of(load_scenario("hello"), events)
    line = "xgv_0: nothing drives it from 10 s on: engine off (nothing drives the car)"
    assert told == ([line] if is_told else [])


def test_lost_commands_are_judged_from_the_demand_not_from_the_loss(tmp_path: Path) -> None:
    """XGV-43: the last command lives on for its duration; only then does the car have to stop."""
    overrides = [
        "duration_s=14",
        "expect=[]",
        "injections=[{at_s: 5, vehicles: xgv_0, kind: cmd_loss}]",
    ]
    result = xgv_cosim.run("hello", out=tmp_path / "out", set=overrides, report=False)
    metrics = result.vehicles["xgv_0"]["metrics"]
    assert 0.2 < metrics["stop_demanded_after_s"] < 0.4
    assert 0.98 < metrics["stopping_distance_ratio"] < 1.05
