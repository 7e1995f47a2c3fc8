"""jaus: the protocol of the Joint Architecture for Unmanned Systems, without I/O and without a clock.

Standard library only. In this version: addresses, and components with their status and control as
transition tables. Messages and the wire follow.
"""

from __future__ import annotations

from jaus.address import ComponentId, JausAddress
from jaus.component import Component, ComponentStatus, StatusCommand
from jaus.errors import JausError, LocalProtocolError, ProtocolError, RemoteProtocolError

__all__ = [
    "Component",
    "ComponentId",
    "ComponentStatus",
    "JausAddress",
    "JausError",
    "LocalProtocolError",
    "ProtocolError",
    "RemoteProtocolError",
    "StatusCommand",
]
