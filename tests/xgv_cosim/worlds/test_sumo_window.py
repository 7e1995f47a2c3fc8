"""``--gui`` (issue point 3.10): sumo-gui shows what a headless run does, cars coloured by their modes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from tests.xgv_cosim.step_listener.scripts import Trace, headless_trace
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.entry import run, simulate
from xgv_cosim.errors import WorldConfigurationError, WorldError
from xgv_cosim.mode_styles import DRIVE_BY_WIRE, ESTOP_PAUSE, LEGEND
from xgv_cosim.worlds.sumo.window import find_sumo_gui
from xgv_cosim.worlds.sumo.world import SumoWorld


@pytest.fixture(scope="module")
def x_server() -> Iterator[str]:
    """A display that nobody sees, named as DISPLAY names it."""
    program = shutil.which("Xvfb")
    if program is None:
        pytest.skip("Xvfb is not installed (apt-get install xvfb): no display to open a window on")
    ready, tells = os.pipe()
    server = subprocess.Popen(
        [program, "-displayfd", str(tells), "-screen", "0", "640x480x24", "-nolisten", "tcp"],
        pass_fds=[tells],
        stderr=subprocess.DEVNULL,
    )
    os.close(tells)
    with os.fdopen(ready) as told:
        number = told.readline().strip()  # it says so when it can be used
    yield f":{number}"
    server.terminate()
    server.wait()


@pytest.fixture
def display(x_server: str, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("DISPLAY", x_server)
    return x_server


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return write_config(tmp_path, car("ego", 50.0, 10.0), network("hello"))


def test_the_window_changes_nothing_and_is_painted_on_changes_only(
    display: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    painted: list[tuple[str, object]] = []
    paint = SumoWorld.paint

    def watched(self: SumoWorld, vehicle_id: str, rgb: tuple[int, int, int] | None) -> None:
        painted.append((vehicle_id, rgb))
        paint(self, vehicle_id, rgb)

    monkeypatch.setattr(SumoWorld, "paint", watched)
    trace = Trace()
    with simulate("hello", observers=[trace], gui=True, gui_delay_ms=0) as simulation:
        simulation.run_until(8.0)
        own = simulation.world._session.engine.vehicle  # type: ignore[attr-defined]
        assert own.getColor("xgv_0") == (*ESTOP_PAUSE.rgb, 255)
        assert own.getColor("xgv_1") == (*DRIVE_BY_WIRE.rgb, 255)
        simulation.release("xgv_1")
        simulation.step()
        assert own.getColor("xgv_1") not in {(*style.rgb, 255) for style in LEGEND}
    headless = headless_trace("hello", 80)
    assert trace.rows[:80] == headless.rows
    changes = [rgb for name, rgb in painted if name == "xgv_0"]
    assert changes[-1] == ESTOP_PAUSE.rgb
    assert all(one != other for one, other in pairwise(changes))
    assert painted[-1] == ("xgv_1", None)


def test_a_run_with_gui_has_the_trace_hash_of_one_without(display: str, tmp_path: Path) -> None:
    shown, headless = (
        run(
            "hello",
            out=tmp_path / f"{gui}",
            set=["duration_s=8", "expect=[]"],
            report=False,
            gui=gui,
            gui_delay_ms=0,
        )
        for gui in (True, False)
    )
    assert shown.trace_hash == headless.trace_hash
    traces = [(tmp_path / name / "trace.csv").read_text() for name in ("True", "False")]
    assert traces[0] == traces[1]


def test_a_window_that_is_closed_ends_the_run_with_words(display: str, config: Path) -> None:
    world = SumoWorld.windowed(config, step_s=0.1, seed=1, delay_ms=0)
    world.start()
    world._session._process.kill()  # type: ignore[union-attr]
    with pytest.raises(WorldError, match=r"sumo-gui has ended in .*t\.sumocfg"):
        world.paint("ego", (1, 2, 3))
    world.close()


def test_what_sumo_refuses_is_told_in_its_words(display: str, config: Path) -> None:
    world = SumoWorld.windowed(config, step_s=0.1, seed=1, options=("--no-such-option",), delay_ms=0)
    with pytest.raises(WorldConfigurationError, match=r"cannot start .*no-such-option"):
        world.start()


def test_a_display_that_is_none_is_told(config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    world = SumoWorld.windowed(config, step_s=0.1, seed=1, delay_ms=0)
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(WorldError, match=r"DISPLAY is not set.*xvfb-run"):
        world.start()
    monkeypatch.setenv("DISPLAY", ":4711")
    with pytest.raises(WorldError, match=r"cannot open the display ':4711'.*xvfb-run"):
        world.start()


def test_without_the_extra_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert find_sumo_gui().is_file()
    monkeypatch.setitem(sys.modules, "sumo", None)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(WorldError, match=r"pip install 'xgv-cosim\[gui\]'"):
        find_sumo_gui()
    (tmp_path / "sumo-gui").write_text("#!/bin/sh\n")
    (tmp_path / "sumo-gui").chmod(0o755)
    assert find_sumo_gui() == tmp_path / "sumo-gui"


def test_the_command_line_without_a_display_ends_with_code_3(tmp_path: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    done = subprocess.run(
        [sys.executable, "-m", "xgv_cosim", "run", "hello", "--gui", "--out", str(tmp_path / "run")],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3
    assert "DISPLAY is not set" in done.stderr


def test_every_mode_has_a_colour_of_its_own() -> None:
    assert len({style.rgb for style in LEGEND}) == len(LEGEND)
    assert ESTOP_PAUSE.rgb == (0xD9, 0x65, 0x0F)
