"""The in-process link: a stack object in this process, in lockstep.

The stack sees the observation of step t as soon as the step has ended; what it answers is polled at
the start of step t+1, as on every other link.
"""

from __future__ import annotations

import traceback
from pathlib import Path
from typing import get_args

from jaus.address import JausAddress
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.links.base import Received
from xgv_cosim.observation import Observation, Stack

_OWN_FOLDER = Path(__file__).resolve().parents[1]


class InProcessLink:
    """Calls ``stack.act`` after each step and queues what it returns.

    Args:
        stack: The driver of one vehicle.
        address: The JAUS address under which the stack speaks.
    """

    def __init__(self, stack: Stack, address: JausAddress) -> None:
        self._stack = stack
        self._address = address
        self._queue: list[Received] = []
        self._faults: list[str] = []
        self._reported: set[tuple[str, ...]] = set()

    def poll(self) -> list[Received]:
        """Return what the stack has sent since the last poll, in order."""
        arrived, self._queue = self._queue, []
        return arrived

    def send(self, observation: Observation) -> None:
        """Let the stack act on its view.

        A stack that raises, or returns what is no list of messages, is reported in words, once for each
        kind of failure; nothing of that cycle is sent, and it is called again after the next step.
        """
        try:
            messages = self._stack.act(observation)
        except Exception as error:  # noqa: BLE001 - a user's stack may raise anything; the run goes on
            kind, where = type(error).__name__, _place_of(error)
            self._report(f"{kind}: {error} ({where})", kind, where)
            return
        if not isinstance(messages, (list, tuple)):
            kind = type(messages).__name__
            self._report(f"act returned {kind}, expected a list of messages", kind)
            return
        if not messages:
            return
        strange = [message for message in messages if not isinstance(message, get_args(StackMessage))]
        if strange:
            kind = type(strange[0]).__name__
            self._report(f"act returned a list with {kind} in it, expected messages only", "list", kind)
            return
        self._queue.extend(Received(self._address, message) for message in messages)

    def _report(self, fault: str, *kind: str) -> None:
        if kind not in self._reported:
            self._reported.add(kind)
            self._faults.append(fault)

    def take_faults(self) -> list[str]:
        """Return what the stack raised since the last call."""
        faults, self._faults = self._faults, []
        return faults

    def close(self) -> None:
        """Forget what was queued."""
        self._queue.clear()


def _place_of(error: Exception) -> str:
    """Return where in the stack an error was raised, as ``file:line``; our own files only if no other was."""
    frames = traceback.extract_tb(error.__traceback__)
    users = [frame for frame in frames if _OWN_FOLDER not in Path(frame.filename).parents]
    frame = (users or frames)[-1]
    return f"{Path(frame.filename).name}:{frame.lineno}"
