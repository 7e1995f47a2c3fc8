"""What the pictures rest on: the road's axis, the layout of the timeline, moments and colours."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from xgv_cosim.reports import canvas, palette
from xgv_cosim.reports.along_road import along_road, edge_and_index
from xgv_cosim.reports.mode_timeline import mode_timeline
from xgv_cosim.reports.run_data import RunData, read_run
from xgv_cosim.reports.top_down import moments_of
from xgv_cosim.reports.traces import window_of
from xgv_cosim.reports.wording import METRICS


@pytest.fixture(scope="module")
def run(made_up_run: Path) -> RunData:
    return read_run(made_up_run)


def test_distance_goes_on_over_the_edges(run: RunData) -> None:
    """The made-up road is straight along x, so distance along it is x but for where it begins."""
    assert run.trajectory is not None
    road = along_road(run.trajectory)
    assert road.edges == ("in", ":mid_0", "out")
    assert road.share == 1.0
    assert np.abs(road.distance_m - run.trajectory["x"]).max() < 0.1
    assert set(road.lane_index.tolist()) == {0, 1, 2}


@pytest.mark.parametrize(
    ("lane_id", "expected"),
    [("e_1_2", ("e_1", 2)), (":J1_0_3", (":J1_0", 3)), ("lane", ("lane", 0)), ("_", ("_", 0))],
)
def test_edge_and_lane_number_are_read_off_the_id(lane_id: str, expected: tuple[str, int]) -> None:
    assert edge_and_index(lane_id) == expected


def test_standstill_is_seen_where_the_car_stopped(run: RunData) -> None:
    paused, disabled = run.injected
    still_s = run.standstill_s(paused.vehicle_id, paused.injections[0])
    assert still_s is not None
    assert 15.0 < still_s < 20.0
    assert [moment.why for moment in moments_of(run, disabled)] == ["the event begins", "stands still"]
    assert run.standstill_s("nobody", paused.injections[0]) is None


def test_traces_show_the_event_and_what_followed(run: RunData) -> None:
    paused, disabled = run.injected
    assert window_of(run, paused) == (0.0, 40.0)
    from_s, to_s = window_of(run, disabled)
    assert from_s == 4.0
    assert to_s == pytest.approx(12.0 + 10.0 + 12.0)


def test_timeline_covers_the_run_and_nothing_sticks_out(run: RunData) -> None:
    timeline = mode_timeline(run, run.injected)
    assert timeline is not None
    for vehicle in timeline.vehicles:
        rows: dict[float, list[tuple[float, float]]] = {}
        for bar in vehicle.bars:
            assert timeline.left <= bar.x
            assert bar.x + bar.width <= timeline.width
            rows.setdefault(bar.y, []).append((bar.x, bar.x + bar.width))
        assert len(rows) == 3, "control, ready and safety mode"
        for stretches in rows.values():
            assert all(a[1] == pytest.approx(b[0]) for a, b in pairwise(stretches))


def test_timeline_needs_vehicles(run: RunData) -> None:
    assert mode_timeline(run, ()) is None


@pytest.mark.parametrize(
    ("name", "style"),
    [
        ("drive_by_wire", palette.DRIVE_BY_WIRE),
        ("software_pause", palette.SOFTWARE_PAUSE),
        ("estop_pause", palette.ESTOP_PAUSE),
        ("manual_override", palette.MANUAL_OVERRIDE),
        ("emergency_manual_override", palette.EMERGENCY_OVERRIDE),
        ("estop_disable", palette.ESTOP_DISABLE),
        ("E-stop stop", palette.ESTOP_DISABLE),
    ],
)
def test_each_mode_has_its_colour(name: str, style: palette.ModeStyle) -> None:
    assert palette.mode_style(name) == style


def test_an_unknown_mode_keeps_its_name_and_is_grey() -> None:
    assert palette.mode_style("run_wait") == palette.ModeStyle(
        "run wait", palette.UNKNOWN.colour, palette.UNKNOWN.ink
    )


def _luminance(colour: str) -> float:
    channels = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("style", palette.LEGEND, ids=lambda style: style.label)
def test_words_on_a_mode_colour_are_readable(style: palette.ModeStyle) -> None:
    """Contrast of at least 3 to 1, as the guideline for large or bold text asks."""
    light, dark = sorted((_luminance(style.colour), _luminance(style.ink)), reverse=True)
    assert (light + 0.05) / (dark + 0.05) >= 3.0


def test_large_times_to_collision_are_not_shown_to_the_decimal() -> None:
    metric = next(row for row in METRICS if row.key == "min_ttc_s")
    assert metric.cell(8560.3) == "over 60 s"
    assert metric.cell(1.94) == "1.9 s"
    assert metric.cell(None) == "\N{EN DASH}"


def test_the_picture_s_palette_keeps_plain_areas_exact_and_rare_marks_visible() -> None:
    noise = np.random.default_rng(1).integers(90, 200, (300, 400, 3), dtype=np.uint8)
    noise[:100] = 255
    noise[200:220, 300:320] = (217, 101, 15)  # a marker
    few = np.asarray(canvas._with_palette(Image.fromarray(noise)).convert("RGB")).astype(int)
    assert (few[:100] == 255).all()
    assert np.abs(few[205:215, 305:315] - (217, 101, 15)).max() <= 8
