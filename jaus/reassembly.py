"""Large messages: their parts, put together."""

from __future__ import annotations

from dataclasses import dataclass

from jaus.codec import decode_body
from jaus.header import DataFlag
from jaus.messages import Message, MessagePart, UnknownMessage


@dataclass(slots=True)
class _Incomplete:
    first: MessagePart
    body: bytearray
    next_sequence: int


class Reassembly:
    """Puts the parts of large messages together; a gap drops the message.

    Args:
        max_size: Greatest body, in bytes; a message that grows larger is dropped.
        max_messages: How many may be under way at once; one more, and the oldest is dropped.
    """

    def __init__(self, *, max_size: int = 1 << 20, max_messages: int = 8) -> None:
        self._max_size = max_size
        self._max_messages = max_messages
        self._under_way: dict[tuple[int, int], _Incomplete] = {}

    def __len__(self) -> int:
        """Return how many messages are under way."""
        return len(self._under_way)

    def add(self, part: MessagePart) -> Message | UnknownMessage | None:
        """Take a part; return the message if it was the last one, with the header of the first.

        Raises:
            DecodeError: The whole body is not what the code promises.
        """
        key = part.code, part.header.source_id
        if part.data_flag is DataFlag.FIRST:
            self._begin(key, part)
            return None
        message = self._under_way.get(key)
        if message is None or part.header.sequence == (message.next_sequence - 1) & 0xFFFF:
            return None  # Nothing to add it to, or the part before once more.
        fits = len(message.body) + len(part.body) <= self._max_size
        if part.header.sequence != message.next_sequence or not fits:
            del self._under_way[key]
            return None
        message.body += part.body
        message.next_sequence = (message.next_sequence + 1) & 0xFFFF
        if part.data_flag is not DataFlag.LAST:
            return None
        del self._under_way[key]
        return decode_body(part.code, bytes(message.body), message.first.header)

    def _begin(self, key: tuple[int, int], part: MessagePart) -> None:
        self._under_way.pop(key, None)
        if len(self._under_way) >= self._max_messages:
            del self._under_way[next(iter(self._under_way))]
        self._under_way[key] = _Incomplete(part, bytearray(part.body), (part.header.sequence + 1) & 0xFFFF)
