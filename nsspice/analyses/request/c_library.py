"""Controllers in C: a function in a shared library, called through ctypes."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from pathlib import Path

from .converters import wrong


class CStep:
    """The function ``step(const double *in, double *out, void *state)`` of a shared library.

    The header ``nsspice/controller.h``, in the folder that ``nsspice --include`` prints, says what
    else the library may have.

    Parameters
    ----------
    path : str or Path
        Of the library.
    inputs, outputs : int
        Numbers of ``reads`` and ``writes``.

    Raises
    ------
    UsageError
        NS4005 for a library that cannot be loaded, or without the function.
    """

    def __init__(self, path: str | Path, inputs: int, outputs: int) -> None:
        self._made_of = str(path), inputs, outputs
        try:
            # not by a bare name, which would be looked for in the folders of the system
            library = ctypes.CDLL(str(Path(path).resolve()))
            function = library.step
        except OSError as error:
            raise wrong(f"{path} cannot be loaded: {error}", "compile it with -shared") from error
        except AttributeError as error:
            hint = "write void step(const double *in, double *out, void *state)"
            raise wrong(f"{path} has no function step", hint) from error
        numbers = ctypes.POINTER(ctypes.c_double)
        function.argtypes = [numbers, numbers, ctypes.c_void_p]
        function.restype = None
        size = 0
        if hasattr(library, "state_size"):
            library.state_size.restype = ctypes.c_size_t
            size = int(library.state_size())
        self._step = function
        self._in = (ctypes.c_double * max(inputs, 1))()
        self._out = (ctypes.c_double * max(outputs, 1))(*[math.nan] * max(outputs, 1))
        self._outputs = outputs
        # a multiple of the largest alignment
        self._state = (ctypes.c_double * max(2, -(-size // 8)))()
        self._count = size // 8
        if hasattr(library, "start"):
            library.start.argtypes = [ctypes.c_void_p]
            library.start.restype = None
            library.start(self._state)

    def __reduce__(self) -> tuple[type[CStep], tuple[str, int, int]]:
        """Begin again in each copy: a run of a sweep has a state of its own."""
        return CStep, self._made_of

    @property
    def state(self) -> list[float]:
        """The state as numbers: it has to consist of ``double``."""
        return self._state[: self._count]

    @state.setter
    def state(self, values: Sequence[float]) -> None:
        self._state[: self._count] = [*values]

    def __call__(self, time: float, values: tuple[float, ...]) -> list[float | None]:
        """Return the values to set, None for those that stay."""
        self._in[: len(values)] = [*values]
        self._step(self._in, self._out, self._state)
        return [None if math.isnan(v) else v for v in self._out[: self._outputs]]
