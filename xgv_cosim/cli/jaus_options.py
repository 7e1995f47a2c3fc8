"""Options that let clients that speak JAUS reach the vehicles of a run."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from xgv_cosim.errors import LinkError

if TYPE_CHECKING:
    from xgv_cosim.links.jaus_network import JausOptions

JausPlace = Annotated[
    str | None,
    typer.Option(
        "--jaus",
        metavar="ADDR:PORT",
        help="Let clients that speak JAUS drive, in real time: 127.0.0.1:3794.",
    ),
]
JausPeers = Annotated[
    list[str] | None,
    typer.Option(
        "--jaus-peer",
        metavar="ADDR:PORT",
        help="A client that gets heartbeats before it has spoken; may be given again.",
    ),
]
AllowNetwork = Annotated[
    bool, typer.Option("--allow-network", help="Let --jaus use other addresses than those of the loopback.")
]
JausRecord = Annotated[
    Path | None,
    typer.Option(
        "--jaus-record",
        metavar="FILE.pcap",
        help="Record every datagram of --jaus, as Wireshark reads it.",
    ),
]
_PORTS = 1 << 16


def jaus_options(
    place: str | None, peers: Iterable[str], *, allow_network: bool, record: Path | None = None
) -> JausOptions | None:
    """Return where a run is to be reached, None: nowhere.

    Raises:
        LinkError: An option is no address with a port, or of a network where none is allowed.
    """
    peers = tuple(peers)
    if place is None:
        if peers:
            raise LinkError(f"--jaus-peer: got {peers[0]}, but no --jaus; add --jaus 127.0.0.1:3794")
        if record is not None:
            raise LinkError(f"--jaus-record: got {record}, but no --jaus; add --jaus 127.0.0.1:3794")
        return None
    from xgv_cosim.links.jaus_network import JausOptions  # noqa: PLC0415 - makes every message of JAUS

    host, port = _place(place, "--jaus")
    return JausOptions(
        host,
        port,
        tuple(_place(peer, "--jaus-peer") for peer in peers),
        allow_network=allow_network,
        record=record,
    )


def print_subsystem(vehicle_id: str, subsystem: int, place: str) -> None:
    """Print where a vehicle can be reached."""
    typer.echo(f"JAUS subsystem {subsystem:>3} at {place}: {vehicle_id}")


def _place(text: str, option: str) -> tuple[str, int]:
    host, colon, port = text.rpartition(":")
    parts = host.split(".")
    is_address = len(parts) == 4 and all(part.isdecimal() and int(part) < 256 for part in parts)
    least = 0 if option == "--jaus" else 1
    if not (colon and is_address and port.isdecimal() and least <= int(port) < _PORTS):
        raise LinkError(f"{option}: got {text!r}, expected an IPv4 address and a UDP port: 127.0.0.1:3794")
    return host, int(port)
