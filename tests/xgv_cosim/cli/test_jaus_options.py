"""``--jaus``, ``--jaus-peer`` and ``--allow-network``: what they mean, what is refused with which words."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

import xgv_cosim
from xgv_cosim.cli.jaus_options import jaus_options
from xgv_cosim.errors import LinkError, ReplayError, ScenarioError
from xgv_cosim.links.jaus_network import JausOptions
from xgv_cosim.runs import replay, run_scenario
from xgv_cosim.scenario.loading import load_scenario


def test_a_place_and_peers() -> None:
    options = jaus_options("127.0.0.1:3794", ["127.0.0.2:4000", "127.0.0.1:4001"], allow_network=False)
    assert options == JausOptions("127.0.0.1", 3794, (("127.0.0.2", 4000), ("127.0.0.1", 4001)))
    assert jaus_options(None, [], allow_network=False) is None


@pytest.mark.parametrize(
    "text",
    [
        *("", "3794", "127.0.0.1", "127.0.0.1:", "localhost:3794", "127.0.0.1:65536", "127.0.0.256:1"),
        *("127.0.0.1:-1", "1.2.3:4", "::1:3794", "127.0.0.1:37a4", "127.0.0.1 :3794"),
    ],
)
def test_what_is_no_place_is_refused_by_its_option(text: str) -> None:
    with pytest.raises(LinkError, match=r"--jaus: got .*expected an IPv4 address and a UDP port: 127"):
        jaus_options(text, [], allow_network=False)
    with pytest.raises(LinkError, match=r"--jaus-peer: got .*expected an IPv4 address"):
        jaus_options("127.0.0.1:3794", [text], allow_network=False)


@pytest.mark.parametrize(("place", "peer"), [("10.0.0.1:1", "127.0.0.1:2"), ("127.0.0.1:1", "10.0.0.2:2")])
def test_a_network_is_only_spoken_to_where_that_is_asked_for(place: str, peer: str) -> None:
    with pytest.raises(LinkError, match="--allow-network"):
        jaus_options(place, [peer], allow_network=False)
    assert jaus_options(place, [peer], allow_network=True) is not None


def test_a_peer_has_a_port() -> None:
    with pytest.raises(LinkError, match=r"--jaus-peer: got '127\.0\.0\.1:0'"):
        jaus_options("127.0.0.1:0", ["127.0.0.1:0"], allow_network=False)


@pytest.mark.parametrize("host", ["127.example.org", "localhost", ""])
def test_from_python_too_places_are_addresses(host: str) -> None:
    with pytest.raises(LinkError, match="expected an IPv4 address"):
        JausOptions(host=host)


def test_a_peer_without_a_place_is_a_mistake() -> None:
    with pytest.raises(LinkError, match="no --jaus; add --jaus"):
        jaus_options(None, ["127.0.0.1:2"], allow_network=False)


def test_a_port_that_is_taken_ends_the_run_with_its_reason(tmp_path: Path) -> None:
    scenario = load_scenario("hello", ["duration_s=1", "expect=[]", "injections=[]"])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        record = tmp_path / "earlier.pcap"
        record.write_bytes(b"an earlier record")
        options = JausOptions(port=other.getsockname()[1], record=record)
        with pytest.raises(LinkError, match=r"--jaus: UDP 127\.0\.0\.1:.* the port is taken"):
            run_scenario(scenario, tmp_path / "run", jaus=options)
        assert record.read_bytes() == b"an earlier record"


def test_nobody_waits_for_a_client_that_cannot_come(tmp_path: Path) -> None:
    scenario = load_scenario("hello", ["bind.0.stack=external"])
    with pytest.raises(ScenarioError, match=r"bind\.0\.stack: got external.*--jaus 127\.0\.0\.1:3794"):
        run_scenario(scenario, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_run_with_clients_is_counted_told_of_and_not_replayed(tmp_path: Path) -> None:
    scenario = load_scenario("hello", ["duration_s=3", "expect=[]", "injections=[]"])
    told: list[tuple[str, int, str]] = []
    result = run_scenario(
        scenario, tmp_path / "run", jaus=JausOptions(port=0), announce=lambda *row: told.append(row)
    )
    assert [(vehicle, subsystem) for vehicle, subsystem, _ in told] == [("xgv_0", 1), ("xgv_1", 2)]
    assert all(place.startswith("127.0.0.1:") for _, _, place in told)
    assert result.data["jaus"]["datagrams_received"] == 0
    assert result.data["real_time_factor"] == pytest.approx(1.0, rel=0.5)
    with pytest.raises(ReplayError, match="clients on a network"):
        replay(tmp_path / "run")


def test_a_run_without_clients_says_so() -> None:
    with xgv_cosim.simulate("hello") as run:
        run.communicate()  # nobody to serve
        assert run.now_s == 0.0
