"""Expectations on made-up runs: what holds, what fails, and what a cut-short run cannot say."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from xgv_cosim.metrics.standstill import stops_of
from xgv_cosim.runs.expectations import (
    CollisionFact,
    Outcome,
    RunFacts,
    VehicleFacts,
    describe,
    evaluate,
)
from xgv_cosim.scenario.model import ExpectationSection

MODES = ((0.0, "software_pause"), (2.0, "drive_by_wire"), (20.0, "estop_pause"), (45.0, "drive_by_wire"))


def car(end_s=60.0, begin_s=0.1, stand=(30.0, 45.0), modes=MODES, ahead=50.0, behind=40.0):
    """A car at 10 m/s, sampled every 0.1 s, that stands from the first to the last time of ``stand``."""
    t_s = np.round(np.arange(round((end_s - begin_s) * 10) + 1) * 0.1 + begin_s, 6)
    speed_mps = np.where((t_s >= stand[0] - 1e-9) & (t_s <= stand[1] + 1e-9), 0.05, 10.0)
    gaps = [np.full(t_s.shape, gap) for gap in (ahead, behind)]
    return VehicleFacts(t_s, speed_mps, t_s, *gaps, [t for t, _ in modes], [mode for _, mode in modes])


def run(vehicle=None, *, end_s=60.0, duration_s=60.0, collisions=()):
    return RunFacts(end_s, duration_s, {"xgv_2": vehicle or car(end_s)}, collisions)


def outcome(facts, **row):
    (result,) = evaluate([ExpectationSection(**row)], facts)
    return result.outcome, result.text


@pytest.mark.parametrize(
    ("mode", "by_s", "expected", "seen"),
    [
        ("estop_pause", 20.0, Outcome.OK, "in force since 20 s"),
        ("estop_pause", 20.1, Outcome.OK, "in force since 20 s"),
        (
            "estop_pause",
            19.99,
            Outcome.FAILED,
            "drive_by_wire since 2 s; estop_pause was in force 20 s to 45 s",
        ),
        ("estop_pause", 44.99, Outcome.OK, "since 20 s"),
        ("estop_pause", 45.0, Outcome.FAILED, "drive_by_wire since 45 s"),
        ("drive_by_wire", 44.9, Outcome.FAILED, "drive_by_wire was in force 2 s to 20 s, 45 s to 60 s"),
        ("drive_by_wire", 45.0, Outcome.OK, "since 45 s"),
        ("drive_by_wire", 60.0, Outcome.OK, "since 45 s"),
        ("estop_disable", 30.0, Outcome.FAILED, "estop_disable was never in force"),
    ],
)
def test_mode_by_is_the_mode_at_that_time(mode, by_s, expected, seen):
    result, text = outcome(run(), vehicle="xgv_2", mode=mode, by_s=by_s)
    assert result is expected
    assert seen in text


def test_back_in_drive_by_wire_does_not_pass_because_of_the_time_before_the_stop():
    stuck = car(modes=MODES[:3], stand=(30.0, 60.0))
    result, _ = outcome(run(stuck), vehicle="xgv_2", mode="drive_by_wire", by_s=50)
    assert result is Outcome.FAILED


def test_mode_always():
    assert outcome(run(), vehicle="xgv_2", mode="drive_by_wire", always=True) == (
        Outcome.FAILED,
        "xgv_2: mode drive_by_wire, always: software_pause from 0 s",
    )
    steady = car(modes=((0.0, "drive_by_wire"), (5.0, "drive_by_wire")))
    assert outcome(run(steady), vehicle="xgv_2", mode="drive_by_wire", always=True)[0] is Outcome.OK


def test_mode_always_begins_at_the_handover():
    """Every car starts in software pause; until 2 s the world's driver drives."""
    driving = dataclasses.replace(car(modes=MODES[:2]), handover_s=2.0)
    result, text = outcome(run(driving), vehicle="xgv_2", mode="drive_by_wire", always=True)
    assert (result, text.rpartition(": ")[2]) == (
        Outcome.OK,
        "in force throughout since the hand-over at 2 s",
    )
    paused = dataclasses.replace(car(), handover_s=2.0)
    result, text = outcome(run(paused), vehicle="xgv_2", mode="drive_by_wire", always=True)
    assert (result, text.rpartition(": ")[2]) == (Outcome.FAILED, "estop_pause from 20 s")
    assert outcome(run(driving), vehicle="xgv_2", mode="software_pause", always=True)[0] is Outcome.FAILED


def test_a_mode_listed_at_every_step_counts_from_its_beginning():
    steps = car(
        modes=(
            (0.0, "software_pause"),
            (1.0, "drive_by_wire"),
            (1.1, "drive_by_wire"),
            (1.2, "drive_by_wire"),
        )
    )
    result, text = outcome(run(steps), vehicle="xgv_2", mode="drive_by_wire", by_s=10)
    assert (result, text.rpartition(": ")[2]) == (Outcome.OK, "in force since 1 s")


@pytest.mark.parametrize(
    ("stand", "by_s", "expected", "seen"),
    [
        ((30.0, 45.0), 30.0, Outcome.OK, "stood since 30 s"),
        ((30.0, 45.0), 29.9, Outcome.FAILED, "10.00 m/s at 29.9 s; it stood 30 s to 45 s"),
        ((30.0, 45.0), 45.0, Outcome.OK, "stood since 30 s"),
        ((30.0, 45.0), 45.05, Outcome.OK, "stood since 30 s"),
        ((30.0, 45.0), 45.1, Outcome.FAILED, "10.00 m/s at 45.1 s; it stood 30 s to 45 s"),
        ((30.0, 30.5), 30.1, Outcome.OK, "stood since 30 s"),  # held for 0.5 s, though most of it after by_s
        ((30.0, 30.4), 30.1, Outcome.FAILED, "it never stood"),  # 0.4 s is no standstill
        ((99.0, 99.0), 40.0, Outcome.FAILED, "it never stood"),
        ((59.5, 60.0), 60.0, Outcome.OK, "stood since 59.5 s"),
    ],
)
def test_standstill_by(stand, by_s, expected, seen):
    result, text = outcome(run(car(stand=stand)), vehicle="xgv_2", standstill=True, by_s=by_s)
    assert result is expected
    assert seen in text


def test_standing_for_less_than_half_a_second_at_the_end_cannot_be_judged():
    result, text = outcome(run(car(stand=(59.7, 60.0))), vehicle="xgv_2", standstill=True, by_s=60)
    assert result is Outcome.NOT_REACHED
    assert "stood since 59.7 s when the run ended at 60 s" in text


@pytest.mark.parametrize(
    ("speed_mps", "expected"),
    [
        (0.099, Outcome.OK),
        (-0.099, Outcome.OK),
        (0.1, Outcome.FAILED),
        (-0.1, Outcome.FAILED),
        (-5.0, Outcome.FAILED),
    ],
)
def test_standstill_is_slower_than_a_tenth_either_way(speed_mps, expected):
    vehicle = car()
    vehicle.speed_mps[:] = speed_mps
    assert outcome(run(vehicle), vehicle="xgv_2", standstill=True, by_s=30)[0] is expected
    assert outcome(run(vehicle), vehicle="xgv_2", standstill=True, always=True)[0] is expected


def test_standstill_always_names_the_first_movement():
    result, text = outcome(run(), vehicle="xgv_2", standstill=True, always=True)
    assert (result, text) == (Outcome.FAILED, "xgv_2: standstill, always: 10.00 m/s at 0.1 s")


HITS = (CollisionFact(40.0, ("car_9", "car_8")), CollisionFact(31.0, ("car_1", "xgv_2")))


@pytest.mark.parametrize(
    ("row", "expected", "seen"),
    [
        (
            {"always": True},
            Outcome.FAILED,
            "whole run: no collision, always: car_1 hit xgv_2 at 31 s, and 1 more",
        ),
        ({"by_s": 30.9}, Outcome.OK, "whole run: no collision up to 30.9 s: none"),
        ({"by_s": 31.0}, Outcome.FAILED, "car_1 hit xgv_2 at 31 s"),
        (
            {"vehicle": "xgv_2", "always": True},
            Outcome.FAILED,
            "xgv_2: no collision, always: car_1 hit xgv_2 at 31 s",
        ),
        ({"vehicle": "xgv_2", "by_s": 30.0}, Outcome.OK, "none"),
    ],
)
def test_no_collision(row, expected, seen):
    result, text = outcome(run(collisions=HITS), no_collision=True, **row)
    assert result is expected
    assert text.endswith(seen)


def test_no_collision_of_a_vehicle_ignores_those_of_others():
    assert outcome(run(collisions=HITS[:1]), vehicle="xgv_2", no_collision=True, always=True)[0] is Outcome.OK


@pytest.mark.parametrize(
    ("min_gap_m", "expected"), [(3.0, Outcome.OK), (3.5, Outcome.OK), (3.500001, Outcome.FAILED)]
)
def test_min_gap_looks_ahead_and_behind(min_gap_m, expected):
    vehicle = car()
    vehicle.gap_behind_m[100] = 3.5
    vehicle.gap_ahead_m[:50] = np.nan
    for row in ({"vehicle": "xgv_2"}, {}):
        result, text = outcome(run(vehicle), min_gap_m=min_gap_m, always=True, **row)
        assert result is expected
        assert "smallest gap 3.50 m behind" in text
    assert "of xgv_2 at 10.1 s" in text


def test_min_gap_up_to_a_time_and_without_anybody_near():
    vehicle = car(behind=np.inf)
    vehicle.gap_ahead_m[300:] = 0.5
    assert outcome(run(vehicle), vehicle="xgv_2", min_gap_m=1.0, by_s=30.0)[0] is Outcome.OK
    assert outcome(run(vehicle), vehicle="xgv_2", min_gap_m=1.0, by_s=30.1)[0] is Outcome.FAILED
    alone = car(ahead=np.inf, behind=np.inf)
    assert outcome(run(alone), vehicle="xgv_2", min_gap_m=1.0, always=True) == (
        Outcome.OK, "xgv_2: gaps of at least 1.0 m, always: nobody was near")  # fmt: skip


@pytest.mark.parametrize(
    "fact", [{"mode": "drive_by_wire"}, {"standstill": True}, {"no_collision": True}, {"min_gap_m": 1.0}]
)
@pytest.mark.parametrize("when", [{"by_s": 5.0}, {"always": True}])
def test_an_unknown_vehicle_fails_with_a_near_name(fact, when):
    result, text = outcome(run(), vehicle="xvg_2", **fact, **when)
    assert result is Outcome.FAILED
    assert text.endswith("no such vehicle was ever bound (did you mean 'xgv_2'?); bound were: xgv_2")


def test_a_vehicle_that_left_cannot_be_as_expected_later():
    left = RunFacts(60.0, 60.0, {"xgv_2": car(end_s=25.0)})
    for fact in ({"mode": "estop_pause"}, {"standstill": True}):
        result, text = outcome(left, vehicle="xgv_2", by_s=40.0, **fact)
        assert result is Outcome.FAILED
        assert text.endswith("it left the simulation at 25 s")
    assert outcome(left, vehicle="xgv_2", mode="estop_pause", by_s=25.0)[0] is Outcome.OK


def test_a_vehicle_that_was_bound_later_says_so():
    late = car(begin_s=10.0, modes=((10.0, "drive_by_wire"),))
    for fact in ({"mode": "drive_by_wire"}, {"standstill": True}):
        result, text = outcome(run(late), vehicle="xgv_2", by_s=5.0, **fact)
        assert result is Outcome.FAILED
        assert text.endswith("it was bound only at 10 s")


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ({"vehicle": "xgv_2", "mode": "estop_pause", "by_s": 20.1}, Outcome.OK),
        ({"vehicle": "xgv_2", "mode": "drive_by_wire", "by_s": 19.0}, Outcome.OK),
        ({"vehicle": "xgv_2", "mode": "estop_disable", "by_s": 21.0}, Outcome.FAILED),
        ({"vehicle": "xgv_2", "mode": "drive_by_wire", "by_s": 50.0}, Outcome.NOT_REACHED),
        ({"vehicle": "xgv_2", "mode": "estop_pause", "by_s": 40.0}, Outcome.NOT_REACHED),
        ({"vehicle": "xgv_2", "standstill": True, "by_s": 40.0}, Outcome.NOT_REACHED),
        ({"no_collision": True, "always": True}, Outcome.NOT_REACHED),
        ({"no_collision": True, "by_s": 20.0}, Outcome.OK),
        ({"vehicle": "xgv_2", "min_gap_m": 45.0, "always": True}, Outcome.FAILED),
        ({"vehicle": "xgv_2", "min_gap_m": 1.0, "always": True}, Outcome.NOT_REACHED),
    ],
)
def test_a_run_cut_short_says_what_it_can(row, expected):
    cut = run(car(end_s=25.0), end_s=25.0, duration_s=60.0)
    assert not cut.is_complete
    result, text = outcome(cut, **row)
    assert result is expected
    if expected is Outcome.NOT_REACHED:
        assert "the run ended at 25 s" in text


def test_without_samples_modes_are_judged_and_motion_is_not():
    bare = VehicleFacts(*[np.zeros(0)] * 5, [0.0, 20.0], ["drive_by_wire", "estop_pause"])
    facts = RunFacts(60.0, 60.0, {"xgv_2": bare})
    assert outcome(facts, vehicle="xgv_2", mode="estop_pause", by_s=30.0)[0] is Outcome.OK
    assert outcome(facts, vehicle="xgv_2", mode="drive_by_wire", by_s=30.0)[0] is Outcome.FAILED
    for when in ({"by_s": 30.0}, {"always": True}):
        result, text = outcome(facts, vehicle="xgv_2", standstill=True, **when)
        assert (result, text.rpartition(": ")[2]) == (Outcome.FAILED, "nothing was recorded of its motion")
    result, text = outcome(facts, vehicle="xgv_2", min_gap_m=1.0, always=True)
    assert (result, text.rpartition(": ")[2]) == (Outcome.FAILED, "no gap was measured")


def test_results_come_in_order_and_read_as_sentences():
    rows = [
        ExpectationSection(vehicle="xgv_2", mode="estop_pause", by_s=20.1),
        ExpectationSection(no_collision=True, always=True),
    ]
    assert [result.text for result in evaluate(rows, run())] == [
        "xgv_2: mode estop_pause at 20.1 s: in force since 20 s",
        "whole run: no collision, always: none",
    ]
    assert [describe(row) for row in rows] == [result.expected for result in evaluate(rows, run())]


def test_stops_are_unbroken_series_of_slow_samples():
    t_s = np.arange(8) * 0.5
    slow = np.array([True, True, False, True, False, False, True, True])
    assert stops_of(t_s, slow) == [(0.0, 0.5), (1.5, 1.5), (3.0, 3.5)]
    assert stops_of(t_s, np.zeros(8, bool)) == []
