"""Ctrl-C, noted at once and acted on between two pieces of work.

Python raises KeyboardInterrupt anywhere, also half way through writing a block of rows; a file
could then end in a torn line.  Here the signal only sets a flag, which is looked at after every
stretch of work.
"""

from __future__ import annotations

import threading
from signal import SIGINT, default_int_handler
from types import FrameType, TracebackType
from typing import Any

# the module signal wraps these in look-ups of enumerations that take as long as a small circuit
from _signal import getsignal, signal  # type: ignore[import-not-found]  # isort: skip


class Interrupts:
    """While entered, Ctrl-C is noted; ``check`` raises it where that does no harm.

    Other handlers than Python's own, and other threads than the main one, are left alone.  A second
    Ctrl-C is raised at once.

    Examples
    --------
    >>> from signal import raise_signal
    >>> with Interrupts() as interrupts:
    ...     raise_signal(SIGINT)
    ...     print("noted:", interrupts.pressed)
    noted: True
    """

    def __init__(self) -> None:
        self.pressed = False
        self._before: Any = None

    def __enter__(self) -> Interrupts:
        main = threading.current_thread() is threading.main_thread()
        if main and getsignal(SIGINT) is default_int_handler:
            self._before = signal(SIGINT, self._note)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._before is not None:
            signal(SIGINT, self._before)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.pressed:
            raise KeyboardInterrupt
        self.pressed = True

    def check(self) -> None:
        """Raise KeyboardInterrupt if Ctrl-C was pressed."""
        if self.pressed:
            raise KeyboardInterrupt
