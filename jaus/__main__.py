"""``python -m jaus decode HEX``: say what the bytes of a message or of a datagram mean.

Exit codes: 0 all of it is understood, 1 some of it is no message, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import sys

from jaus.codec import Decoded, decode
from jaus.errors import DecodeError
from jaus.packet import Framing, decode_packet, unpack_datagram
from jaus.text import lines, plain


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m jaus", description="JAUS messages, made readable.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    command = commands.add_parser("decode", help="say what the bytes of a message or of a datagram mean")
    command.add_argument("--json", action="store_true", help="as one JSON document")
    command.add_argument(
        "hex", nargs="+", help="a message with its header, or a datagram; - reads from stdin"
    )
    options = parser.parse_args(arguments)
    text = sys.stdin.read() if options.hex == ["-"] else " ".join(options.hex)
    try:
        data = bytes.fromhex(text.replace(":", " ").removeprefix("0x"))
    except ValueError:
        parser.error("hex: expected pairs of the digits 0 to f, and spaces or colons between them")
    framing, found = decoded(data)
    good = [message for message in found if not isinstance(message, DecodeError)]
    if options.json:
        messages = [{"error": str(m)} if isinstance(m, DecodeError) else plain(m) for m in found]
        document = {"framing": framing, "messages": messages}
        sys.stdout.write(json.dumps(document, indent=2, ensure_ascii=False) + "\n")
    else:
        sys.stdout.write("".join(f"{line}\n" for message in good for line in lines(message)))
        sys.stderr.write("".join(f"{error}\n" for error in found if isinstance(error, DecodeError)))
    return 0 if len(good) == len(found) else 1


def decoded(data: bytes) -> tuple[str | None, list[Decoded | DecodeError]]:
    """Return the name of the framing, None for a bare message, and what the bytes say, error by error.

    What is no datagram is taken for a message.
    """
    try:
        framing, packets = unpack_datagram(data)
    except DecodeError as no_datagram:
        found = _attempt(None, data)
        both = DecodeError(f"neither a datagram ({no_datagram}) nor a message ({found})")
        return None, [both if isinstance(found, DecodeError) else found]
    return framing.name, [_attempt(framing, packet) for packet in packets]


def _attempt(framing: Framing | None, packet: bytes) -> Decoded | DecodeError:
    try:
        return decode(packet) if framing is None else decode_packet(framing, packet)
    except DecodeError as error:
        return error


if __name__ == "__main__":
    sys.exit(main())
