"""Statistics of a run, as accurate as its engine: the methods that a solution offers."""

from __future__ import annotations

from typing import Any, Literal

from ..signals.signal_function import Floats


class RunStatistics:
    """What is known of signals over a window of a run; output points do not matter."""

    __slots__ = ()

    @property
    def _run(self) -> Any:
        """The solution itself."""
        return self

    def average(self, signal: str, start: float | None = None, stop: float | None = None) -> float:
        r"""Return the mean of a signal over the run, as accurate as the engine is.

        Parameters
        ----------
        signal : str
            A signal, or an expression of signals such as ``v(a,b)*i(r1)``; also of such as were
            not asked for in the run, which is then repeated.
        start, stop : float, optional
            The window [s]; all of the run if left out.

        Raises
        ------
        NetlistError
            If the expression cannot be read.
        UsageError
            NS4005 if there is no such signal, or the window lies outside of the run.

        Examples
        --------
        >>> import nsspice
        >>> sine = nsspice.read("sine\nV1 a 0 SIN(0 1 1k)\nD1 a b\nR1 b 0 1\n.tran 1m 1m\n")
        >>> round(sine.run()[0].average("v(b)") * 3.141592653589793, 12)
        1.0
        """
        return self._statistic(signal, "avg", start, stop)

    def rms(self, signal: str, start: float | None = None, stop: float | None = None) -> float:
        """Return the root of the mean square of a signal; arguments as for :meth:`average`."""
        return self._statistic(signal, "rms", start, stop)

    def integral(self, signal: str, start: float | None = None, stop: float | None = None) -> float:
        """Return the integral of a signal [V s, A s or J]; arguments as for :meth:`average`.

        Impulses are not in it: see ``impulses``.
        """
        return self._statistic(signal, "integ", start, stop)

    def minimum(self, signal: str, start: float | None = None, stop: float | None = None) -> float:
        """Return the smallest value of a signal; arguments as for :meth:`average`."""
        return self._statistic(signal, "min", start, stop)

    def maximum(self, signal: str, start: float | None = None, stop: float | None = None) -> float:
        """Return the largest value of a signal; arguments as for :meth:`average`."""
        return self._statistic(signal, "max", start, stop)

    def crossings(
        self,
        signal: str,
        level: float = 0.0,
        edge: Literal["rise", "fall", "cross"] = "cross",
        start: float | None = None,
        stop: float | None = None,
    ) -> Floats:
        r"""Return the instants at which a signal passes a level, shape (k,) [s].

        Parameters
        ----------
        signal : str
            As for :meth:`average`.
        level : float
            [V, A or W]
        edge : str
            ``rise`` (from below to at or above the level), ``fall``, or ``cross`` for both.
        start, stop : float, optional
            The window [s].

        Examples
        --------
        >>> import nsspice
        >>> sine = nsspice.read("sine\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 1m 1m\n")
        >>> (sine.run()[0].crossings("v(a)", 0.5) * 12e3).round(9).tolist()
        [1.0, 5.0]
        """
        from .window_statistics import crossings_of

        return crossings_of(self._run, signal, level, edge, start, stop)

    def _statistic(self, signal: str, name: str, start: float | None, stop: float | None) -> float:
        from .window_statistics import statistic_of

        return statistic_of(self._run, signal, name, start, stop)
