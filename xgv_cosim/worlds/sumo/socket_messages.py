"""Commands and answers of traci, many in one message, on the socket of a script's connection.

The names with an underscore are traci's; tests pin what they do.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, NamedTuple

from traci import constants
from traci.connection import Connection, FatalTraCIError, TraCIException
from traci.domain import DOMAINS
from traci.step import StepManager

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

    from traci.storage import Storage


_INT, _DOUBLE, _TWO_DOUBLES = struct.Struct("!i"), struct.Struct("!d"), struct.Struct("!dd")
_OK, _OK_LENGTH = b"\x00" * 5, 7
"""Result and (empty) words of the status that goes before an answer, and its length with all."""
_NOT_PLAIN = object()


class Question(NamedTuple):
    """One call of a getter."""

    domain: str
    getter: str
    subject: str
    """Id of what it asks about, empty for all of SUMO."""
    rest: tuple[Any, ...]

    @property
    def args(self) -> tuple[Any, ...]:
        """Return the arguments of the call."""
        return (self.subject, *self.rest) if self.subject else self.rest


class _Composed(Exception):  # noqa: N818 - no error: it leaves a call of traci once its command is written
    """A command is written; it is not to be sent now."""


class SharedConnection(Connection):  # type: ignore[misc] # traci carries no types
    """A second connection object on the socket of the script's.

    The names with an underscore are traci's; tests pin them.
    """

    def __init__(self, scripts: Connection) -> None:
        StepManager.__init__(self)
        self._scripts = scripts
        self._string = b""
        self._queue: list[int] = []
        self._lock = scripts._lock
        self._subscriptionMapping: dict[int, object] = {}
        self._composing = False
        self._arrived: Storage | None = None
        self._end = 0
        """Where the answer that is being read ends."""
        self._written: dict[Question, tuple[bytes, int]] = {}
        """The commands of questions, and the lengths of their ids."""
        self._conversions: dict[str, frozenset[int]] = {}
        """Variables of each domain whose answers traci makes something else of."""
        for domain in DOMAINS:
            domain._register(self, self._subscriptionMapping)
            self._conversions[domain._name] = frozenset(domain._retValFunc)

    @property
    def _socket(self) -> Any:  # noqa: ANN401 - a socket, or None once SUMO is gone
        return self._scripts._socket

    @_socket.setter
    def _socket(self, value: object) -> None:
        self._scripts._socket = value

    def _written_by(self, call: Callable[[], object]) -> bytes:
        """Return the command that a call of traci writes, without sending it."""
        kept = self._string, self._queue
        self._string, self._queue, self._composing = b"", [], True
        try:
            call()
        except _Composed:
            return self._string
        finally:
            self._composing = False
            self._string, self._queue = kept
        raise TypeError(f"{call!r} asks SUMO nothing")

    def send(self, commands: Iterable[bytes] = ()) -> Storage:
        """Send all that is kept and these commands, in one message; return the answers to the latter.

        Raises:
            TraCIException: SUMO refuses something that was kept.
            FatalTraCIError: SUMO is gone.
        """
        with self._lock:
            if self._socket is None:
                raise FatalTraCIError("Connection already closed.")
            message = self._string + b"".join(commands)
            num_kept, self._string, self._queue = len(self._queue), b"", []
            self._socket.sendall(struct.pack("!i", len(message) + 4) + message)
            arrived = self._recvExact()
            if not arrived:
                self._socket.close()
                self._socket = None
                raise FatalTraCIError("Connection closed by SUMO.")
            for _ in range(num_kept):
                self._check_status(arrived)
            return arrived

    def answers_to(self, questions: Sequence[Question]) -> Iterator[tuple[Question, Any]]:
        """Ask all in one message and yield the answers; what SUMO refuses has none.

        Raises:
            TraCIException: SUMO refuses something that was kept.
            FatalTraCIError: SUMO is gone.
        """
        for question in questions:
            if question not in self._written:
                command = self._written_by(self._call(question))
                self._written[question] = (command, len(question.subject.encode()))
        arrived = self.send([self._written[question][0] for question in questions])
        content, position = arrived._content, arrived._pos
        for question in questions:
            answer, position = _plain_value(
                content, position, self._written[question][1], self._conversions[question.domain]
            )
            if answer is _NOT_PLAIN:
                arrived._pos = position
                try:
                    answer = self._read_by(self._call(question), arrived)
                except TraCIException:
                    continue
                finally:
                    position = arrived._pos
            yield question, answer

    def forget_all_but(self, questions: Sequence[Question]) -> None:
        """Keep no written commands but those of these questions."""
        written = self._written
        self._written = {question: written[question] for question in questions if question in written}

    def _call(self, question: Question) -> Callable[[], Any]:
        getter = getattr(getattr(self, question.domain), question.getter)
        return lambda: getter(*question.args)

    def _read_by(self, call: Callable[[], Any], arrived: Storage) -> Any:  # noqa: ANN401 - what the getter returns
        """Return what a call of traci makes of the next answer that has arrived."""
        self._arrived = arrived
        try:
            return call()
        finally:
            self._arrived = None
            arrived._pos = self._end

    @property
    def keeps(self) -> bool:
        """Return whether there are commands that have not been sent."""
        return bool(self._queue)

    def _sendCmd(self, *command: Any) -> Any:  # noqa: N802, ANN401 - traci's name
        if self._arrived is not None:
            try:
                self._check_status(self._arrived)
            finally:
                self._end = self._arrived._pos  # of a refusal: nothing follows
            self._end += _length_at(self._arrived._content, self._end)
            return self._arrived
        return super()._sendCmd(*command)

    def _sendExact(self) -> Any:  # noqa: N802, ANN401 - traci's name
        if self._composing:
            raise _Composed
        if self._queue[-1] == constants.CMD_SET_VEHICLE_VARIABLE:
            return None
        return super()._sendExact()

    @staticmethod
    def _check_status(arrived: Storage) -> None:
        _, command, result = arrived.read("!BBB")
        words = arrived.readString()
        if result or words:
            raise TraCIException(words, command, result)


def _length_at(content: bytes, position: int) -> int:
    """Return the length of the answer that begins there."""
    return content[position] or int(_INT.unpack_from(content, position + 1)[0])


def _plain_value(
    content: bytes, position: int, num_id_bytes: int, conversions: Collection[int]
) -> tuple[Any, int]:
    """Return a number, text or position that SUMO answers, and where the next answer begins.

    Anything else, a refusal too, is ``_NOT_PLAIN``, for traci to read; so is what traci converts.
    """
    if content[position + 2 : position + _OK_LENGTH] != _OK:
        return _NOT_PLAIN, position
    begin = position + _OK_LENGTH
    length = content[begin]
    head = begin + 1
    if not length:
        length, head = _INT.unpack_from(content, head)[0], head + 4
    value = head + 2 + 4 + num_id_bytes
    kind = content[value]
    if content[head + 1] in conversions:
        return _NOT_PLAIN, position
    if kind == constants.TYPE_DOUBLE:
        return _DOUBLE.unpack_from(content, value + 1)[0], begin + length
    if kind == constants.POSITION_2D:
        return _TWO_DOUBLES.unpack_from(content, value + 1), begin + length
    if kind == constants.TYPE_STRING:
        return content[value + 5 : begin + length].decode(), begin + length
    return _NOT_PLAIN, position
