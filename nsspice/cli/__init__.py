"""The command line: ``nsspice run``, ``explain``, ``test``, ``compare``."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Run the command line; exits with 0, 1, 2, 3 or 130."""
    if sys.argv[1:] == ["--version"]:  # answered without loading anything
        from .. import __version__

        sys.stdout.write(f"nsspice {__version__}\n")
        return
    # threads for the linear algebra of numpy cost more than the small systems here could gain
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from .app import app

    app()
