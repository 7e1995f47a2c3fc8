"""Listens to UDP datagrams of others on an interface: Linux, with the right to see raw packets."""

from __future__ import annotations

import socket
import time
from types import TracebackType
from typing import Self

from jaus.capture import Captured, udp_in_ethernet
from jaus.errors import TransportError

_ALL_PROTOCOLS = 3
"""ETH_P_ALL."""
_OUTGOING = 4
"""PACKET_OUTGOING: on the loopback each packet is seen as it goes and as it comes."""
_LOOPBACK = "lo"


class Sniffer:
    """What goes over an interface, datagram by datagram; nothing is sent, and nobody notices.

    Args:
        interface: Name of the interface, ``lo`` for what stays on this machine.

    Raises:
        TransportError: There is no such interface, no right to listen to it, or no way to on this system.
    """

    def __init__(self, interface: str = _LOOPBACK) -> None:
        family = getattr(socket, "AF_PACKET", None)
        if family is None:
            raise TransportError("listening to others is possible on Linux only; read a capture instead")
        try:
            self._socket = socket.socket(family, socket.SOCK_RAW, socket.htons(_ALL_PROTOCOLS))
        except PermissionError:
            raise TransportError(
                f"{interface}: no right to listen to others (CAP_NET_RAW); run it as root, or record a run"
            ) from None
        try:
            self._socket.bind((interface, 0))
        except OSError as error:
            self._socket.close()
            raise TransportError(f"{interface}: {error.strerror}") from None
        self._interface = interface
        self._skips_outgoing = interface == _LOOPBACK

    def fileno(self) -> int:
        """Return the socket's file descriptor, to wait for."""
        return self._socket.fileno()

    def receive(self, timeout_s: float) -> Captured | None:
        """Return the next UDP datagram with the wall clock's time, None if none comes in time.

        Raises:
            TransportError: The interface is gone, or down.
        """
        ends_s = time.monotonic() + timeout_s
        while (left_s := ends_s - time.monotonic()) > 0.0:
            self._socket.settimeout(left_s)
            try:
                frame, address = self._socket.recvfrom(1 << 16)
            except TimeoutError:
                return None
            except OSError as error:
                raise TransportError(f"{self._interface}: {error.strerror or error}") from None
            if self._skips_outgoing and address[2] == _OUTGOING:
                continue
            found = udp_in_ethernet(frame)
            if found is not None:
                return Captured(time.time(), *found)
        return None

    def close(self) -> None:
        """Listen no more."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
