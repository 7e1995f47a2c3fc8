"""Messages to bytes and back: one RA 3.3 message with its header (XGV-55)."""

from __future__ import annotations

import struct

from jaus.errors import DecodeError, EncodeError
from jaus.fields import problem
from jaus.generator import Decoder, Encoder, decoder, encoder
from jaus.header import (
    ANSWER_BIT,
    HEADER_LAYOUT,
    HEADER_SIZE,
    MAX_BODY_SIZE,
    MAX_SEQUENCE,
    UNADDRESSED,
    Acknowledgement,
    DataFlag,
    Header,
)
from jaus.messages import MESSAGES, Ack, Message, MessagePart, UnknownMessage

Decoded = Message | UnknownMessage | Ack | MessagePart
"""What the bytes of a message may turn out to be."""

_new = object.__new__
_POSITIVE = 0x10
_SIZE_BITS = 0xFFF

_pack_header = HEADER_LAYOUT.pack
_unpack_header = HEADER_LAYOUT.unpack_from
_DECODERS: dict[int, Decoder] = {}
"""By code, each generated when its first message comes."""
_ENCODERS: dict[type, Encoder] = {}
"""By class, each generated when its first message goes."""
_BAD_VALUES = (struct.error, TypeError, ValueError, OverflowError, AttributeError, IndexError)
"""What a generated encoder raises on a value that does not fit."""


def decode(data: bytes) -> Decoded:
    """Return what one message with its header says.

    Raises:
        DecodeError: The bytes are not exactly one message, or its body is not what its code promises.
    """
    try:
        properties, code, destination, source, control, sequence = _unpack_header(data)
    except struct.error:
        raise DecodeError(f"message: got {len(data)} bytes, expected {HEADER_SIZE} or more") from None
    if control & _SIZE_BITS != len(data) - HEADER_SIZE:
        raise DecodeError(
            f"message {code:#06x}: got {len(data) - HEADER_SIZE} bytes after the header, "
            f"which says {control & _SIZE_BITS}"
        )
    # In place what Header.from_words and decode_body do: calls would cost a fifth of the whole.
    header = _new(Header)
    header.properties_word = properties
    header.destination_id = destination
    header.source_id = source
    header.sequence = sequence
    if properties & ANSWER_BIT or control > _SIZE_BITS:
        return _special(code, header, control >> 12, data[HEADER_SIZE:])
    made = _DECODERS.get(code)
    if made is None:
        return decode_body(code, data, header, HEADER_SIZE)
    try:
        return made(data, HEADER_SIZE, header)
    except (struct.error, ValueError) as error:
        raise _no_body(code, len(data) - HEADER_SIZE, error) from None


def decode_body(code: int, data: bytes, header: Header, begin: int = 0) -> Message | UnknownMessage:
    """Return the message with ``code`` whose body is ``data`` from ``begin`` on.

    Raises:
        DecodeError: The body is not what the code promises.
    """
    if code not in MESSAGES:
        return UnknownMessage(code, data[begin:], header=header)
    if code not in _DECODERS:
        _DECODERS[code] = decoder(MESSAGES[code])
    try:
        return _DECODERS[code](data, begin, header)
    except (struct.error, ValueError) as error:
        raise _no_body(code, len(data) - begin, error) from None


def _no_body(code: int, size: int, error: Exception) -> DecodeError:
    return DecodeError(f"{MESSAGES[code].__name__} ({code:#06x}) with a body of {size} bytes: {error}")


def _special(code: int, header: Header, data_flag: int, body: bytes) -> Ack | MessagePart:
    if header.properties_word & ANSWER_BIT:
        if body or data_flag:
            raise DecodeError(f"acknowledgement of {code:#06x}: got {len(body)} bytes, expected an empty one")
        return Ack(code, header.sequence, bool(header.properties_word & _POSITIVE), header=header)
    try:
        return MessagePart(code, body, DataFlag(data_flag), header=header)
    except ValueError:
        known = ", ".join(str(flag.value) for flag in DataFlag)
        raise DecodeError(f"message {code:#06x}: got data flag {data_flag}, expected {known}") from None


def encode(message: Decoded) -> bytes:
    """Return the bytes of one message with its header.

    Raises:
        EncodeError: A value is missing or does not fit, nobody has addressed the message, or it is larger
            than one packet.
    """
    made = _ENCODERS.get(type(message))
    if made is None:
        return _with_header(message, encode_body(message))
    try:
        body = made(message)
    except _BAD_VALUES as error:
        raise _bad_value(message, error) from None
    header, size = message.header, len(body)
    if (not header.destination_id and header == UNADDRESSED) or size > MAX_BODY_SIZE:
        return _with_header(message, body)  # Which says what is wrong.
    try:
        head = _pack_header(
            header.properties_word,
            message.code,
            header.destination_id,
            header.source_id,
            size,
            header.sequence,
        )
    except struct.error:
        return _with_header(message, body)
    return head + body


def _with_header(message: Decoded, body: bytes) -> bytes:
    header = message.header
    if header == UNADDRESSED:
        raise EncodeError(f"{_name(message)}: it has no header; address it with to(...)")
    control, sequence = len(body), header.sequence
    if control > MAX_BODY_SIZE:
        raise EncodeError(
            f"{_name(message)}: a body of {control} bytes, expected {MAX_BODY_SIZE} at most in one packet; "
            "encode_parts makes several"
        )
    if type(message) not in _ENCODERS:
        header, control, sequence = _special_header(message, control)
    words = message.code, header.destination_id, header.source_id, control, sequence
    try:
        return _pack_header(header.properties_word, *words) + body
    except struct.error as error:
        raise EncodeError(f"{_name(message)}: code or sequence number: {error}") from None


def _special_header(message: Decoded, size: int) -> tuple[Header, int, int]:
    """Return header, data control and sequence number of what need not be a declared message."""
    header = message.header
    if isinstance(message, MessagePart):
        return header, size | message.data_flag << 12, header.sequence
    if isinstance(message, Ack):
        answer = Acknowledgement.POSITIVE if message.positive else Acknowledgement.NEGATIVE
        return header.with_acknowledgement(answer), size, message.sequence
    return header, size, header.sequence


def encode_body(message: Decoded) -> bytes:
    """Return the body of a message, without its header.

    Raises:
        EncodeError: A value is missing or does not fit.
    """
    if isinstance(message, Ack):
        return b""
    if isinstance(message, UnknownMessage | MessagePart):
        return message.body
    kind = type(message)
    if MESSAGES.get(getattr(kind, "code", -1)) is not kind:
        raise EncodeError(f"{kind.__name__}: not a declared message")
    if kind not in _ENCODERS:
        _ENCODERS[kind] = encoder(kind)
    try:
        return _ENCODERS[kind](message)
    except _BAD_VALUES as error:
        raise _bad_value(message, error) from None


def _bad_value(message: Decoded, error: Exception) -> EncodeError:
    return EncodeError(f"{_name(message)}{_culprit(message) or f': {error}'}")


def encode_parts(message: Message | UnknownMessage, max_body_size: int = MAX_BODY_SIZE) -> list[bytes]:
    """Return the packets of a message of any size; sequence numbers run on from the first packet's 0.

    Raises:
        EncodeError: As with ``encode``.
    """
    body = encode_body(message)
    if len(body) <= max_body_size:
        return [_with_header(message, body)]
    pieces = [body[begin : begin + max_body_size] for begin in range(0, len(body), max_body_size)]
    flags = [DataFlag.FIRST, *[DataFlag.NORMAL] * (len(pieces) - 2), DataFlag.LAST]
    return [
        encode(
            MessagePart(message.code, piece, flag, header=message.header.with_sequence(number & MAX_SEQUENCE))
        )
        for number, (piece, flag) in enumerate(zip(pieces, flags, strict=True))
    ]


def _culprit(message: object) -> str | None:
    """Return the first field whose value does not fit, and why; None if it is not a single field's fault."""
    if not isinstance(message, Message):
        return None
    for field in message.fields:
        value = getattr(message, field.name, None)
        if value is None and field.bit is not None:
            continue
        if text := problem(field.kind, value):
            return f".{field.name}: {text}"
    return None


def _name(message: Decoded) -> str:
    return type(message).__name__
