"""From a path or text to a circuit, again and again with other parameter values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ...circuit import Circuit, build
from ...circuit.build import completed
from ...circuit.line_settings import with_junctions
from ...errors import Diagnostic, NetlistError, UsageError
from ...netlist.deck import Deck
from ...netlist.parsing import Outline, deck_of, outline_of, text_of
from .arguments import finite


def read(
    source: str | Path,
    params: Mapping[str, float] | None = None,
    *,
    confined: bool = False,
    seed: int = 0,
    junctions: str | None = None,
) -> Circuit:
    """Read a netlist and check everything that can be checked without solving it.

    Parameters
    ----------
    source : str or Path
        A file name, or the netlist itself if it has more than one line.
    params : mapping of str to float, optional
        Values that replace those of top-level ``.param`` cards.
    confined : bool
        Whether files outside the netlist's folder are refused: for services that read untrusted
        decks, which could otherwise make messages quote private files.
    seed : int
        Of the random values that the deck draws (``agauss``, ``mc`` ...).
    junctions : str, optional
        ``lines`` or ``lines:0.02``: junctions as broken lines, whose currents and charges differ by
        5 % or 2 % of a scale of each card at most; such circuits are solved exactly.  ``model``: as
        they are.  By default what the deck says.

    Returns
    -------
    Circuit

    Raises
    ------
    NetlistError, TopologyError
        With all findings of the deck.
    UsageError
        NS1083 for a parameter that the deck does not have.

    Examples
    --------
    >>> circuit = read('''divider
    ... .param r=1k
    ... V1 a 0 1
    ... R1 a b {r}
    ... R2 b 0 1k
    ... ''', params={"r": 3e3})
    >>> circuit.default_signals()
    ['v(a)', 'v(b)', 'i(v1)']
    """
    deck = read_deck(source, params, confined=confined, seed=seed, junctions=junctions)
    return build(deck)


def need_circuit(circuit: object) -> None:
    """Raise TypeError for anything but a circuit: a netlist must be read first."""
    if not isinstance(circuit, Circuit):
        raise TypeError(
            f"a Circuit is needed, not {type(circuit).__name__}: make one with nsspice.read(...)"
        )


def read_deck(
    source: str | Path,
    params: Mapping[str, float] | None = None,
    file: str = "<netlist>",
    *,
    confined: bool = False,
    seed: int = 0,
    junctions: str | None = None,
) -> Deck:
    """Return the deck of a file or text, which remembers how to be read again.

    Parameters
    ----------
    source : str or Path
    params : mapping of str to float, optional
    file : str
        Name for the messages about a text.
    confined : bool
        Whether files from outside of the folder are refused.
    seed : int
        Of its random values.
    junctions : str, optional
        As for :func:`read`.

    Raises
    ------
    NetlistError
        With what cannot be read, and what is wrong with the values of all other lines.
    UsageError
        NS1083 for a parameter that the deck does not have, NS4005 for a value that is not a number.
    """
    if not isinstance(source, str | Path):
        raise TypeError(
            f"a netlist is read from a file name or from its text, not from {type(source).__name__}"
        )
    given = dict(params or {})
    _check(given)
    outline = _outline(source, file, confined)
    deck = _valued(outline, given, seed, confined)
    if not _is_path(source):
        deck.source = str(source)
    return deck if junctions is None else with_junctions(deck, junctions)


def _is_path(source: str | Path) -> bool:
    return isinstance(source, Path) or bool(source.strip() and "\n" not in source)


def _outline(source: str | Path, file: str, confined: bool) -> Outline:
    """Return the lines of a file or text."""
    if _is_path(source):
        path = Path(source)
        return outline_of(text_of(path), str(path), path.parent, confined)
    return outline_of(str(source), file, None, confined)


def _check(given: Mapping[str, float]) -> None:
    """Raise UsageError for a value that is not a finite number."""
    for name, value in given.items():
        if not finite(value):
            message = f"parameter {name} cannot be {value!r}"
            raise UsageError(Diagnostic("NS4005", message, hint="give a finite number"))


def _valued(outline: Outline, given: dict[str, float], seed: int, confined: bool) -> Deck:
    """Return the deck of an outline with some values."""
    try:
        deck = deck_of(outline, given, seed)
    except NetlistError as error:
        raise completed(error) from None
    unknown = [w for w in deck.warnings if w.code == "NS1083" and w.span is None]
    if unknown:  # a name of a .step card has a place
        raise UsageError([replace(w, severity="error") for w in unknown])
    deck.overrides, deck.confined = given, confined
    return deck


def read_again(deck: Deck, params: Mapping[str, float]) -> Circuit:
    """Return the circuit of a deck with some parameters changed."""
    given = {**deck.overrides, **params}
    _check(given)
    outline, deck.outline = deck.outline, None
    if outline is None:
        outline = _outline(deck.source or Path(deck.file), deck.file, deck.confined)
    again = _valued(outline, given, deck.seed, deck.confined)
    again.source = deck.source
    if not outline.scripts:  # programs keep what they have computed
        deck.outline = again.outline = outline
    asked = deck.options.get("junctions")
    return build(again if asked is None else with_junctions(again, str(asked.value)))


def at_temperature(circuit: Circuit, temperature: float | None) -> Circuit:
    """Return a circuit whose values are computed from a temperature [C], where any is at all."""
    if temperature is None or not circuit.deck.thermal:
        return circuit
    return read_again(circuit.deck, {"temper": temperature})


def again(deck: Deck, params: Mapping[str, float]) -> Circuit:
    """Return the circuit of a deck, read again only if some parameters are changed."""
    return read_again(deck, params) if params else build(deck)
