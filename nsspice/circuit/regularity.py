"""Whether the DC problem of an island has at most one solution, with the names of its elements."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from ..problems.csc import Csc
from ..problems.descriptor import DescriptorSystem
from ..problems.feedback import undecided_switches
from ..problems.uniqueness import CLAIM, uniqueness
from ..problems.verdict import Verdict
from .mna import MnaSystem

#: controlled sources: they can feed a signal back
_GAIN = "efgh"


@dataclass(frozen=True, slots=True)
class DcUniqueness:
    """Whether a static problem has at most one solution, for any values of the sources.

    Parameters
    ----------
    verdict : Verdict
    elements : tuple of str
        The elements that prevent a proof, if they are known.
    """

    verdict: Verdict
    elements: tuple[str, ...] = ()

    @property
    def unique(self) -> bool:
        """True if it is proved."""
        return bool(self.verdict)

    @property
    def reason(self) -> str:
        """One clause: why, or what prevents a proof."""
        return self.verdict.reason

    def __str__(self) -> str:
        words = {True: "unique", False: "not unique", None: "uniqueness not proved"}
        names = f" ({', '.join(self.elements)})" if self.elements else ""
        return f"{words[self.verdict.holds]}: {self.reason}{names}"


def static_system(system: DescriptorSystem) -> DescriptorSystem:
    """Return the system without storage: capacitors open, inductors short."""
    smooth = system.smooth
    if smooth is not None:
        smooth = replace(smooth, Q=Csc.zeros(smooth.Q.shape))
    return replace(system, E=Csc.zeros(system.E.shape), smooth=smooth)


def dc_uniqueness(mna: MnaSystem) -> DcUniqueness:
    """Judge the static problem of an assembled island.

    Parameters
    ----------
    mna : MnaSystem

    Examples
    --------
    >>> from nsspice.circuit import build
    >>> from nsspice.netlist import parse_text
    >>> deck = parse_text("clamp\\nV1 a 0 5\\nR1 a b 1k\\nD1 b 0\\n")
    >>> str(dc_uniqueness(build(deck).islands[0].assemble()))
    'unique: every mode has a regular Jacobian of one orientation'
    """
    system = static_system(mna.system)
    found = uniqueness(system)
    if found.unique:
        return _of_switches(mna, undecided_switches(system)) or DcUniqueness(found.verdict)
    names = [mna.pair_elements[k] for k in found.pairs]
    names += [name for k in found.functions for name in mna.function_elements(k)]
    if not found.functions and not found.verdict.decided:
        # pairs alone are monotone: gain comes from controlled sources
        gain = [d.name for d in mna.devices if d.letter in _GAIN]
        names = gain + names if found.pairs else names
    return DcUniqueness(found.verdict, _unique(names))


def _of_switches(mna: MnaSystem, open_: Mapping[int, str]) -> DcUniqueness | None:
    """Return that states of switches are not decided although each state has one solution."""
    if not open_:
        return None
    reason = next(iter(open_.values()))
    names = [mna.pair_elements[k] for k, why in open_.items() if why == reason]
    return DcUniqueness(Verdict.undecided(CLAIM, reason), _unique(names))


def _unique(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))
