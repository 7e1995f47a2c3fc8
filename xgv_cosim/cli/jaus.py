"""``xgv-cosim jaus sniff``: what goes over the wire between clients and cars, live and readable."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from xgv_cosim.cli.app import app
from xgv_cosim.cli.exit_codes import EXIT_OK
from xgv_cosim.errors import LinkError

if TYPE_CHECKING:
    from jaus.capture import Captured
    from jaus.codec import Decoded

_LOOK_S = 0.5
jaus_app = typer.Typer(help="What goes over the wire between clients and cars.", no_args_is_help=True)
app.add_typer(jaus_app, name="jaus")


@jaus_app.callback()
def jaus() -> None:
    """What goes over the wire between clients and cars."""


@jaus_app.command()
def sniff(
    interface: Annotated[str, typer.Option(help="Interface to listen to; lo: this machine.")] = "lo",
    port: Annotated[int, typer.Option(min=0, max=65535, help="UDP port at either end, 0: any.")] = 3794,
    message: Annotated[
        list[str] | None,
        typer.Option(
            "--message", metavar="NAME", help="Only messages of this name or code; may be given again."
        ),
    ] = None,
    subsystem: Annotated[
        int | None, typer.Option(min=1, max=255, metavar="N", help="Only messages from or to this subsystem.")
    ] = None,
    component: Annotated[
        int | None, typer.Option(min=1, max=255, metavar="N", help="Only messages from or to this component.")
    ] = None,
    pcap: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Record the datagrams shown, for Wireshark.")
    ] = None,
    count: Annotated[int | None, typer.Option(min=1, help="End after so many messages.")] = None,
    seconds: Annotated[float | None, typer.Option(min=0, help="End after so long.")] = None,
    *,
    full: Annotated[bool, typer.Option("--full", help="Show every value, one below the other.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document for each message.")] = False,
) -> int:
    """Show the JAUS messages that pass an interface, until Ctrl-C. Needs the right to listen (root)."""
    from jaus.capture import Recorder  # noqa: PLC0415 - makes every message of JAUS
    from jaus.errors import TransportError  # noqa: PLC0415 - likewise
    from jaus.transports import Sniffer  # noqa: PLC0415 - likewise

    wanted = _Filter(port, _codes_of(message or ()), subsystem, component)
    ends_s = float("inf") if seconds is None else time.monotonic() + seconds
    left = float("inf") if count is None else count
    recorder: Recorder | None = None
    try:
        with Sniffer(interface) as sniffer:
            if pcap is not None:
                with _of_capture(pcap):
                    recorder = Recorder(pcap)
            while left > 0 and time.monotonic() < ends_s:
                captured = sniffer.receive(min(_LOOK_S, max(0.0, ends_s - time.monotonic())))
                shown = () if captured is None else wanted.messages_of(captured)
                if captured is None or not shown:
                    continue
                if recorder is not None:
                    with _of_capture(pcap):
                        recorder.record(
                            captured.datagram, captured.source, captured.destination, captured.time_s
                        )
                for each in shown[: int(min(left, len(shown)))]:
                    typer.echo(_document(captured, each) if as_json else _text(captured, each, full=full))
                left -= len(shown)
    except TransportError as error:
        raise LinkError(f"jaus sniff: {error}") from None
    except BrokenPipeError:
        # Whoever stops reading has seen enough; what is left in the buffer goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    finally:
        if recorder is not None:
            with _of_capture(pcap):
                recorder.close()
    return EXIT_OK


@contextmanager
def _of_capture(pcap: Path | None) -> Iterator[None]:
    """Tell of a capture that cannot be written, and of nothing else."""
    try:
        yield
    except OSError as error:
        raise LinkError(f"--pcap: {pcap}: {error.strerror or error}") from None


class _Filter:
    """Which messages are shown."""

    def __init__(
        self, port: int, codes: Collection[int], subsystem: int | None, component: int | None
    ) -> None:
        self._port = port
        self._codes = codes
        self._subsystem = subsystem
        self._component = component

    def messages_of(self, captured: Captured) -> list[Decoded | str]:
        """Return the messages that are wanted; junk is told of, unless somebody filters."""
        from jaus.errors import DecodeError  # noqa: PLC0415 - likewise
        from jaus.packet import decode_packet, unpack_datagram  # noqa: PLC0415 - likewise

        if self._port and self._port not in {captured.source[1], captured.destination[1]}:
            return []
        try:
            framing, packets = unpack_datagram(captured.datagram)
            messages: list[Decoded] = [decode_packet(framing, packet) for packet in packets]
        except DecodeError as error:
            is_filtered = self._codes or self._subsystem is not None or self._component is not None
            return [] if is_filtered else [f"no JAUS: {error}"]
        return [each for each in messages if self._wants(each)]

    def _wants(self, message: Decoded) -> bool:
        ends = message.header.source, message.header.destination
        return (
            (not self._codes or message.code in self._codes)
            and (self._subsystem is None or self._subsystem in {end.subsystem for end in ends})
            and (self._component is None or self._component in {end.component for end in ends})
        )


def _codes_of(names: Collection[str]) -> frozenset[int]:
    """Return the codes of messages that are named by class or code.

    Raises:
        LinkError: A name is neither.
    """
    from jaus.messages import MESSAGES  # noqa: PLC0415 - likewise
    from xgv_cosim.scenario.problems import word_hint  # noqa: PLC0415 - likewise

    by_name = {kind.__name__: code for code, kind in MESSAGES.items()}
    codes = set()
    for name in names:
        if name in by_name:
            codes.add(by_name[name])
            continue
        try:
            codes.add(int(name, 16))
        except ValueError:
            hint = word_hint(name, tuple(by_name))
            raise LinkError(
                f"--message: got {name!r}, expected a message such as SetMotionProfile or a code such as E328"
                f"{f' ({hint})' if hint else ''}"
            ) from None
    return frozenset(codes)


def _clock(time_s: float) -> str:
    return datetime.fromtimestamp(time_s, UTC).strftime("%H:%M:%S.%f")[:-3]


def _text(captured: Captured, message: Decoded | str, *, full: bool) -> str:
    from jaus.text import lines  # noqa: PLC0415 - likewise

    (host, number), (to_host, to_number) = captured.source, captured.destination
    head = f"{_clock(captured.time_s)}  {host}:{number} -> {to_host}:{to_number}"
    if isinstance(message, str):
        return f"{head}  {message}"
    title, *values = lines(message)
    if full:
        return "\n".join((f"{head}  {title}", *values))
    return f"{head}  {title.split('  sequence')[0]}  {'; '.join(value.strip() for value in values)}".rstrip()


def _document(captured: Captured, message: Decoded | str) -> str:
    from jaus.text import plain  # noqa: PLC0415 - likewise

    content = {"error": message} if isinstance(message, str) else plain(message)
    (host, number), (to_host, to_number) = captured.source, captured.destination
    places = {"from": f"{host}:{number}", "to": f"{to_host}:{to_number}"}
    return json.dumps({"time_s": captured.time_s, **places, **content})
