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


class _Decoders(dict[int, Decoder | None]):
    """Decoders by code, each generated when its first message comes; None: not declared."""

    def __missing__(self, code: int) -> Decoder | None:
        if code not in MESSAGES:
            return None
        self[code] = made = decoder(MESSAGES[code])
        return made


class _Encoders(dict[type, Encoder | None]):
    """Encoders by class, each generated when its first message goes; None: not declared."""

    def __missing__(self, kind: type) -> Encoder | None:
        if MESSAGES.get(getattr(kind, "code", None)) is not kind:  # type: ignore[arg-type]
            return None
        self[kind] = made = encoder(kind)
        return made


_DECODERS = _Decoders()
_ENCODERS = _Encoders()


def decode(data: bytes) -> Decoded:
    """Return what one message with its header says.

    Raises:
        DecodeError: The bytes are not exactly one message, or its body is not what its code promises.
    """
    try:
        properties, code, destination, source, control, sequence = HEADER_LAYOUT.unpack_from(data)
    except struct.error:
        raise DecodeError(f"message: got {len(data)} bytes, expected {HEADER_SIZE} or more") from None
    if control & _SIZE_BITS != len(data) - HEADER_SIZE:
        raise DecodeError(
            f"message {code:#06x}: got {len(data) - HEADER_SIZE} bytes after the header, "
            f"which says {control & _SIZE_BITS}"
        )
    # As Header.from_words, in place: the call would cost a tenth of the whole.
    header = _new(Header)
    header.properties_word = properties
    header.destination_id = destination
    header.source_id = source
    header.sequence = sequence
    if properties & ANSWER_BIT or control > _SIZE_BITS:
        return _special(code, header, control >> 12, data[HEADER_SIZE:])
    return decode_body(code, data, header, HEADER_SIZE)


def decode_body(code: int, data: bytes, header: Header, begin: int = 0) -> Message | UnknownMessage:
    """Return the message with ``code`` whose body is ``data`` from ``begin`` on.

    Raises:
        DecodeError: The body is not what the code promises.
    """
    made = _DECODERS[code]
    if made is None:
        return UnknownMessage(code, data[begin:], header=header)
    try:
        return made(data, begin, header)
    except (struct.error, ValueError) as error:
        raise DecodeError(
            f"{MESSAGES[code].__name__} ({code:#06x}) with a body of {len(data) - begin} bytes: {error}"
        ) from None


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
    body = encode_body(message)
    if len(body) > MAX_BODY_SIZE:
        raise EncodeError(
            f"{_name(message)}: a body of {len(body)} bytes, expected {MAX_BODY_SIZE} at most in one packet; "
            "encode_parts makes several"
        )
    header = message.header
    control = len(body)
    if isinstance(message, MessagePart):
        control |= message.data_flag << 12
    elif isinstance(message, Ack):
        answer = Acknowledgement.POSITIVE if message.positive else Acknowledgement.NEGATIVE
        header = header.with_acknowledgement(answer)
        return _packed(message, header, control, message.sequence)
    return _packed(message, header, control, header.sequence) + body


def _packed(message: Decoded, header: Header, control: int, sequence: int) -> bytes:
    if header is UNADDRESSED:
        raise EncodeError(f"{_name(message)}: it has no header; address it with to(...)")
    try:
        return HEADER_LAYOUT.pack(
            header.properties_word,
            message.code,
            header.destination_id,
            header.source_id,
            control,
            sequence,
        )
    except struct.error as error:
        raise EncodeError(f"{_name(message)}: code or sequence number: {error}") from None


def encode_body(message: Decoded) -> bytes:
    """Return the body of a message, without its header.

    Raises:
        EncodeError: A value is missing or does not fit.
    """
    made = _ENCODERS[type(message)]
    if made is not None:
        try:
            return made(message)
        except (struct.error, TypeError, ValueError, OverflowError, AttributeError, IndexError) as error:
            raise EncodeError(f"{_name(message)}{_culprit(message) or f': {error}'}") from None
    if isinstance(message, Ack):
        return b""
    if isinstance(message, UnknownMessage | MessagePart):
        return message.body
    raise EncodeError(f"{type(message).__name__}: not a declared message")


def encode_parts(message: Message | UnknownMessage, max_body_size: int = MAX_BODY_SIZE) -> list[bytes]:
    """Return the packets of a message of any size; sequence numbers run on from the first packet's 0.

    Raises:
        EncodeError: As with ``encode``.
    """
    body = encode_body(message)
    if len(body) <= max_body_size:
        return [encode(message)]
    pieces = [body[begin : begin + max_body_size] for begin in range(0, len(body), max_body_size)]
    flags = [DataFlag.FIRST, *[DataFlag.NORMAL] * (len(pieces) - 2), DataFlag.LAST]
    return [
        encode(MessagePart(message.code, piece, flag, header=message.header.with_sequence(number & 0xFFFF)))
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
