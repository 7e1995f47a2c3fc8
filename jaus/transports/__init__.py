"""Ways for datagrams: over UDP, within a process, and listening to those of others."""

from __future__ import annotations

from jaus.transports.loopback import LoopbackNetwork, LoopbackTransport
from jaus.transports.sniffer import Sniffer
from jaus.transports.udp import UdpTransport

__all__ = ["LoopbackNetwork", "LoopbackTransport", "Sniffer", "UdpTransport"]
