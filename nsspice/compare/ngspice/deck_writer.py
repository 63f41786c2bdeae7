"""The lines of an ngspice deck while it is being written, and what they stand for."""

from __future__ import annotations

from dataclasses import dataclass

from ...devices.stamper import Conditions
from ...errors import Diagnostic, UsageError
from ...netlist.deck import Model
from .names import Names
from .options import Options


@dataclass(frozen=True, slots=True)
class Substitute:
    """A law that ngspice does not have, and what was used in its place.

    Parameters
    ----------
    elements : tuple of str
    law : str
        Such as ``ideal diode``.
    used : str
        Such as ``sidiode(ron=1e-06 roff=1e+12)``.
    """

    elements: tuple[str, ...]
    law: str
    used: str

    def __str__(self) -> str:
        shown = " ".join(self.elements[:6])
        if len(self.elements) > 6:
            shown += f" ... ({len(self.elements)} elements)"
        return f"{shown}: {self.law} -> {self.used}"


class DeckWriter:
    """Collects element and model lines.

    Parameters
    ----------
    options : Options
        With ``junction`` and ``edge`` decided.
    conditions : Conditions
        Temperature, swept values and times.
    edge, stop : float
        Length of ramps and end of the run [s].
    """

    def __init__(self, options: Options, conditions: Conditions, edge: float, stop: float) -> None:
        self.options = options
        self.conditions = conditions
        self.edge = edge
        self.stop = stop
        self.names = Names()
        self.lines: list[str] = []
        self.models: list[str] = []
        #: values then follow the temperature in ngspice
        self.sweeps_temperature = False
        #: elements whose current is measured by a source of 0 V in series
        self.metered: set[str] = set()
        #: those whose meter is in the deck
        self.written: set[str] = set()
        #: elements that are voltage sources in ngspice
        self.own_current: set[str] = set()
        self._substitutes: dict[tuple[str, str], list[str]] = {}
        self._laws: dict[object, str] = {}

    def add(self, *words: object) -> None:
        """Write a line: numbers are written so that they read back exactly."""
        texts = (repr(float(w)) if isinstance(w, int | float) else str(w) for w in words)
        self.lines.append(" ".join(filter(None, texts)))

    def node(self, name: str) -> str:
        """Return the spelling of a node."""
        return self.names.node(name)

    def ends(self, element: str, nodes: tuple[str, ...], tags: str = "") -> list[str]:
        """Return the spelled nodes of an element, with meters where currents are needed.

        Parameters
        ----------
        element : str
        nodes : tuple of str
        tags : str
            Letters of the terminals, ``cbe``: the current into the first one is that of the
            element, ``i(q1)``, the others are ``i(q1.b)`` and ``i(q1.e)``.
        """
        found = []
        for k, node in enumerate(nodes):
            spelled = self.node(node)
            names = ([element] if k == 0 else []) + ([f"{element}.{tags[k]}"] if tags[k:] else [])
            for name in names:
                if name in self.metered:
                    spelled = self.metered_node(name, spelled)
            found.append(spelled)
        return found

    def metered_node(self, name: str, node: str) -> str:
        """Return the node behind a source of 0 V, whose current is measured."""
        inner = self.names.inner(f"at_{name}")
        self.add(self.meter(name), node, inner, "DC 0")
        self.written.add(name)
        return inner

    def meter(self, element: str) -> str:
        """Return the name of the voltage source whose current is that of an element."""
        if element in self.own_current:
            return self.names.element("v", element)
        return self.names.element("v", f"am_{element}")

    def signal(self, name: str, own: str = "") -> str:
        """Return the spelling of a signal in an expression; ``i`` is the element's own current."""
        if name == "i":
            return own
        if name.startswith("v("):
            return f"v({','.join(self.node(n.strip()) for n in name[2:-1].split(','))})"
        if name.startswith("i("):
            return f"i({self.meter(name[2:-1])})"
        return name

    def model(self, key: object, name: str, body: str) -> str:
        """Return the name of a model, whose card is written the first time."""
        if key not in self._laws:
            spelled, _ = self.names.model(len(self._laws), name)
            self._laws[key] = spelled
            self.models.append(f".model {spelled} {body}")
        return self._laws[key]

    def verbatim(self, model: Model) -> str:
        """Return the name of a model card that ngspice reads as it is."""
        words = []
        for key, param in model.params.items():
            if not isinstance(param.value, int | float):
                continue  # the circuit was built, so it is a note such as mfg=
            words.append(f"{key}={float(param.value)!r}")
        return self.model(("card", id(model)), model.name, f"{model.type}({' '.join(words)})")

    def substitute(self, element: str, law: str, used: str) -> None:
        """Note what stands for the law of an element."""
        self._substitutes.setdefault((law, used), []).append(element)

    @property
    def substitutes(self) -> tuple[Substitute, ...]:
        """All that was replaced, equal laws together."""
        return tuple(
            Substitute(tuple(elements), law, used)
            for (law, used), elements in self._substitutes.items()
        )


def untranslatable(message: str, hint: str = "") -> UsageError:
    """Return the error for something that cannot be said in ngspice's language."""
    return UsageError(
        Diagnostic(
            "NS4014", message, hint=hint or "name a reference: nsspice compare X.net ref.csv"
        )
    )
