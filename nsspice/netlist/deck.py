"""The deck: what the user wrote, expanded and evaluated, every item with its place in the source.

A deck is flat: subcircuits are expanded (``x1.r1``), parameters evaluated, included files read.  It
knows the grammar of each card and no physics; ``nsspice.circuit`` turns it into devices.

What needs no default factory is a named tuple: to define a data class takes seven times as long, at
each start of the program.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

from ..errors import Diagnostic, Span
from .expressions.expression import Expression

if TYPE_CHECKING:
    from .parsing import Outline


class Grid(NamedTuple):
    """Named lists of numbers, as ``table(i=0 10 e=0 1m)`` gives them."""

    lists: dict[str, tuple[float, ...]]


class Param(NamedTuple):
    """A named value with its place: a number, a word, lists, or an expression of circuit signals.

    Expressions without signals are evaluated to numbers before the deck is handed on.
    """

    name: str
    value: float | str | Expression | Grid
    span: Span


class Source(NamedTuple):
    """Value of an independent V or I source.

    Parameters
    ----------
    dc : float or None
        DC value [V or A], None if not given.
    ac : (float, float) or None
        Magnitude and phase [deg] of the stimulus of ``.ac``.
    kind : str
        ``""`` (DC only), ``sin pulse pwl exp sffm am``.
    values : tuple of float or None
        Arguments as written, None for one left out before a later one; trailing ones may be
        missing.  A rise time written as 0 is 0, one left out is None.
    options : dict of str to float
        ``r`` and ``td`` of PWL.
    span : Span
    """

    dc: float | None
    ac: tuple[float, float] | None
    kind: str
    values: tuple[float | None, ...]
    options: dict[str, float]
    span: Span


@dataclass(frozen=True, slots=True)
class Model:
    """A ``.model`` card: name, type and parameters, all lower case.

    ``models`` holds the cards that parameters name: ``de`` and ``dc`` of a transistor.
    """

    name: str
    type: str
    params: dict[str, Param]
    span: Span
    models: dict[str, Model] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Element:
    """One element line after expansion.

    Parameters
    ----------
    name : str
        Lower case, with the path of subcircuit instances: ``x1.x2.d3``.
    letter : str
        ``r l c k v i e f g h b d q s w`` (the letter of the element itself, not of the path).
    nodes : tuple of str
        Terminals in order, lower case; ground is always ``"0"``.  Empty for K.
    controls : tuple of str
        E G S: the two controlling nodes.  F H W: the controlling source's full name.
        K: the coupled inductors' full names.
    value : float or Expression or None
        R L C: value; linear E F G H: gain; K: coefficient.  An expression of signals makes the
        element nonlinear: R ``V={expr(i)}``, E/G ``VALUE= TABLE POLY``, B ``V=`` or ``I=``,
        I ``TBL``, C ``Q=``, L ``Flux=``.
    quantity : str
        For expressions what they give: ``"v"`` or ``"i"``, ``"q"`` of C, ``"flux"`` of L; ``""``
        otherwise.
    model : Model or None
        Resolved in the scope of the element.
    source : Source or None
        V and I only.
    params : dict of str to Param
        Remaining ``name=value`` items (``ic``, ``tc1``, ``area`` ...).
    flags : dict of str to Span
        Bare words such as ``on``, ``off``.
    span : Span
        The element's line, from its name on.
    node_spans : tuple of Span
        One for each of ``nodes`` then ``controls``, for messages about nodes.
    models : dict of str to Model
        Cards that parameters of the line name: ``de`` and ``dc`` of a transistor.
    """

    name: str
    letter: str
    nodes: tuple[str, ...]
    span: Span
    controls: tuple[str, ...] = ()
    value: float | Expression | None = None
    quantity: str = ""
    model: Model | None = None
    source: Source | None = None
    params: dict[str, Param] = field(default_factory=dict)
    flags: dict[str, Span] = field(default_factory=dict)
    node_spans: tuple[Span, ...] = ()
    models: dict[str, Model] = field(default_factory=dict)


class OpCard(NamedTuple):
    """``.op``: the DC solution."""

    span: Span


class Sweep(NamedTuple):
    """One swept quantity: a source, a resistor, ``temp``, or (``.step``) a parameter.

    The name of a parameter of a model is ``@model[parameter]``.

    ``values`` holds every point in order; the stop value is included when it lies on the grid up to
    rounding.
    """

    name: str
    kind: Literal["element", "temp", "param", "model"]
    values: tuple[float, ...]
    span: Span


class DcCard(NamedTuple):
    """``.dc``: sweeps, the first one runs fastest."""

    sweeps: tuple[Sweep, ...]
    span: Span


class TranCard(NamedTuple):
    """``.tran tstep tstop [tstart [tmax]] [uic]`` (LTspice's ``.tran tstop`` has tstep None).

    ``orbit`` is set by ``start=pss``: the run begins in the periodic steady state.
    """

    tstep: float | None
    tstop: float
    tstart: float
    tmax: float | None
    uic: bool
    span: Span
    orbit: bool = False


class PssCard(NamedTuple):
    """``.pss [period=|fund=] [trigger=signal [level=]] [tstab=] [tstep=] [harms=]``.

    ``period`` is None if the sources or a trigger decide about it; ``tstep`` is the distance of the
    rows, ``harmonics`` how many of them the summary lists.
    """

    period: float | None
    trigger: str | None
    level: float
    tstab: float
    tstep: float | None
    harmonics: int
    span: Span


class Signal(NamedTuple):
    """An output quantity, ``v(a)``, ``v(a,b)``, ``i(r1)``, ``p(r1)``, by its canonical name."""

    name: str
    span: Span


@dataclass(frozen=True, slots=True)
class Cond:
    """A condition on a waveform: ``signal = value`` at the n-th crossing.

    ``other`` is set instead of ``value`` for ``WHEN v(a)=v(b)``; ``edge`` is ``rise fall cross``;
    ``index`` counts from 1, 0 stands for LAST; ``at`` fixes a time instead of a crossing.  ``late``
    holds values that are expressions of earlier measures, by field.
    """

    signal: Expression | None = None
    value: float | None = None
    other: Expression | None = None
    edge: Literal["rise", "fall", "cross"] = "cross"
    index: int = 1
    delay: float = 0.0
    at: float | None = None
    late: tuple[tuple[str, Expression], ...] = ()


class Measure(NamedTuple):
    """A ``.measure`` card.

    ``operation`` is one of ``trig_targ find_when find_at when max min pp avg rms integ max_at
    min_at deriv param``.  ``expression`` is the measured quantity (any combination of signals),
    ``start`` and ``stop`` bound the window, ``first``/``second`` are TRIG/TARG or WHEN; those of a
    statistic are the ends of its window.  ``runs`` are the numbers of the ``Deck.runs`` that it
    belongs to, None for all runs of its analysis; ``late`` is that of ``Cond``.
    """

    name: str
    analysis: str
    operation: str
    span: Span
    expression: Expression | None = None
    first: Cond | None = None
    second: Cond | None = None
    start: float | None = None
    stop: float | None = None
    at: float | None = None
    runs: tuple[int, ...] | None = None
    late: tuple[tuple[str, Expression], ...] = ()

    @property
    def conditions(self) -> list[Cond]:
        """TRIG and TARG, or WHEN, as far as they are given."""
        return [c for c in (self.first, self.second) if c is not None]

    @property
    def expressions(self) -> list[Expression]:
        """All that is evaluated: the measured quantity and both sides of conditions."""
        asked = [self.expression, *(e for c in self.conditions for e in (c.signal, c.other))]
        return [e for e in asked if e is not None]

    @property
    def is_spectral(self) -> bool:
        """Whether it is a distortion or the amplitude of a harmonic."""
        return self.operation == "thd" or self.operation.startswith("harm")

    @property
    def is_hot(self) -> bool:
        """Whether it is one of ``psw(x)`` or ``tj(x)``."""
        text = "" if self.expression is None else self.expression.text.lower()
        return text.startswith(("psw(", "tj("))


class AcCard(NamedTuple):
    """``.ac dec|oct|lin n from to``, ``.ac list f ...``: frequencies [Hz].

    ``sidebands`` is how many multiples of the orbit's own frequency are shown on both sides.
    """

    frequencies: tuple[float, ...]
    sidebands: int
    span: Span


class NoiseCard(NamedTuple):
    """``.noise v(out) source dec|oct|lin n from to``: noise about the operating point."""

    output: str
    source: str
    frequencies: tuple[float, ...]
    span: Span


class TfCard(NamedTuple):
    """``.tf output source``: DC gain and resistances about the operating point."""

    output: str
    source: str
    span: Span


class PzCard(NamedTuple):
    """``.pz n1 n2 n3 n4 vol|cur pol|zer|pz``: poles and zeros between two ports."""

    input: tuple[str, str]
    output: tuple[str, str]
    kind: str
    wanted: str
    span: Span


class SpCard(NamedTuple):
    """``.sp dec|oct|lin n from to``: scattering parameters between the V with ``portnum``."""

    frequencies: tuple[float, ...]
    span: Span


class LoopCard(NamedTuple):
    """``.loop source dec|oct|lin n from to``: the loop gain at a source of zero volts."""

    source: str
    frequencies: tuple[float, ...]
    span: Span


class FourCard(NamedTuple):
    """``.four [f] signal ... [harms=n] [periods=n]``: coefficients of ``.pss`` or ``.tran``.

    ``frequency`` [Hz] is None if it is that of the periodic steady state.
    """

    frequency: float | None
    signals: tuple[str, ...]
    harmonics: int
    periods: int
    span: Span


class SensCard(NamedTuple):
    """``.sens signal ... [element ...]``, ``.sens measure ... [parameter|element ...]``.

    Derivatives of averages of ``.pss`` by elements; of measures by parameters and elements, both of
    which ``names`` holds but for elements.
    """

    signals: tuple[str, ...]
    elements: tuple[str, ...]
    span: Span
    names: tuple[str, ...] = ()


class Delay(NamedTuple):
    """``delay(x, td)`` in a run: an element shows what a signal was some time ago [s]."""

    element: str
    signal: str
    delay: float
    span: Span


class Sampled(NamedTuple):
    """A transfer function of z, ``E1 a b ZTRANS {input} = {H(z)} period=``.

    Parameters
    ----------
    source : str
        The independent source that is its output.
    signal : str
        Its input.
    numerator, denominator : tuple of float
        From the highest power of z; the first coefficient of the denominator is 1.
    period, delay, offset : float
        Of its clock, from the sample to the output, and of the first sample [s].
    start : float
        Output before the first sample [V or A].
    low, high : float
        Limits of the output [V or A].
    """

    source: str
    signal: str
    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    period: float
    delay: float
    offset: float
    start: float
    low: float
    high: float
    span: Span


class HeatSinkCard(NamedTuple):
    """``.heatsink Foster=table(r=... tau=...) element ...``: a way of heat that elements share.

    ``network`` is the parameter ``foster`` or ``cauer``.
    """

    network: Param
    elements: tuple[str, ...]
    span: Span


Analysis = (
    OpCard | DcCard | TranCard | PssCard | AcCard | LoopCard | NoiseCard | TfCard | PzCard | SpCard
)
_KINDS = {
    OpCard: "op",
    DcCard: "dc",
    TranCard: "tran",
    PssCard: "pss",
    AcCard: "ac",
    LoopCard: "loop",
    NoiseCard: "noise",
    TfCard: "tf",
    PzCard: "pz",
    SpCard: "sp",
}


def kind_of(card: Analysis) -> str:
    """Return the name of the card: ``op``, ``dc``, ``tran`` ..."""
    return _KINDS[type(card)]


class Alteration(NamedTuple):
    """What ``alter``, ``altermod``, ``alterparam`` or ``set temp`` changes before a run.

    ``kind`` is ``element model param temp``; ``key`` the parameter, empty for the value of an
    element; ``values`` has one number, or the arguments of a waveform.
    """

    kind: str
    name: str
    key: str
    values: tuple[float, ...]
    span: Span

    @property
    def label(self) -> str:
        """What the change is called in results."""
        return f"@{self.name}[{self.key}]" if self.key else self.name


class Run(NamedTuple):
    """An analysis of a ``.control`` program: its card, and what has been altered before it."""

    card: Analysis
    alterations: tuple[Alteration, ...] = ()


@dataclass(slots=True)
class Deck:
    """An expanded netlist.

    Parameters
    ----------
    title : str
    file : str
        As the user gave it, ``<netlist>`` for text.
    elements : list of Element
        In deck order, subcircuit contents in place of their X line.
    analyses : list of Analysis
    options : dict of str to Param
        Lower-case names; flags hold the value 1.0.
    initial, nodesets : dict of str to Param
        ``.ic`` and ``.nodeset`` voltages [V] by node.
    saves : list of Signal
        From .save .print .plot .probe; empty means the default set.  ``all``, ``alli`` are kept as
        names of their own.
    measures : list of Measure
    fours : list of FourCard
    sensitivities : list of SensCard
    heat_sinks : list of HeatSinkCard
    sampled : list of Sampled
    delays : list of Delay
    steps : list of Sweep
        ``.step`` cards, the first one runs fastest.
    runs : list of Run
        What a ``.control`` program runs; without one every analysis is run once.
    temperature : float
        [degrees Celsius], 27 by default.
    parameters : dict of str to float
        Top-level ``.param`` values, evaluated.
    warnings : list of Diagnostic
    source : str
        The text, if it did not come from a file.
    seed : int
        Of its random values.
    overrides : dict of str to float
        Parameter values that the caller gave in place of the deck's.
    confined : bool
        Whether files from outside of the deck's folder are refused.
    included : tuple of Path
        Files that ``.include`` and ``.lib`` cards have read.
    outline : Outline or None
        Its lines, kept by a deck that is read again with other values.
    """

    title: str
    file: str
    elements: list[Element] = field(default_factory=list)
    analyses: list[Analysis] = field(default_factory=list)
    options: dict[str, Param] = field(default_factory=dict)
    initial: dict[str, Param] = field(default_factory=dict)
    nodesets: dict[str, Param] = field(default_factory=dict)
    saves: list[Signal] = field(default_factory=list)
    measures: list[Measure] = field(default_factory=list)
    fours: list[FourCard] = field(default_factory=list)
    sensitivities: list[SensCard] = field(default_factory=list)
    heat_sinks: list[HeatSinkCard] = field(default_factory=list)
    sampled: list[Sampled] = field(default_factory=list)
    delays: list[Delay] = field(default_factory=list)
    steps: list[Sweep] = field(default_factory=list)
    runs: list[Run] = field(default_factory=list)
    temperature: float = 27.0
    #: nodes that ``initial`` holds at every operating point
    integrators: frozenset[str] = frozenset()
    #: whether values were computed from ``temper``
    thermal: bool = False
    parameters: dict[str, float] = field(default_factory=dict)
    warnings: list[Diagnostic] = field(default_factory=list)
    source: str = ""
    seed: int = 0
    overrides: dict[str, float] = field(default_factory=dict)
    confined: bool = False
    included: tuple[Path, ...] = ()
    outline: Outline | None = field(default=None, repr=False, compare=False)
