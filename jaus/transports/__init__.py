"""Ways for datagrams: over UDP, and within a process."""

from __future__ import annotations

from jaus.transports.loopback import LoopbackNetwork, LoopbackTransport
from jaus.transports.udp import UdpTransport

__all__ = ["LoopbackNetwork", "LoopbackTransport", "UdpTransport"]
