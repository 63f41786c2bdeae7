"""Running a deck again whenever it is saved."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from pathlib import Path

from .report import say

#: how often files are looked at [s]: below what a person notices, far above what it costs
_PERIOD = 0.25


def watch(run: Callable[[], Iterable[Path]]) -> None:
    """Call ``run`` at the start and after each change of a file that it read, until Ctrl-C.

    Parameters
    ----------
    run : callable
        Runs once, reports errors itself, and returns the files on which the result depends.
    """
    try:
        while True:
            files = set(run())
            before = _stamps(files)
            say(f"watching {', '.join(sorted(p.name for p in files))}; Ctrl-C ends")
            while _stamps(files) == before:
                time.sleep(_PERIOD)
            time.sleep(0.05)  # an editor may still be writing
    except KeyboardInterrupt:
        say("")


def _stamps(files: Iterable[Path]) -> dict[Path, tuple[int, int]]:
    """Return time and size of the files that are there: editors replace a file by a new one."""
    found = {}
    for path in files:
        try:
            status = path.stat()
        except OSError:
            continue
        found[path] = (status.st_mtime_ns, status.st_size)
    return found
