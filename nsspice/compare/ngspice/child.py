"""Runs one deck with ngspice's library; a program of its own, started by ``process.py``.

usage: python child.py FOLDER

Reads ``FOLDER/deck.cir``; writes ``FOLDER/result.json`` and ``FOLDER/data.npy``.  It is a process
of its own because a fatal error in a netlist spoils the library for every later call, because a run
may have to be stopped, and because PySpice is under the GPL: nothing else imports it.
"""

from __future__ import annotations

import sys

if __name__ == "__main__":
    sys.path.pop(0)  # the folder of this file is not a place to import from

import ctypes.util
import json
import os
import time
from pathlib import Path
from typing import Any

#: exit codes that say what is missing
NO_PYSPICE, NO_LIBRARY = 11, 12


def is_failure(line: str) -> bool:
    """Return whether a line of ngspice reports a failure, and not just of something.

    Examples
    --------
    >>> is_failure("Error: no such model"), is_failure("Note: no compatibility mode selected!")
    (True, False)
    """
    text = line.strip().lower()
    return (
        text.startswith(("error", "fatal", "mif-error"))
        or "timestep too small" in text
        or "run simulation(s) aborted" in text
    )


def session() -> Any:
    """Return PySpice's shared ngspice, which takes notes on standard error for what they are."""
    # a name of its own, or the one of another library on this machine
    library = os.environ.get("NGSPICE_LIBRARY_PATH") or ctypes.util.find_library("ngspice")
    if library is None:
        sys.exit(NO_LIBRARY)
    os.environ["NGSPICE_LIBRARY_PATH"] = library
    try:
        import logging

        logging.disable(logging.CRITICAL)
        from PySpice.Spice.NgSpice.Shared import NgSpiceShared
    except ImportError:
        sys.exit(NO_PYSPICE)

    class Session(NgSpiceShared):  # type: ignore[misc]
        """Keeps what ngspice says, and calls a failure only what is one."""

        lines: list[str]

        def send_char(self, message: str, ngspice_id: int) -> int:
            stream, _, text = message.partition(" ")
            # PySpice raises for every line on standard error and every "error" in a title
            self._error_in_stderr = stream == "stderr" and is_failure(text)
            self._error_in_stdout = False
            self.lines.append(text)
            return 0

    Session.lines = []
    try:
        return Session.new_instance()
    except OSError:
        sys.exit(NO_LIBRARY)


def _warnings(log: list[str]) -> list[str]:
    """Return the first lines that say that something did not succeed."""
    return [line for line in log if "failed" in line][:200]


def main(folder: Path) -> None:
    """Run the deck of a folder."""
    ngspice = session()
    greeting = len(ngspice.lines)
    result: dict[str, Any] = {"version": f"ngspice {ngspice.ngspice_version}"}
    try:
        ngspice.load_circuit(folder.joinpath("deck.cir").read_text(encoding="utf-8"))
        begin = time.perf_counter()
        ngspice.exec_command("run")
        result["seconds"] = time.perf_counter() - begin
    except Exception as error:
        result.setdefault("seconds", 0.0)
        result["raised"] = type(error).__name__
    log = list(ngspice.lines[greeting:])
    result["log"] = log[:200] + _warnings(log[200:-200]) + log[-200:] if len(log) > 400 else log
    save_vectors(ngspice, folder, result)
    result["counters"] = counters(ngspice)
    folder.joinpath("result.json").write_text(json.dumps(result), encoding="utf-8")


def save_vectors(ngspice: Any, folder: Path, result: dict[str, Any]) -> None:
    """Write what was computed, also before a failure."""
    import numpy as np

    try:
        name = next(plot for plot in ngspice.plot_names if plot != "const")
        vectors = ngspice.plot(None, name)
        names = list(vectors)
        rows = np.array([vectors[key]._data for key in names], dtype=np.float64)
    except Exception:  # there is nothing after an early failure
        return
    result["names"] = names
    np.save(folder / "data.npy", rows)


def counters(ngspice: Any) -> dict[str, float]:
    """Return ngspice's own account of the run."""
    try:
        usage = ngspice.ressource_usage()
    except Exception:
        return {}
    return {key: value for key, value in usage.items() if isinstance(value, int | float)}


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)  # the library does not always leave quietly
