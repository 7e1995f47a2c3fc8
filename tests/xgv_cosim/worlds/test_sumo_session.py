"""Opening SUMO: what it refuses, what it says, and that the process can go on afterwards."""

from __future__ import annotations

import gzip
from typing import TYPE_CHECKING

import pytest

from tests.contracts.world_contract import nobody
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from pathlib import Path

    from tests.xgv_cosim.worlds.conftest import NewWorld

GOOD_NET = network("hello").read_text()


def config_of(folder: Path, *, net: str = GOOD_NET, routes: str = "<routes/>", extra: str = "") -> Path:
    (folder / "n.net.xml").write_text(net)
    (folder / "r.rou.xml").write_text(routes)
    config = folder / "c.sumocfg"
    config.write_text(
        '<configuration><input><net-file value="n.net.xml"/><route-files value="r.rou.xml"/>'
        f"</input>{extra}</configuration>"
    )
    return config


def complaint(config: Path, *, steps: int = 1, options: tuple[str, ...] = ()) -> str:
    """Return the message of the WorldError, and prove that the process can simulate afterwards."""
    world = SumoWorld.headless(config, step_s=0.1, seed=1, options=options)
    with pytest.raises(WorldError) as failure:  # noqa: PT012 - some errors show only in a step
        world.start()
        for _ in range(steps):
            world.step(nobody())
    world.close()
    after = config.parent / "after"
    after.mkdir()
    sound = SumoWorld.headless(write_config(after, car("a", 100, 10), network("hello")), step_s=0.1, seed=1)
    sound.start()
    assert sound.step(nobody()).ids == ("a",)
    sound.close()
    return str(failure.value)


def test_a_missing_configuration(tmp_path: Path) -> None:
    assert "nowhere.sumocfg" in complaint(tmp_path / "nowhere.sumocfg")


def test_a_configuration_with_an_unknown_option(tmp_path: Path) -> None:
    assert "No option with the name 'bogus' exists" in complaint(
        config_of(tmp_path, extra='<bogus value="1"/>')
    )


def test_a_configuration_that_is_not_xml(tmp_path: Path) -> None:
    config = tmp_path / "c.sumocfg"
    config.write_text("<configuration><input><net-")
    text = complaint(config)
    assert "c.sumocfg" in text
    assert "not well-formed XML" in text
    assert "line 1" in text


@pytest.mark.parametrize(
    ("option", "value", "model"),
    [("lateral-resolution", "0.8", "sublane model"), ("mesosim", "true", "mesoscopic model")],
)
def test_a_model_that_is_not_supported_is_named(tmp_path: Path, option: str, value: str, model: str) -> None:
    """SUMO itself complains of the sublane model that ``lanechange.duration`` is given, which nobody has."""
    said = complaint(config_of(tmp_path, extra=f'<{option} value="{value}"/>'))
    assert (
        f"c.sumocfg chooses SUMO's {model} (option {option}, got '{value}'), which is not supported" in said
    )
    (tmp_path / "plain").mkdir()
    said = complaint(config_of(tmp_path / "plain"), options=(f"--{option}", value))
    assert said.startswith(f"world.sumo.options chooses SUMO's {model}")


def test_a_model_that_is_switched_off_is_no_harm(tmp_path: Path) -> None:
    world = SumoWorld.headless(config_of(tmp_path, extra='<mesosim value="false"/>'), step_s=0.1, seed=1)
    world.start()
    world.close()


def test_a_missing_network(tmp_path: Path) -> None:
    config = config_of(tmp_path)
    (tmp_path / "n.net.xml").unlink()
    text = complaint(config)
    assert "n.net.xml' is not accessible" in text
    assert "\n" not in text


@pytest.mark.parametrize("net", ["<net><edge", "", "no xml at all", GOOD_NET[:900]])
def test_a_broken_network_on_which_libsumo_would_crash(tmp_path: Path, net: str) -> None:
    """``<net><edge`` is a segmentation fault of libsumo 1.28."""
    text = complaint(config_of(tmp_path, net=net))
    assert "n.net.xml is not well-formed XML" in text


def test_a_broken_additional_file_given_as_an_option(tmp_path: Path) -> None:
    """A segmentation fault too."""
    broken = tmp_path / "a.add.xml"
    broken.write_text("<additional><x")
    assert "a.add.xml is not well-formed" in complaint(
        config_of(tmp_path), options=("--additional-files", str(broken))
    )


def test_a_broken_packed_network(tmp_path: Path) -> None:
    config = config_of(tmp_path)
    (tmp_path / "n.net.xml.gz").write_bytes(gzip.compress(b"<net><edge"))
    config.write_text('<configuration><net-file value="n.net.xml.gz"/></configuration>')
    assert "n.net.xml.gz is not well-formed" in complaint(config)


def test_a_network_that_makes_no_sense_says_all_that_sumo_says(tmp_path: Path) -> None:
    text = complaint(config_of(tmp_path, net=GOOD_NET.replace('from="west"', 'from="nowhere"')))
    assert "Unknown from-node 'nowhere' for edge 'road'" in text


def test_a_route_over_an_unknown_edge(tmp_path: Path) -> None:
    routes = '<routes><vehicle id="a" depart="0"><route edges="nix"/></vehicle></routes>'
    assert "edge 'nix' within the route for vehicle 'a' is not known" in complaint(
        config_of(tmp_path, routes=routes)
    )


def test_a_route_error_that_shows_only_later_closes_the_world(tmp_path: Path) -> None:
    """SUMO reads routes as it goes: the second vehicle is met long after the start."""
    routes = (
        '<routes><vehicle id="a" depart="0"><route edges="road"/></vehicle>'
        '<vehicle id="b" depart="400" type="unheard"><route edges="road"/></vehicle></routes>'
    )
    text = complaint(config_of(tmp_path, routes=routes), steps=4001)
    assert "vehicle type 'unheard' for vehicle 'b' is not known" in text


def test_a_second_simulation_in_the_process_is_refused(sumo: NewWorld) -> None:
    first, second = sumo(car("a", 100, 10)), sumo(car("a", 100, 10))
    first.start()
    with pytest.raises(WorldError, match="already runs a simulation in this process"):
        second.start()
    assert first.step(nobody()).ids == ("a",)
    first.close()
    second.start()
    assert second.step(nobody()).ids == ("a",)


def test_somebody_elses_simulation_is_left_alone(sumo: NewWorld) -> None:
    libsumo = load_libsumo()
    libsumo.start(["sumo", "-n", str(network("hello")), "--no-step-log", "true"])
    try:
        with pytest.raises(WorldError, match="already runs a simulation in this process"):
            sumo(car("a", 100, 10)).start()
        assert libsumo.isLoaded()
    finally:
        libsumo.close()


def test_nothing_is_printed_and_warnings_are_kept(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Neither by a configuration that wants to talk nor by a warning on the way."""
    routes = f"<routes>{car('a', 100, 10, kind='DEFAULT_VEHTYPE')}</routes>"
    talkative = config_of(tmp_path, routes=routes, extra='<report><verbose value="true"/></report>')
    world = SumoWorld.headless(talkative, step_s=0.1, seed=1)
    world.start()
    world.step(nobody())
    vehicle = load_libsumo().vehicle
    vehicle.setSpeedMode("a", 0)
    vehicle.setSpeed("a", 0.0)
    world.step(nobody())
    world.close()
    said = capfd.readouterr()
    assert (said.out, said.err) == ("", "")
    assert any("performs emergency braking" in message for message in world.messages)


def test_time_counts_from_the_begin_of_the_configuration(tmp_path: Path) -> None:
    config = config_of(tmp_path, extra='<time><begin value="57600"/></time>')
    world = SumoWorld.headless(config, step_s=0.1, seed=1)
    assert world.start().time_s == 0.0
    assert [world.step(nobody()).time_s for _ in range(3)] == [0.1, 0.2, 0.3]
    world.close()
