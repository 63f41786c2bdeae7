"""From a circuit to a deck that ngspice reads."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from ...analyses.request.cards import Dc, Op, Tran
from ...analyses.signals.signal_names import canonical
from ...circuit import Circuit, parse_signal, unknown_signal
from ...circuit.build import default_conditions
from ...devices.stamper import Conditions
from ...netlist.deck import Element, Sweep
from .deck_writer import DeckWriter, Substitute, untranslatable
from .elements import is_voltage_source, write
from .options import Options

AnyAnalysis = Op | Dc | Tran


@dataclass(frozen=True, slots=True)
class Translation:
    """A deck for ngspice.

    Parameters
    ----------
    text : str
        The deck.
    analysis : Op, Dc or Tran
    options : Options
        With nothing left open: ``junction``, ``max_step`` and ``edge`` are decided.
    vectors : dict of str to str
        ngspice's vector of each signal; ``v(a,b)`` is not among them.
    substitutes : tuple of Substitute
        Laws that ngspice does not have.
    """

    text: str
    analysis: AnyAnalysis
    options: Options
    vectors: dict[str, str]
    substitutes: tuple[Substitute, ...]

    @property
    def exact(self) -> bool:
        """True if ngspice has every law of the circuit."""
        return not self.substitutes


def translate(
    circuit: Circuit,
    analysis: AnyAnalysis,
    signals: Iterable[str] | None = None,
    options: Options | None = None,
    *,
    values: Mapping[str, float] | None = None,
    temperature: float | None = None,
) -> Translation:
    """Return a circuit as a deck for ngspice.

    Parameters
    ----------
    circuit : Circuit
    analysis : Op, Dc or Tran
    signals : iterable of str, optional
        What to save: ``v(a)``, ``v(a,b)``, ``i(element)``; the circuit's default signals if left
        out.
    options : Options, optional
    values : mapping of str to float, optional
        Values of elements that replace those of the deck.
    temperature : float, optional
        [degrees Celsius]

    Raises
    ------
    UsageError
        NS4014 if ngspice has nothing that could stand for a part of the deck.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''half wave
    ... V1 in 0 SIN(0 10 50)
    ... D1 in out
    ... R1 out 0 1k
    ... ''')
    >>> deck = translate(circuit, Tran(0.02), ["v(out)"], Options(junction="sidiode"))
    >>> print(deck.substitutes[0])
    d1: ideal diode -> sidiode(ron=1e-06 roff=1e+12)
    """
    if circuit.deck.sampled:
        found = circuit.deck.sampled[0]
        raise untranslatable(f"{found.source} is a function of z")
    if circuit.deck.delays:
        raise untranslatable(f"{circuit.deck.delays[0].element} is a delay")
    names = [canonical(s) for s in (circuit.default_signals() if signals is None else signals)]
    options = complete(options or Options(), analysis)
    if options.rshunt is None and any(w.code == "NS2051" for w in circuit.warnings):
        options = replace(options, rshunt=1e12)  # a part of the circuit floats
    conditions = _conditions(circuit, analysis, values or {}, temperature)
    stop = analysis.stop if isinstance(analysis, Tran) else 0.0
    writer = DeckWriter(options, conditions, options.edge or 1e-9, stop)
    writer.sweeps_temperature = any(s.kind == "temp" for s in getattr(analysis, "sweeps", ()))
    elements = {element.name: element for element in circuit.deck.elements}
    _measure(writer, circuit, elements, names)
    for device in circuit.devices:
        write(writer, elements[device.name], device)
    vectors = _vectors(writer, circuit, elements, names)
    swept = [(s, elements.get(s.name)) for s in getattr(analysis, "sweeps", ())]
    text = "\n".join(
        [
            # the deck's own title could hold the word error, which is taken for one
            "cross-check of nsspice",
            *writer.lines,
            *writer.models,
            *_initial(writer, circuit),
            options.card(),
            f".options temp={conditions.temperature!r} tnom={conditions.nominal!r}",
            *(f".save {vector}" for vector in dict.fromkeys(vectors.values())),
            _analysis_card(writer, analysis, options, swept),
            ".end",
            "",
        ]
    )
    return Translation(text, analysis, options, vectors, writer.substitutes)


def complete(options: Options, analysis: AnyAnalysis) -> Options:
    """Return the options with maximum step and edges decided for an analysis."""
    ron, roff = options.resistances
    junction = "sidiode" if options.junction == "auto" else options.junction
    options = replace(options, junction=junction, ron=ron, roff=roff)
    max_step = options.max_step
    if isinstance(analysis, Tran):
        if max_step is None:
            max_step = min(analysis.max_step or math.inf, usual_step(analysis))
        edge = options.edge or 1e-3 * max_step
        return replace(options, max_step=max_step, edge=edge)
    return options


def usual_step(analysis: Tran) -> float:
    """Return half the distance of the rows, or a ten-thousandth of the run if that is less [s].

    Lines between ngspice's points are compared with rows: corners need short ones.

    Examples
    --------
    >>> usual_step(Tran(stop=1e-3, row_step=1e-6))
    1e-07
    """
    return min(analysis.row_distance / 2.0, analysis.stop / 10_000.0)


def _conditions(
    circuit: Circuit,
    analysis: AnyAnalysis,
    values: Mapping[str, float],
    temperature: float | None,
) -> Conditions:
    base = default_conditions(circuit.deck)
    if temperature is not None:
        base = replace(base, temperature=temperature)
    if not isinstance(analysis, Tran):
        return replace(base, values=dict(values), analysis="dc")
    return replace(
        base,
        values=dict(values),
        analysis="tran",
        tstep=analysis.row_step or base.tstep,
        tstop=analysis.stop,
    )


def _measure(
    writer: DeckWriter,
    circuit: Circuit,
    elements: Mapping[str, Element],
    names: Sequence[str],
) -> None:
    """Find the elements whose current is needed and that do not provide it themselves."""
    own = {d.name for d in circuit.devices if is_voltage_source(elements[d.name], d)}
    wanted: set[str] = set()
    for element in elements.values():
        if element.letter in "fhw":
            wanted.update(element.controls[:1])
    for device in circuit.devices:
        for expression in device.expressions:
            for name in expression.variables():
                if name == "i":
                    wanted.add(device.name)
                elif name.startswith("i("):
                    wanted.add(name[2:-1])
    for name in names:
        parsed = parse_signal(name)
        if parsed is None:
            raise unknown_signal(name, circuit.default_signals())
        if parsed.kind == "i" and not _tells(elements.get(parsed.names[0])):
            wanted.add(parsed.names[0])
    writer.own_current = own
    writer.metered = wanted - own


def _tells(element: Element | None) -> bool:
    """Return whether ngspice saves the current of an element under the element's own name."""
    if element is None:
        return False
    return element.letter == "l" or (
        element.letter in "eh" and isinstance(element.value, int | float) and not element.quantity
    )


def _vectors(
    writer: DeckWriter,
    circuit: Circuit,
    elements: Mapping[str, Element],
    names: Sequence[str],
) -> dict[str, str]:
    """Return ngspice's vector for each node voltage and current that the signals need."""
    vectors: dict[str, str] = {}
    for name in names:
        parsed = parse_signal(name)
        if parsed is None or parsed.kind == "p":
            continue
        for part in parsed.names:
            if parsed.kind == "v":
                if part != "0" and part not in circuit.node_island:
                    raise unknown_signal(name, circuit.default_signals())
                if part != "0":
                    vectors[f"v({part})"] = f"v({writer.node(part)})"
                continue
            element = elements.get(part)
            if element is None and part not in writer.written:
                raise unknown_signal(name, circuit.default_signals())
            meter = writer.meter(part)
            if element is not None and part not in writer.metered | writer.own_current:
                meter = writer.names.element(element.letter, part)
            vectors[name] = f"i({meter})"
    return vectors


def _initial(writer: DeckWriter, circuit: Circuit) -> list[str]:
    """Return ``.ic`` and ``.nodeset`` cards."""
    deck = circuit.deck
    lines = []
    for card, given in ((".ic", deck.initial), (".nodeset", deck.nodesets)):
        for node, param in given.items():
            if node in circuit.node_island and isinstance(param.value, int | float):
                lines.append(f"{card} v({writer.node(node)})={float(param.value)!r}")
    return lines


def _analysis_card(
    writer: DeckWriter,
    analysis: AnyAnalysis,
    options: Options,
    swept: Sequence[tuple[Sweep, Element | None]],
) -> str:
    if isinstance(analysis, Op):
        return ".op"
    if isinstance(analysis, Tran):
        step = min(analysis.row_distance, analysis.stop)
        uic = " uic" if analysis.uic else ""
        times = (step, analysis.stop, analysis.start, options.max_step)
        return f".tran {' '.join(repr(t) for t in times)}{uic}"
    words = []
    for sweep, element in swept:
        name = "temp" if sweep.kind == "temp" else sweep.name
        if element is not None:
            name = writer.names.element(element.letter, sweep.name)
        elif sweep.kind != "temp":
            raise untranslatable(f"ngspice cannot sweep {sweep.name}")
        values = sweep.values
        step = (values[-1] - values[0]) / max(len(values) - 1, 1)
        even = all(
            math.isclose(values[0] + k * step, v, rel_tol=1e-9, abs_tol=1e-9 * abs(step))
            for k, v in enumerate(values)
        )
        if not even:
            raise untranslatable(f"ngspice cannot sweep {sweep.name} over uneven values")
        last = values[-1] + 1e-6 * step  # ngspice adds up steps and could miss the last one
        words.append(f"{name} {values[0]!r} {last!r} {step or 1.0!r}")
    return ".dc " + " ".join(words)
