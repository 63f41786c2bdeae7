"""What a mathematical statement about a problem turned out to be: it holds, fails, or is open.

Every check of this package answers with one :class:`Verdict`: of matrices
(:mod:`nsspice.problems.matrices`), of uniqueness and of regularity.  A statement that *fails* comes
with a :class:`Witness`, which anybody can check without the algorithm that found it; one that is
*not decided* says what prevents a decision.  Nothing in between is guessed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from .csc import Floats


@dataclass(frozen=True, slots=True)
class Witness:
    """What shows that a statement fails, or a certificate that it holds.

    Parameters
    ----------
    text : str
        One clause: ``the principal minor of rows 0, 1 is -3``.
    rows : tuple of int
        Indices that it is about: rows of a minor, pairs, functions.
    vector : ndarray or None
        A vector that contradicts the definition (or certifies it), shape (n,).
    value : float or None
        The number that has the wrong sign.

    Examples
    --------
    >>> Witness("the diagonal entry of row 2 is 0", rows=(2,), value=0.0).rows
    (2,)
    """

    text: str
    rows: tuple[int, ...] = ()
    vector: Floats | None = field(default=None, compare=False)
    value: float | None = None

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a statement holds.

    A verdict counts as true where the statement is proved, so that ``if is_p_matrix(M)`` is safe.

    Parameters
    ----------
    claim : str
        The statement: ``a P-matrix``, ``at most one solution``.
    holds : bool or None
        True: proved. False: it fails, see the witness. None: not decided.
    reason : str
        One clause: by which theorem or criterion it holds, which hypothesis fails, or what
        in the way of a decision.
    witness : Witness or None
    hypotheses : mapping of str to Verdict
        Of a theorem: the verdicts of its hypotheses, by name.

    Examples
    --------
    >>> found = Verdict.no("a P-matrix", "a minor is negative",
    ...                    Witness("the principal minor of rows 0, 1 is -3", (0, 1), value=-3.0))
    >>> bool(found), found.decided
    (False, True)
    >>> print(found)
    a P-matrix: fails, a minor is negative: the principal minor of rows 0, 1 is -3
    >>> print(Verdict.undecided("a P-matrix", "too many rows"))
    a P-matrix: not decided, too many rows
    """

    claim: str
    holds: bool | None
    reason: str
    witness: Witness | None = None
    hypotheses: Mapping[str, Verdict] | None = field(default=None, hash=False)

    @classmethod
    def yes(cls, claim: str, reason: str, witness: Witness | None = None) -> Verdict:
        """Return that a claim holds, by the criterion that the reason names."""
        return cls(claim, True, reason, witness)

    @classmethod
    def no(cls, claim: str, reason: str, witness: Witness | None = None) -> Verdict:
        """Return that a claim fails."""
        return cls(claim, False, reason, witness)

    @classmethod
    def undecided(cls, claim: str, reason: str, witness: Witness | None = None) -> Verdict:
        """Return that a claim is not decided, for the reason given."""
        return cls(claim, None, reason, witness)

    @classmethod
    def theorem(cls, claim: str, source: str, hypotheses: Mapping[str, Verdict]) -> Verdict:
        """Return whether all hypotheses of a theorem hold, hence its conclusion.

        Parameters
        ----------
        claim : str
            ``Theorem 2.2.1 applies``: that it fails says that a hypothesis does, not that the
            conclusion is wrong.
        source : str
            The theorem.
        hypotheses : mapping of str to Verdict
            By name.

        Returns
        -------
        Verdict
            It holds if all hypotheses do; else it fails with the first one that fails; else it is
            not decided for the first one that is not.

        Examples
        --------
        >>> closed = Verdict.yes("K is closed", "a product of intervals")
        >>> strong = Verdict.no("g is strongly monotone", "the symmetric part is singular")
        >>> print(Verdict.theorem("Theorem 2.2.1 applies", "Theorem 2.2.1",
        ...                       {"K": closed, "(iii)": strong}))
        Theorem 2.2.1 applies: fails, hypothesis (iii), g is strongly monotone: the symmetric part \
is singular
        """
        for state, verb in ((False, "hypothesis"), (None, "not known whether hypothesis")):
            for name, found in hypotheses.items():
                if found.holds is state:
                    text = f"{verb} {name}, {found.claim}: {found.reason}"
                    return cls(claim, state, text, found.witness, dict(hypotheses))
        return cls(claim, True, source, None, dict(hypotheses))

    def __bool__(self) -> bool:
        return self.holds is True

    @property
    def decided(self) -> bool:
        """True if the statement is known to hold or to fail."""
        return self.holds is not None

    @property
    def word(self) -> str:
        """``holds``, ``fails`` or ``not decided``."""
        return "not decided" if self.holds is None else "holds" if self.holds else "fails"

    def named(self, claim: str) -> Verdict:
        """Return the verdict under another claim."""
        return replace(self, claim=claim)

    def __str__(self) -> str:
        text = f"{self.claim}: {self.word}, {self.reason}"
        return f"{text}: {self.witness}" if self.witness is not None and not self.holds else text

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        found: dict[str, Any] = {"claim": self.claim, "verdict": self.word, "reason": self.reason}
        if self.witness is not None:
            w = self.witness
            vector = None if w.vector is None else [float(x) for x in w.vector]
            found["witness"] = {
                "text": w.text,
                "rows": list(w.rows),
                "vector": vector,
                "value": w.value,
            }
        if self.hypotheses is not None:
            found["hypotheses"] = {name: v.to_dict() for name, v in self.hypotheses.items()}
        return found


__all__ = ["Verdict", "Witness"]
