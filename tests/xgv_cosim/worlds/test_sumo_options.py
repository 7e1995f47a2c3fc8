"""What the user may tell SUMO, in all the spellings that SUMO takes."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from tests.contracts.world_contract import nobody
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.errors import WorldConfigurationError
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.options import Option, parse_options
from xgv_cosim.worlds.sumo.session import QUIET, SAFETY
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from pathlib import Path

    from tests.xgv_cosim.worlds.conftest import NewWorld


@pytest.mark.parametrize(
    ("words", "options"),
    [
        (["--time-to-teleport", "-1"], [("time-to-teleport", "-1")]),
        (["--time-to-teleport=-.5"], [("time-to-teleport", "-.5")]),
        (["--verbose", "--scale", "2"], [("verbose", "true"), ("scale", "2")]),
        (["--verbose", "false"], [("verbose", "false")]),
        (["-W"], [("no-warnings", "true")]),
        (["-vW", "false"], [("verbose", "true"), ("no-warnings", "false")]),
        (["-ra.xml", "-n=b.xml"], [("route-files", "a.xml"), ("net-file", "b.xml")]),
        (["-vr", "a.xml"], [("verbose", "true"), ("route-files", "a.xml")]),
        (["--routes", "a.xml"], [("route-files", "a.xml")]),
        (["stray"], [("", "stray")]),
    ],
)
def test_options_are_taken_apart_as_sumo_does(words: list[str], options: list[tuple[str, str]]) -> None:
    assert parse_options(words) == tuple(Option(*option) for option in options)


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        (("--seed", "3"), "set seed instead"),
        (("--srand=3",), "set seed instead"),
        (("--random",), "set seed instead"),
        (("--step-length", "0.5"), "set step_s instead"),
        (("-c", "other.sumocfg"), "set world.sumo.config instead"),
        (("--configuration-file=other.sumocfg",), "set world.sumo.config instead"),
        (("--error-log", "log.txt"), "use log"),
    ],
)
def test_what_the_scenario_has_a_key_for_is_refused_with_its_name(
    sumo: NewWorld, words: tuple[str, ...], remedy: str
) -> None:
    with pytest.raises(WorldConfigurationError, match=remedy):
        sumo(options=words).start()


@pytest.mark.parametrize(
    "words",
    [
        ("--time-to-teleport", "120"),
        ("--time-to-teleport=120",),
        ("--collision.action", "none", "--collision.mingap-factor=1", "--collision.check-junctions", "false"),
        ("--no-step-log", "true", "--no-duration-log"),
        ("--suppress-warnings", "true"),
        ("-W",),
        ("-v", "false"),
    ],
)
def test_options_of_the_user_win_over_those_chosen_here(sumo: NewWorld, words: tuple[str, ...]) -> None:
    world = sumo(car("a", 100, 10), options=words)
    world.start()
    libsumo = load_libsumo()
    chosen = QUIET | SAFETY | {option.name: option.value for option in parse_options(words)}
    for name, value in chosen.items():
        held = libsumo.simulation.getOption(name)
        assert held == value or float(held) == float(value), name
    assert world.step(nobody()).ids == ("a",)


def test_files_in_options_lie_beside_the_configuration(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = write_config(tmp_path, car("a", 100, 10), network("hello"))
    (tmp_path / "b.rou.xml").write_text(f"<routes>{car('b', 100, 10, kind='DEFAULT_VEHTYPE')}</routes>")
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    world = SumoWorld.headless(config, step_s=0.1, seed=1, options=("-r", "b.rou.xml"))
    world.start()
    assert world.step(nobody()).ids == ("b",)
    world.close()


@pytest.mark.parametrize(
    "entry", ['<additional-files v="x.xml"/>', '<routes value="x.xml"/>', '<w v="x.xml"/>']
)
def test_a_broken_file_is_found_in_every_spelling(tmp_path: Path, entry: str) -> None:
    """SUMO crashes on some of these, so it must not come to read them."""
    (tmp_path / "x.xml").write_text("<additional><x")
    config = tmp_path / "c.sumocfg"
    config.write_text(f'<configuration><net-file v="{network("hello")}"/>{entry}</configuration>')
    with pytest.raises(WorldConfigurationError, match=r"x\.xml is not well-formed XML"):
        SumoWorld.headless(config, step_s=0.1, seed=1).start()


def test_a_configuration_cannot_take_the_seed_from_the_clock(tmp_path: Path) -> None:
    config = tmp_path / "c.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{network("hello")}"/><random value="true"/></configuration>'
    )
    world = SumoWorld.headless(config, step_s=0.1, seed=1)
    world.start()
    assert load_libsumo().simulation.getOption("random") == "false"
    world.close()


def test_input_files_are_named_without_libsumo() -> None:
    code = "import sys, xgv_cosim.worlds.sumo.inputs; sys.exit('libsumo' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
