"""Large messages: their parts, put together."""

from __future__ import annotations

from dataclasses import dataclass

from jaus.codec import decode_body
from jaus.errors import DecodeError
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

    def __init__(self, *, max_size: int = 1 << 18, max_messages: int = 4) -> None:
        self._max_size = max_size
        self._max_messages = max_messages
        self._under_way: dict[tuple[int, int, int, bool], _Incomplete] = {}
        self.dropped = 0
        """How many messages were begun and never became whole."""

    def __len__(self) -> int:
        """Return how many messages are under way."""
        return len(self._under_way)

    @property
    def size(self) -> int:
        """Return how many bytes are kept."""
        return sum(len(message.body) for message in self._under_way.values())

    def add(self, part: MessagePart) -> Message | UnknownMessage | None:
        """Take a part; return the message if it was the last one, with the header of the first.

        Raises:
            DecodeError: A part before this one is missing, the message grows too large, or the whole body is
                not what the code promises. The message is dropped.
        """
        header = part.header
        key = part.code, header.source_id, header.destination_id, part.is_sae
        if part.data_flag is DataFlag.FIRST:
            self._begin(key, part)
            return None
        message = self._under_way.get(key)
        if message is None or header.sequence == (message.next_sequence - 1) & 0xFFFF:
            return None  # Nothing to add it to, or the part before once more.
        size = len(message.body) + len(part.body)
        if header.sequence != message.next_sequence or size > self._max_size:
            self._drop(key)
            raise DecodeError(
                f"large message {part.code:#06x}: part {header.sequence} with {size} bytes so far, "
                f"expected part {message.next_sequence} and {self._max_size} bytes at most"
            )
        message.body += part.body
        message.next_sequence = (message.next_sequence + 1) & 0xFFFF
        if part.data_flag is not DataFlag.LAST:
            return None
        del self._under_way[key]
        if part.is_sae:
            return UnknownMessage(part.code, bytes(message.body), header=message.first.header)
        return decode_body(part.code, bytes(message.body), message.first.header)

    def _begin(self, key: tuple[int, int, int, bool], part: MessagePart) -> None:
        if key in self._under_way:
            self._drop(key)
        if len(self._under_way) >= self._max_messages:
            self._drop(next(iter(self._under_way)))
        self._under_way[key] = _Incomplete(part, bytearray(part.body), (part.header.sequence + 1) & 0xFFFF)

    def _drop(self, key: tuple[int, int, int, bool]) -> None:
        del self._under_way[key]
        self.dropped += 1
