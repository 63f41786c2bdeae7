"""The list of errors and warnings that grows while a deck is read and its elements are built.

Nothing in the front end stops at the first mistake: every reader records what it finds here and
goes on, and ``parse_text`` raises one error with everything at the end.
"""

from __future__ import annotations

import copy
from dataclasses import replace

from ..errors import Diagnostic, NetlistError, Span

#: more findings than this help nobody; the rest are counted in one closing line
MAX_FINDINGS = 1000
#: characters of a message; names in it may be as long as a line
_LONGEST = 400


class Findings:
    """Errors and warnings in the order of discovery, each reported once.

    Examples
    --------
    >>> findings = Findings()
    >>> findings.error("NS1001", "unknown card .trn", None, "did you mean .tran?")
    >>> [d.hint for d in findings.errors]
    ['did you mean .tran?']
    """

    def __init__(self) -> None:
        self.errors: list[Diagnostic] = []
        self.warnings: list[Diagnostic] = []
        #: names that lines with errors may have declared
        self.doubtful: set[str] = set()
        #: a file could not be included: it may have declared any name
        self.incomplete = False
        #: libraries that do not exist; ``missed`` is a name that one of them may have declared
        self.absent: list[Diagnostic] = []
        self.missed = ""
        #: places of parameters without an effect
        self.idle: set[Span] = set()
        self._seen: set[tuple[str, str, str, int, int]] = set()
        self._dropped = 0

    def copied(self) -> Findings:
        """Return the same findings, to which others may be added."""
        other = copy.copy(self)
        for name, value in vars(self).items():
            if isinstance(value, list | set):
                setattr(other, name, value.copy())
        return other

    def error(self, code: str, message: str, span: Span | None = None, hint: str = "") -> None:
        """Record an error, unless the same one is there already (a subcircuit used twice)."""
        self._add(self.errors, Diagnostic(code, message, span, hint))

    def warning(self, code: str, message: str, span: Span | None = None, hint: str = "") -> None:
        """Record a warning, unless the same one is there already."""
        self._add(self.warnings, Diagnostic(code, message, span, hint, "warning"))

    def record(self, found: Unreadable) -> None:
        """Record why an item cannot be understood, unless an error before it is the reason."""
        if not (found.missing and self.is_doubtful(found.missing)):
            self.error(found.code, found.message, found.span, found.hint)

    def settle_absent(self) -> None:
        """Report libraries that do not exist: errors if a name is missing, else warnings."""
        for found in self.absent:
            if self.missed:
                message = f"{found.message}, and {self.missed[:60]} is missing"
                self.error(found.code, message, found.span, found.hint)
                self.errors.insert(0, self.errors.pop())  # before what follows from it
            else:
                message = f"{found.message}; nothing in the deck needs it"
                self.warning("NS1053", message, found.span, found.hint)

    def is_doubtful(self, name: str) -> bool:
        """Return whether a missing name may be missing because of an error already reported."""
        if self.incomplete or name in self.doubtful:
            return True
        if "." in name and any(part in self.doubtful for part in name.split(".")):
            return True
        if self.absent and not self.missed:
            self.missed = name
        return bool(self.absent)

    def _add(self, target: list[Diagnostic], finding: Diagnostic) -> None:
        if len(finding.message) > _LONGEST or len(finding.hint) > _LONGEST:
            finding = replace(
                finding, message=_shortened(finding.message), hint=_shortened(finding.hint)
            )
        span = finding.span
        place = (span.file, span.line, span.column) if span else ("", 0, 0)
        key = (finding.code, finding.message, *place)
        if key in self._seen:
            return
        if len(target) >= MAX_FINDINGS:
            self._dropped += target is self.errors
            return
        self._seen.add(key)
        target.append(finding)

    def raise_errors(self, partial: object | None = None) -> None:
        """Raise everything found so far, in the order of discovery.

        Parameters
        ----------
        partial : object, optional
            What could be read nevertheless.

        Raises
        ------
        NetlistError
            If at least one error was recorded.
        """
        if not self.errors:
            return
        found = list(self.errors)
        if self._dropped:
            message = f"{self._dropped} more errors are not shown"
            found.append(
                Diagnostic("NS1099", message, None, "correct the first ones and run again")
            )
        error = NetlistError(found)
        error.partial = partial
        raise error


class Unreadable(Exception):
    """One item cannot be understood; carries the finding to record, caught line by line.

    ``missing`` is the name that nobody declares, if that is what is wrong.
    """

    def __init__(
        self, code: str, message: str, span: Span | None, hint: str = "", missing: str = ""
    ) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.span = span
        self.hint = hint
        self.missing = missing


def _shortened(text: str) -> str:
    """Return a text with its middle left out if it is too long."""
    if len(text) <= _LONGEST:
        return text
    return f"{text[: _LONGEST // 2]} ... {text[-_LONGEST // 2 :]}"
