"""``report.html``: complete, self-contained, safe, and readable for runs that did not go well."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from xgv_cosim.errors import ReplayError
from xgv_cosim.reports import write_report

VOID = {"meta", "link", "img", "br", "hr", "input"}
SECTIONS = [
    "verdict",
    "expectations",
    "numbers",
    "traffic",
    "modes",
    "vehicles",
    "metrics",
    "collisions",
    "assumptions",
    "provenance",
]


class Page(HTMLParser):
    """Checks that tags close in order, and collects what a test asks about."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.ids: list[str] = []
        self.addresses: list[str] = []
        self.text = ""
        self.feed(text)
        self.close()
        assert not self.open, f"left open: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(value or "")
            if name in {"src", "href", "xlink:href", "srcset", "action", "data", "poster"}:
                self.addresses.append(value or "")
            assert not name.startswith("on"), f"a script in an attribute: {name}"

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not self.open or self.open[-1] != "style":
            self.text += data


def read(path: Path) -> tuple[str, Page]:
    text = path.read_text(encoding="utf-8")
    return text, Page(text)


@pytest.fixture(scope="module")
def page(made_up_run: Path) -> tuple[str, Page]:
    return read(write_report(made_up_run))


@pytest.fixture
def copy_of(made_up_run: Path, tmp_path: Path) -> Callable[..., Path]:
    """Copy the run, without some of its files, with changes to its result."""

    def copy(*without: str, **changes: Any) -> Path:
        folder = tmp_path / "copy"
        shutil.copytree(made_up_run, folder, ignore=shutil.ignore_patterns("report.html", *without))
        result = folder / "result.json"
        if result.exists():
            result.write_text(json.dumps(json.loads(result.read_text()) | changes))
        return folder

    return copy


def test_all_sections_are_there_in_order(page: tuple[str, Page]) -> None:
    assert [name for name in page[1].ids if name in SECTIONS] == SECTIONS


def test_nothing_is_fetched_from_elsewhere(page: tuple[str, Page]) -> None:
    text, parsed = page
    assert parsed.addresses, "the pictures and inner links"
    assert all(address.startswith(("#", "data:image/png;base64,")) for address in parsed.addresses)
    without_pixels = re.sub(r"base64,[A-Za-z0-9+/=]+", "", text)
    assert not re.search(r"https?:|//\w|@import|url\((?!#)", without_pixels)
    assert "script" not in parsed.tags
    assert "link" not in parsed.tags


def test_ids_are_unique_or_name_the_same_thing(page: tuple[str, Page]) -> None:
    """SVG pieces refer to each other by id; two pictures must not mix theirs."""
    definitions = re.findall(r'<(?:clipPath|path|g|symbol) id="([^"]+)"[^>]*>', page[0])
    clips = [name for name in definitions if re.match(r"p[0-9a-f]{10}$", name)]
    assert len(clips) == len(set(clips))


def test_the_story_is_told_in_words(page: tuple[str, Page]) -> None:
    text = " ".join(page[1].text.split())
    assert "Passed: all 2 expectations held." in text
    assert "SafeStop pause from 8.0 s to 28.0 s, met at 25.1 m/s." in text
    assert "drive-by-wire → e-stop pause → drive-by-wire" in text
    assert "SafeStop stop from 12.0 s to the end of the run" in text
    assert "It stood still after 3.2 s and 39 m (ideal 38 m)." in text


def test_reasons_stand_on_hover_and_in_a_table(page: tuple[str, Page]) -> None:
    assert re.search(
        r"<title>safety mode: e-stop disable, 12.00 s to 60.00 s\nwhy: SafeStop stop button</title>", page[0]
    )
    assert page[0].count("SafeStop stop button") >= 2


def test_ledger_shows_what_was_at_work_first(page: tuple[str, Page]) -> None:
    text = page[1].text
    assert text.index("At work in this run (1)") < text.index("XGV-36") < text.index("XGV-43")


def test_provenance_has_seed_hash_and_replay_command(page: tuple[str, Page], made_up_run: Path) -> None:
    trace_hash = json.loads((made_up_run / "result.json").read_text())["trace_hash"]
    assert trace_hash in page[1].text
    assert f"xgv-cosim replay {made_up_run}" in page[1].text


def test_pictures_are_there_and_the_page_stays_light(page: tuple[str, Page]) -> None:
    text, parsed = page
    assert parsed.tags.count("img") == 3, "the overview and two close-ups"
    assert parsed.tags.count("svg") == 5, "timeline, two views from above, two traces"
    assert "stands still" in parsed.text
    assert len(text) < 3_000_000


@pytest.mark.slow
def test_same_folder_gives_the_same_page(made_up_run: Path, page: tuple[str, Page]) -> None:
    assert write_report(made_up_run).read_text(encoding="utf-8") == page[0]


def test_hostile_names_stay_text(make_run: Callable[..., Path], tmp_path: Path) -> None:
    names = ("<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "$\\frac{a}{b}$ &amp; _x")
    text, parsed = read(write_report(make_run(tmp_path / "run", names=names, duration_s=20.0)))
    assert "script" not in parsed.tags
    assert not [address for address in parsed.addresses if not address.startswith(("#", "data:"))]
    for name in names:
        assert name in parsed.text
    assert "<script" not in text


def test_a_run_without_injections_says_so(make_run: Callable[..., Path], tmp_path: Path) -> None:
    _, parsed = read(write_report(make_run(tmp_path / "run", events=False, duration_s=5.0)))
    assert "Nothing acted on any emulated vehicle" in parsed.text
    assert "vehicles" not in parsed.ids
    assert parsed.tags.count("img") == 1


def test_a_run_without_steps_gives_a_page(make_run: Callable[..., Path], tmp_path: Path) -> None:
    _, parsed = read(write_report(make_run(tmp_path / "run", duration_s=0.0)))
    assert "No trajectories were recorded." in parsed.text


def test_one_step_is_enough(make_run: Callable[..., Path], tmp_path: Path) -> None:
    _, parsed = read(write_report(make_run(tmp_path / "run", duration_s=0.1)))
    assert parsed.tags.count("img") >= 1


@pytest.mark.parametrize(
    ("status", "words"),
    [
        ("interrupted", "Interrupted: this is what was recorded until then."),
        ("error", "Ended by an error: this is what was recorded until then."),
    ],
)
def test_a_run_cut_short_says_so(copy_of: Callable[..., Path], status: str, words: str) -> None:
    folder = copy_of(
        "trajectory.parquet", status=status, error="disk is <full>" if status == "error" else None
    )
    _, parsed = read(write_report(folder))
    assert words in parsed.text
    assert "The trajectories are missing" in parsed.text
    assert ("disk is <full>" in parsed.text) == (status == "error")


def test_a_failed_expectation_stands_out(copy_of: Callable[..., Path]) -> None:
    rows = [
        {"text": "it stands", "status": "ok", "detail": "yes"},
        {"text": "it waits", "status": "failed", "detail": "it drove"},
        {"text": "it parks", "status": "not_reached", "detail": ""},
    ]
    _, parsed = read(write_report(copy_of("trajectory.parquet", status="failed", expectations=rows)))
    assert "Failed: 2 of 3 expectations did not hold." in parsed.text
    assert parsed.text.index("it waits") < parsed.text.index("it stands")
    assert "✗ not reached" in parsed.text


def test_collisions_and_teleports_are_listed(copy_of: Callable[..., Path]) -> None:
    contact = {
        "t_s": 9.5,
        "collider": "car_7",
        "victim": "xgv_1",
        "kind": "collision",
        "lane_id": "in_0",
        "position_m": 512.25,
    }
    folder = copy_of(
        "trajectory.parquet",
        collisions=[contact],
        teleports=[
            {"t_s": 11.0, "vehicle": "car_9", "bound": False, "place": "lane e_0 at 3.0 m", "why": ""}
        ],
    )
    text = " ".join(read(write_report(folder))[1].text.split())
    assert "9.5 s" in text
    assert "512.2 m" in text
    assert "car_9 at 11.0 s" in text


def test_a_folder_without_result_still_gives_a_page(copy_of: Callable[..., Path]) -> None:
    _, parsed = read(write_report(copy_of("result.json")))
    assert "Incomplete: the run left no result" in parsed.text
    assert "result.json is missing" in parsed.text
    assert parsed.tags.count("img") == 1, "the overview comes from the trajectories alone"


def test_half_a_line_of_events_is_no_obstacle(copy_of: Callable[..., Path]) -> None:
    folder = copy_of("trajectory.parquet")
    with (folder / "events.jsonl").open("a") as events:
        events.write('{"t_s": 5')
    _, parsed = read(write_report(folder))
    assert "events.jsonl could be read in part only" in parsed.text
    assert "6events in the log" in parsed.text, "the whole lines count"


def test_what_is_no_run_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(ReplayError, match="not a run folder"):
        write_report(tmp_path)
    with pytest.raises(ReplayError, match="no such run folder"):
        write_report(tmp_path / "nowhere")


def test_a_result_of_another_schema_is_refused(copy_of: Callable[..., Path]) -> None:
    with pytest.raises(ReplayError, match="expected 'xgv-cosim/result/1'"):
        write_report(copy_of(schema="other/9"))


def test_no_display_and_no_pyplot_are_needed() -> None:
    code = "import sys, xgv_cosim.reports; sys.exit('matplotlib.pyplot' in sys.modules)"
    environment = {"PATH": "/usr/bin:/bin"}
    assert subprocess.run([sys.executable, "-c", code], env=environment, check=False).returncode == 0
