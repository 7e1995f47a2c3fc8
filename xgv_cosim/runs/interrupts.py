"""Ctrl-C between steps: a step that has begun is finished, so that what is recorded of it agrees."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Self


class InterruptsBetweenSteps:
    """While open, the first Ctrl-C waits for ``check``; the second one interrupts at once.

    Does nothing outside the main thread, which alone gets signals, and where the caller handles SIGINT
    in a way of his own. Leaving raises an interrupt that is still waiting, unless another error is on
    its way.
    """

    def __init__(self) -> None:
        self._waiting = False
        self._installed = False

    def __enter__(self) -> Self:
        in_main_thread = threading.current_thread() is threading.main_thread()
        if in_main_thread and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._note)
            self._installed = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._installed:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            self._installed = False
        if error is None:
            self.check()

    def check(self) -> None:
        """Raise the interrupt that came since the last call.

        Raises:
            KeyboardInterrupt: There was one.
        """
        if self._waiting:
            self._waiting = False
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._waiting:
            signal.default_int_handler(number, frame)
        self._waiting = True
