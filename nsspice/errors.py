"""Every error nsspice raises, and the diagnostics they carry.

Each error has a stable code ``NS####``, one sentence that says what to do next, and, where a
netlist is involved, the place in it.  Code ranges: 1xxx netlist text, 2xxx elements and topology,
3xxx numerical solution, 4xxx files and output, 5xxx checks and comparisons, 6xxx variational
problems.  All are listed in ``docs/reference/errors.md``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any


@dataclass(frozen=True, slots=True)
class Span:
    """A part of one line of a netlist file.

    Parameters
    ----------
    file : str
        File name as the user gave it, or ``<netlist>`` for text.
    line, column : int
        Position of the first character, both counted from 1.
    length : int
        Number of characters, at least 1.
    text : str
        The whole source line, for the caret display.

    Examples
    --------
    >>> Span("a.net", 3, 4, 2, "R1 ab 0 1k").caret()
    'R1 ab 0 1k\\n   ^^'
    """

    file: str
    line: int
    column: int
    length: int = 1
    text: str = ""

    def caret(self) -> str:
        """Return the source line with carets below the part (long lines are cut around it)."""
        text = self.text.replace("\t", " ")
        start, width = self.column - 1, max(self.length, 1)
        if len(text) > 160:  # a window around the place, so that no message floods the terminal
            left = max(0, start - 60)
            text, start = text[left : left + 140], start - left
            width = min(width, 140 - start)
        return f"{text}\n{' ' * start}{'^' * max(width, 1)}"

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding about a deck: an error or a warning.

    Parameters
    ----------
    code : str
        Stable code ``NS####``.
    message : str
        One sentence that names the element or node.
    span : Span or None
        Where in the netlist.
    hint : str
        What to do next; may be empty.
    severity : str
        ``"error"`` or ``"warning"``.

    Examples
    --------
    >>> print(Diagnostic("NS1001", "unknown card .trn", None, "did you mean .tran?").render())
    error NS1001: unknown card .trn
      hint: did you mean .tran?
    """

    code: str
    message: str
    span: Span | None = None
    hint: str = ""
    severity: str = "error"

    def render(self) -> str:
        """Return the text shown to the user: place, code, sentence, caret and hint."""
        place = f"{self.span}: " if self.span else ""
        lines = [f"{place}{self.severity} {self.code}: {self.message}"]
        if self.span and self.span.text:
            lines += ["  " + line for line in self.span.caret().splitlines()]
        if self.hint:
            lines.append(f"  hint: {self.hint}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """Return a JSON-ready mapping."""
        where = self.span
        return {
            "code": self.code,
            "severity": self.severity,
            "message": self.message,
            "hint": self.hint,
            "file": where.file if where else None,
            "line": where.line if where else None,
            "column": where.column if where else None,
        }


class NsspiceError(Exception):
    """Base class of all errors that nsspice raises on purpose.

    Parameters
    ----------
    diagnostics : Diagnostic or sequence of Diagnostic
        At least one; an error of a netlist holds all findings of the deck.

    Examples
    --------
    >>> error = UsageError(Diagnostic("NS4010", "this needs pandas", hint="pip install pandas"))
    >>> print(error)
    error NS4010: this needs pandas
      hint: pip install pandas
    >>> error.code, error.exit_code
    ('NS4010', 2)
    """

    #: exit code of the command line for this kind of error
    exit_code = 2

    def __init__(self, diagnostics: Diagnostic | Sequence[Diagnostic]) -> None:
        if isinstance(diagnostics, Diagnostic):
            diagnostics = [diagnostics]
        self.diagnostics: list[Diagnostic] = list(diagnostics)
        super().__init__("\n".join(d.render() for d in self.diagnostics))

    def _render_traceback_(self) -> list[str]:
        # what notebooks print: the findings, not the way through the program
        return [f"{type(self).__name__}: {self}"]

    def amend(self, words: str) -> None:
        """Add words to the sentence of the first finding, such as the values of a sweep."""
        first = self.diagnostics[0]
        self.diagnostics[0] = replace(first, message=f"{first.message} {words}")
        self.args = ("\n".join(d.render() for d in self.diagnostics),)

    @property
    def code(self) -> str:
        """Code of the first finding."""
        return self.diagnostics[0].code

    def __reduce__(self) -> tuple[Any, ...]:
        # exceptions are pickled by their texts alone: a worker of a pool would send no findings
        return _restored, (type(self), self.args, self.__dict__)


def _restored(
    kind: type[NsspiceError], args: tuple[Any, ...], state: Mapping[str, Any]
) -> NsspiceError:
    """Return an error as another process has raised it."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(state)
    return error


class NetlistError(NsspiceError):
    """The netlist text is wrong; has the location of the first finding.

    Examples
    --------
    >>> import nsspice
    >>> try:
    ...     nsspice.read("divider\\nR1 a 0 1k\\n.trann 1m 10m\\n")
    ... except nsspice.NetlistError as error:
    ...     print(error.code, error.line, error.column)
    NS1001 3 1
    """

    #: what could be read of the deck (a ``netlist.Deck``), if anything
    partial: object | None = None

    @property
    def file(self) -> str | None:
        """File of the first finding."""
        span = self.diagnostics[0].span
        return span.file if span else None

    @property
    def line(self) -> int | None:
        """Line of the first finding, counted from 1."""
        span = self.diagnostics[0].span
        return span.line if span else None

    @property
    def column(self) -> int | None:
        """Column of the first finding, counted from 1."""
        span = self.diagnostics[0].span
        return span.column if span else None


class TopologyError(NsspiceError):
    """The circuit graph admits no solution, for any laws of its elements.

    Parameters
    ----------
    diagnostics : Diagnostic or sequence of Diagnostic
    elements : sequence of str
        Names of the elements in conflict.
    """

    def __init__(
        self, diagnostics: Diagnostic | Sequence[Diagnostic], elements: Sequence[str] = ()
    ) -> None:
        super().__init__(diagnostics)
        self.elements = list(elements)


class NumericalError(NsspiceError):
    """No numerical solution was found; the command line exits with 3.

    Parameters
    ----------
    diagnostics : Diagnostic or sequence of Diagnostic
    elements, nodes : sequence of str
        Names of the elements and nodes that take part in the conflict.
    time : float or None
        Where it happened [s].
    residual : float or None
        Relative residual of the best point found.
    """

    exit_code = 3

    def __init__(
        self,
        diagnostics: Diagnostic | Sequence[Diagnostic],
        *,
        elements: Sequence[str] = (),
        nodes: Sequence[str] = (),
        time: float | None = None,
        residual: float | None = None,
    ) -> None:
        super().__init__(diagnostics)
        self.elements = list(elements)
        self.nodes = list(nodes)
        self.time = time
        self.residual = residual
        #: what was computed before the failure (an ``analyses.Solution``), if anything
        self.partial: object | None = None


class InfeasibleError(NumericalError):
    """The laws contradict each other at some time.

    ``elements`` and ``nodes`` name the loop or the cut-set in conflict.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''an ideal diode forward across a source
    ... V1 a 0 5
    ... D1 a 0
    ... .op
    ... ''')
    >>> try:
    ...     nsspice.op(circuit)
    ... except nsspice.InfeasibleError as error:
    ...     print(error.code, error.elements)
    NS3001 ['v1', 'd1']
    """


class RegularityError(NumericalError):
    """A uniqueness or regularity condition that the method needs does not hold."""


class StepError(NumericalError):
    """A step did not reach its tolerance although no contradiction was found."""


class CertificateError(NumericalError):
    """The computed points of a run fail its certificate: they are not reliable.

    Parameters
    ----------
    diagnostics : Diagnostic or sequence of Diagnostic
    solution : analyses.Solution
        The run as it was computed, with its certificate.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''feedback of the wrong sign
    ... R1 out p 15.9k
    ... C1 p 0 10n IC=1n
    ... E1 out 0 p 0 3
    ... .tran 1m 100m uic
    ... ''')
    >>> try:
    ...     circuit.run()
    ... except nsspice.CertificateError as error:
    ...     print(error.code, error.solution.certificate.passed)
    NS3003 False
    """

    def __init__(self, diagnostics: Diagnostic | Sequence[Diagnostic], solution: Any) -> None:
        super().__init__(diagnostics)
        self.partial = solution
        #: the run whose certificate fails
        self.solution = solution
        #: all runs of the deck, where it asks for several
        self.solutions: list[Any] = [solution]


class CertificateWarning(UserWarning):
    """The certificate of a run fails, and ``on_failure="warn"`` was given."""


class UsageError(NsspiceError):
    """A request that cannot be met: an unknown option value, signal or method."""


class OutputError(NsspiceError):
    """A file could not be written or read."""


class ComparisonError(NsspiceError):
    """A comparison could not be made because the other side failed; the command exits with 1."""

    exit_code = 1


def suggest(word: str, known: Iterable[str], prefix: str = "", cutoff: float = 0.6) -> str:
    """Return ``did you mean ...?`` for the known word nearest to a misspelt one, or ``""``.

    Parameters
    ----------
    word : str
        What the user wrote.
    known : iterable of str
        The words that would have been right; at most the first 5000 are compared.
    prefix : str
        Put before the suggestion, such as the dot of a card.
    cutoff : float
        Likeness from which a word counts as near, 0 to 1.

    Examples
    --------
    >>> suggest("vouut", ["vout", "vin"])
    'did you mean vout?'
    >>> suggest("xyz", ["vout", "vin"])
    ''
    """
    from difflib import get_close_matches

    # difflib compares one by one: bounded, so that messages stay fast
    choices = [name for name in islice(known, 5000) if name != word]
    near = get_close_matches(word[:100], choices, n=1, cutoff=cutoff)
    return f"did you mean {prefix}{near[0]}?" if near else ""
