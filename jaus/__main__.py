"""``python -m jaus decode HEX`` and ``python -m jaus read PCAP``: say what bytes mean.

Exit codes: 0 all of it is understood, 1 some of it is no message, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

from jaus.capture import read_pcap
from jaus.codec import Decoded, decode
from jaus.errors import DecodeError
from jaus.packet import PORT, Framing, decode_packet, unpack_datagram
from jaus.text import lines, plain


def run() -> int:
    """Run the command line as a process; return the exit code. Whoever stops reading has seen enough: 0."""
    try:
        code = main()
        sys.stdout.flush()
    except BrokenPipeError:
        # What is left in the buffer goes nowhere, instead of into a traceback when the interpreter ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m jaus", description="JAUS messages, made readable.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    command = commands.add_parser("decode", help="say what the bytes of a message or of a datagram mean")
    command.add_argument("--json", action="store_true", help="as one JSON document")
    command.add_argument("hex", nargs="+", help="a message with its header or a datagram; - reads stdin")
    command = commands.add_parser("read", help="say what the datagrams of a capture mean")
    command.add_argument("--json", action="store_true", help="one JSON document per datagram and line")
    command.add_argument("--port", type=int, default=PORT, help="UDP port, by default %(default)s; 0 for any")
    command.add_argument("pcap", type=Path, help="a file that this library, tcpdump or Wireshark wrote")
    options = parser.parse_args(arguments)
    if options.command == "read":
        return _read(parser, options.pcap, options.port, as_json=options.json)
    text = sys.stdin.read() if options.hex == ["-"] else " ".join(options.hex)
    try:
        data = bytes.fromhex(text.replace(":", " ").removeprefix("0x"))
    except ValueError:
        parser.error("hex: expected pairs of the digits 0 to f, and spaces or colons between them")
    framing, found = decoded(data)
    if options.json:
        sys.stdout.write(json.dumps(_document(framing, found), indent=2) + "\n")
    else:
        _show(found)
    return 1 if any(isinstance(message, DecodeError) for message in found) else 0


def _read(parser: argparse.ArgumentParser, path: Path, port: int, *, as_json: bool) -> int:
    failed = False
    try:
        for time_s, source, destination, datagram in read_pcap(path.read_bytes()):
            if port and port not in {source[1], destination[1]}:
                continue
            framing, found = decoded(datagram)
            failed |= any(isinstance(message, DecodeError) for message in found)
            places = [f"{host}:{number}" for host, number in (source, destination)]
            if as_json:
                document = {"time_s": time_s, "from": places[0], "to": places[1]} | _document(framing, found)
                sys.stdout.write(json.dumps(document) + "\n")
            else:
                sys.stdout.write(f"{time_s:.6f} s  {places[0]} -> {places[1]}  {framing or 'no framing'}\n")
                _show(found)
    except BrokenPipeError:
        raise  # It is not the file's.
    except (DecodeError, OSError) as error:
        parser.exit(1, f"{path}: {error}\n")
    return 1 if failed else 0


def _document(framing: str | None, found: list[Decoded | DecodeError]) -> dict[str, object]:
    messages = [{"error": str(m)} if isinstance(m, DecodeError) else plain(m) for m in found]
    return {"framing": framing, "messages": messages}


def _show(found: list[Decoded | DecodeError]) -> None:
    for message in found:
        if isinstance(message, DecodeError):
            sys.stdout.flush()
            sys.stderr.write(f"{message}\n")
        else:
            sys.stdout.write("".join(f"{line}\n" for line in lines(message)))


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
    sys.exit(run())
