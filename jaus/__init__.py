"""jaus: the protocol of the Joint Architecture for Unmanned Systems, without I/O and without a clock.

Standard library only. RA 3.3 messages as TORC's ByWire XGV speaks them: ``decode`` makes messages of bytes,
``encode`` bytes of messages, and the messages are in ``jaus.messages``. ``jaus.component`` has status and
control of a component as transition tables.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from jaus.address import ComponentId, JausAddress
from jaus.component import Component, StatusCommand
from jaus.errors import (
    DecodeError,
    EncodeError,
    JausError,
    LocalProtocolError,
    ProtocolError,
    RemoteProtocolError,
    TransportError,
)
from jaus.header import Acknowledgement, DataFlag, Header, MessageProperties
from jaus.status import ComponentStatus

if TYPE_CHECKING:
    from jaus.codec import decode, encode, encode_parts
    from jaus.controller import Acknowledged, Controller, NotAcknowledged, SubscriptionRefused
    from jaus.messages import Ack, Message, MessagePart, UnknownMessage
    from jaus.node import Node
    from jaus.packet import Framing, acknowledgement, decode_packet, pack_datagrams, unpack_datagram
    from jaus.port import DatagramRefused, MessageNotSent, MessageReceived, Port
    from jaus.reassembly import Reassembly
    from jaus.service_connection import Client

__all__ = [
    "Ack",
    "Acknowledged",
    "Acknowledgement",
    "Client",
    "Component",
    "ComponentId",
    "ComponentStatus",
    "Controller",
    "DataFlag",
    "DatagramRefused",
    "DecodeError",
    "EncodeError",
    "Framing",
    "Header",
    "JausAddress",
    "JausError",
    "LocalProtocolError",
    "Message",
    "MessageNotSent",
    "MessagePart",
    "MessageProperties",
    "MessageReceived",
    "Node",
    "NotAcknowledged",
    "Port",
    "ProtocolError",
    "Reassembly",
    "RemoteProtocolError",
    "StatusCommand",
    "SubscriptionRefused",
    "TransportError",
    "UnknownMessage",
    "acknowledgement",
    "decode",
    "decode_packet",
    "encode",
    "encode_parts",
    "pack_datagrams",
    "unpack_datagram",
]

# The declarations of all messages take some 50 ms to load; who only needs addresses does not pay for them.
_LAZY = {
    **dict.fromkeys(("decode", "encode", "encode_parts"), "jaus.codec"),
    **dict.fromkeys(("Ack", "Message", "MessagePart", "UnknownMessage"), "jaus.messages"),
    **dict.fromkeys(
        ("Framing", "acknowledgement", "decode_packet", "pack_datagrams", "unpack_datagram"), "jaus.packet"
    ),
    **dict.fromkeys(
        ("Acknowledged", "Controller", "NotAcknowledged", "SubscriptionRefused"), "jaus.controller"
    ),
    **dict.fromkeys(("DatagramRefused", "MessageNotSent", "MessageReceived", "Port"), "jaus.port"),
    "Client": "jaus.service_connection",
    "Node": "jaus.node",
    "Reassembly": "jaus.reassembly",
}


def __getattr__(name: str) -> object:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_LAZY[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
