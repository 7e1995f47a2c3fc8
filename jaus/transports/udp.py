"""Datagrams over a UDP socket that never waits."""

from __future__ import annotations

import errno
import socket
from collections.abc import Iterable
from types import TracebackType
from typing import Self

from jaus.errors import TransportError

MAX_DATAGRAM_SIZE = 65535
SOCKET_BUFFER_SIZE = 1 << 20
"""Bytes that may wait between two looks: some thousand datagrams."""

Place = tuple[str, int]
"""IPv4 address and UDP port; not a name, for to look it up may take seconds."""


class UdpTransport:
    """A bound UDP socket; ``receive`` takes what is there, and nothing blocks.

    Args:
        host: IPv4 address of this machine to listen at; loopback keeps others out.
        port: UDP port; 0 takes a free one.
        may_broadcast: Whether datagrams may go to all of a network at once.

    Raises:
        TransportError: The port is taken, or the address is none of this machine's.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0, *, may_broadcast: bool = False) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, may_broadcast)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SOCKET_BUFFER_SIZE)
        self.not_sent = 0
        """How many datagrams the system did not take: its buffer was full, or no way leads there, or the
        place is none."""
        try:
            self._socket.bind((host, port))
        except (OSError, OverflowError) as error:
            self._socket.close()
            hint = _HINTS.get(getattr(error, "errno", None) or 0, str(error))
            raise TransportError(f"UDP {host}:{port}: {hint}") from None

    @property
    def place(self) -> Place:
        """Return where it listens."""
        host, port = self._socket.getsockname()
        return host, port

    def fileno(self) -> int:
        """Return the socket's file descriptor, to wait for."""
        return self._socket.fileno()

    def receive(self, at_most: int = 10_000) -> list[tuple[bytes, Place]]:
        """Return the datagrams that have arrived, each with where it came from."""
        found: list[tuple[bytes, Place]] = []
        while len(found) < at_most:
            try:
                found.append(self._socket.recvfrom(MAX_DATAGRAM_SIZE))
            except (BlockingIOError, ConnectionRefusedError):
                break
        return found

    def send(self, datagrams: Iterable[tuple[bytes, Place]]) -> None:
        """Send datagrams, each to its place; what the system does not take is counted in ``not_sent``."""
        for datagram, place in datagrams:
            try:
                self._socket.sendto(datagram, place)
            except (OSError, OverflowError):  # The latter for a port beyond 65535.
                self.not_sent += 1

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


_HINTS = {
    errno.EADDRINUSE: "the port is taken; another node manager may listen there, or an earlier run",
    errno.EADDRNOTAVAIL: "this machine has no such address",
    errno.EACCES: "the system does not allow this port",
}
