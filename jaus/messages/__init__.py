"""Every message of this library, declared as data; the grouping is that of the standard."""

from __future__ import annotations

from jaus.messages import core, discovery, events, platform, torc
from jaus.messages.base import MESSAGES, Ack, Message, MessagePart, UnknownMessage

__all__ = [
    "MESSAGES",
    "Ack",
    "Message",
    "MessagePart",
    "UnknownMessage",
    "core",
    "discovery",
    "events",
    "platform",
    "torc",
]
