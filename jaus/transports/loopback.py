"""Datagrams within a process, in the order in which they were sent: for lockstep and for tests."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Iterable

from jaus.errors import TransportError


class LoopbackNetwork:
    """Where loopback transports find each other.

    Args:
        max_waiting: How many datagrams may wait at one place; further ones are lost, as on a real network.
    """

    def __init__(self, *, max_waiting: int = 100_000) -> None:
        self._max_waiting = max_waiting
        self._waiting: dict[Hashable, deque[tuple[bytes, Hashable]]] = {}

    def open(self, place: Hashable) -> LoopbackTransport:
        """Return the transport of a place.

        Raises:
            TransportError: The place is taken.
        """
        if place in self._waiting:
            raise TransportError(f"loopback {place}: the place is taken")
        self._waiting[place] = deque()
        return LoopbackTransport(self, place)

    def carry(self, datagram: bytes, source: Hashable, destination: Hashable) -> bool:
        """Put a datagram where it goes; return whether somebody is there and has room."""
        waiting = self._waiting.get(destination)
        if waiting is None or len(waiting) >= self._max_waiting:
            return False
        waiting.append((datagram, source))
        return True

    def take(self, place: Hashable, at_most: int) -> list[tuple[bytes, Hashable]]:
        """Return what waits at a place, and take it away."""
        waiting = self._waiting.get(place, deque())
        return [waiting.popleft() for _ in range(min(at_most, len(waiting)))]

    def leave(self, place: Hashable) -> None:
        """Give a place back; what waits there is lost."""
        self._waiting.pop(place, None)


class LoopbackTransport:
    """One place of a loopback network; it is used as a ``UdpTransport`` is."""

    def __init__(self, network: LoopbackNetwork, place: Hashable) -> None:
        self._network = network
        self.place = place
        """Where it listens."""
        self.not_sent = 0
        """How many datagrams found nobody, or no room."""

    def receive(self, at_most: int = 10_000) -> list[tuple[bytes, Hashable]]:
        """Return the datagrams that have arrived, each with where it came from."""
        return self._network.take(self.place, at_most)

    def send(self, datagrams: Iterable[tuple[bytes, Hashable]]) -> None:
        """Send datagrams, each to its place."""
        for datagram, destination in datagrams:
            self.not_sent += not self._network.carry(datagram, self.place, destination)

    def close(self) -> None:
        """Give the place back."""
        self._network.leave(self.place)
