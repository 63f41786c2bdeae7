"""Progress of a run: reported to a caller, or shown as a bar below the cell of a notebook."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

#: called with the finished share of the run, 0 to 1
Progress = Callable[[float], None]

_PATIENCE = 0.5  # [s] shorter runs show nothing
_PAUSE = 0.1  # [s] between two pictures of the bar


@contextmanager
def shown_in_notebook(title: str, progress: Progress | None) -> Iterator[Progress | None]:
    """Return how the progress of a run is reported: the caller's way, or a bar in a notebook.

    Parameters
    ----------
    title : str
        Text before the bar.
    progress : callable or None
        The caller's.
    """
    if progress is not None or not _in_notebook():
        yield progress
        return
    bar = _Bar(title)
    try:
        yield bar
    finally:
        bar.close()


def _in_notebook() -> bool:
    """Return whether a notebook's kernel runs this program."""
    kernel = sys.modules.get("IPython")
    shell = None if kernel is None else kernel.get_ipython()
    return type(shell).__name__ == "ZMQInteractiveShell"


class _Bar:
    """A bar that appears when a run takes long, and is gone when it ends."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._next = time.perf_counter() + _PATIENCE
        self._handle: Any = None

    def __call__(self, done: float) -> None:
        now = time.perf_counter()
        if now < self._next:
            return
        self._next = now + _PAUSE
        from html import escape  # its table of entities is large

        text = f"{escape(self._title)} <progress value={done:.3f} max=1></progress> {done:.0%}"
        self._show(text)

    def close(self) -> None:
        """Take the bar away."""
        if self._handle is not None:
            self._show("")

    def _show(self, text: str) -> None:
        screen = import_module("IPython.display")
        if self._handle is None:
            self._handle = screen.display(screen.HTML(text), display_id=True)
        else:
            self._handle.update(screen.HTML(text))
