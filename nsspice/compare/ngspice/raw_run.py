"""The raw result of a run of ngspice: vectors, messages and counters, not yet checked."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt


@dataclass(slots=True)
class RawRun:
    """Vectors, messages and counters of one run.

    Parameters
    ----------
    runner, version : str
        How ngspice was run, and which one it is.
    log : list of str
        Its messages.
    names : list of str
    data : ndarray, shape (len(names), rows)
    seconds : float
        Duration of the analysis inside the process [s].
    counters : dict of str to float
        ngspice's own account.
    """

    runner: str
    version: str
    log: list[str] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    data: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))
    seconds: float = 0.0
    counters: dict[str, float] = field(default_factory=dict)

    def vectors(self) -> dict[str, npt.NDArray[np.float64]]:
        """Return the vectors by the names that nsspice uses: ``time``, ``v(a)``, ``i(v1)``."""
        found = {}
        for name, row in zip(self.names, self.data, strict=True):
            key = name.lower()
            if key.endswith("#branch"):
                key = f"i({key[:-7]})"
            elif key in ("time", "v-sweep", "i-sweep", "temp-sweep", "res-sweep"):
                key = "time" if key == "time" else "sweep"
            elif key.endswith("-sweep)"):
                key = "sweep"
            elif "(" not in key:
                key = f"v({key})"
            found[key] = row
        return found
