"""Ctrl-C and its like, noted at once and acted on between two pieces of work.

Python raises KeyboardInterrupt anywhere, also half way through writing a block of rows; a file
could then end in a torn line.  Here the signal only sets a flag, which is looked at after every
piece of work.
"""

from __future__ import annotations

import threading
from signal import SIG_DFL, SIGINT, SIGTERM, default_int_handler
from types import FrameType, TracebackType

# the module signal wraps these in look-ups of enumerations that take as long as a small circuit
from _signal import getsignal, signal  # type: ignore[import-not-found]  # isort: skip

try:
    from signal import SIGHUP

    SIGNALS: tuple[int, ...] = (SIGINT, SIGTERM, SIGHUP)
except ImportError:  # Windows
    SIGNALS = (SIGINT, SIGTERM)


def end_like_ctrl_c() -> None:
    """Let SIGTERM and SIGHUP do what Ctrl-C does, where nobody has decided otherwise (nohup)."""
    for number in SIGNALS:
        if getsignal(number) == SIG_DFL:
            signal(number, default_int_handler)


class Interrupts:
    """While entered, Ctrl-C is noted; ``check`` raises it where that does no harm.

    Other handlers than Python's own, and other threads than the main one, are left alone.  A second
    Ctrl-C is raised at once.  SIGTERM and SIGHUP count where they have Python's handler of Ctrl-C:
    the command line gives it to them, a program that uses nsspice as a library may have other
    plans.

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
        self._taken: list[int] = []

    def __enter__(self) -> Interrupts:
        main = threading.current_thread() is threading.main_thread()
        for number in SIGNALS if main else ():
            if getsignal(number) is default_int_handler:
                signal(number, self._note)
                self._taken.append(number)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for number in self._taken:
            signal(number, default_int_handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.pressed:
            raise KeyboardInterrupt
        self.pressed = True

    def check(self) -> None:
        """Raise KeyboardInterrupt if Ctrl-C was pressed."""
        if self.pressed:
            raise KeyboardInterrupt
