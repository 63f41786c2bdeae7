"""The command line: ``commands`` has one file for each command, this folder what they share.

Read ``app`` (which commands there are), ``commands.run`` (the longest one), ``options`` (what may
be typed) and ``report`` (what is printed).  Imports everything but ``dvi``; nothing imports it.
"""

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

    app(prog_name="nsspice")


def program() -> None:
    """Run the command line as a whole process, the entry point of ``nsspice``.

    All files are closed by then and exit handlers are called, but the interpreter is not taken
    apart piece by piece, which took a tenth of the time of a small deck.
    """
    import atexit

    code: object = 0
    try:
        main()
    except SystemExit as end:
        code = end.code
    if not (code is None or isinstance(code, int)):
        raise SystemExit(code)
    atexit._run_exitfuncs()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        raise SystemExit(code or 2) from None  # the interpreter's own exit says what is wrong
    os._exit(code or 0)
