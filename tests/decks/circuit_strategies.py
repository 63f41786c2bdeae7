"""Hypothesis strategies for small passive networks, made so that failures shrink well."""

from __future__ import annotations

from dataclasses import dataclass, replace

from hypothesis import strategies as st

from decks.random_circuits import CLASSES, generate

#: values are short so that a shrunk example reads well
RESISTANCES = (1.0, 10.0, 220.0, 1000.0)
CAPACITANCES = (1e-7, 1e-6, 2.2e-6)
INDUCTANCES = (1e-4, 1e-3, 4.7e-3)


@dataclass(frozen=True)
class Part:
    """One element: letter, nodes, value and initial value (sources: amplitude)."""

    letter: str
    a: str
    b: str
    value: float = 0.0
    initial: float = 0.0


@dataclass(frozen=True)
class Network:
    """Elements in order; ``text`` writes the deck.

    Parameters
    ----------
    numbers : tuple of int
        Number of each element in its name, so that reordering keeps the names.
    """

    parts: tuple[Part, ...]
    numbers: tuple[int, ...]

    def text(self) -> str:
        """Return the netlist."""
        return "\n".join(["* generated", *map(self._line, self.parts, self.numbers), ""])

    @staticmethod
    def _line(part: Part, number: int) -> str:
        head = f"{part.letter}{number} {part.a} {part.b}"
        if part.letter == "D":
            return head
        if part.letter in "CL":
            return f"{head} {part.value!r} IC={part.initial!r}"
        return f"{head} {part.value!r}"

    def names(self) -> list[str]:
        """Return the element names, lower case."""
        return [f"{p.letter.lower()}{k}" for p, k in zip(self.parts, self.numbers, strict=True)]

    def with_part(self, part: Part) -> Network:
        """Return the network with one more element."""
        return Network((*self.parts, part), (*self.numbers, max(self.numbers) + 1))

    def permuted(self, order: list[int]) -> Network:
        """Return the network with its elements in another order."""
        return Network(tuple(self.parts[k] for k in order), tuple(self.numbers[k] for k in order))

    def renamed(self, names: dict[str, str]) -> Network:
        """Return the network with other node names."""
        return replace(
            self,
            parts=tuple(
                replace(p, a=names.get(p.a, p.a), b=names.get(p.b, p.b)) for p in self.parts
            ),
        )

    def impedances_scaled(self, k: float) -> Network:
        """Return the network with R and L times k, C and all currents divided by k."""
        scaled = []
        for p in self.parts:
            if p.letter == "L":
                p = replace(p, value=p.value * k, initial=p.initial / k)
            elif p.letter == "R":
                p = replace(p, value=p.value * k)
            elif p.letter in "CI":
                p = replace(p, value=p.value / k)
            scaled.append(p)
        return replace(self, parts=tuple(scaled))

    def nodes(self) -> list[str]:
        """Return all nodes but ground, in order of appearance."""
        return [n for n in dict.fromkeys(n for p in self.parts for n in (p.a, p.b)) if n != "0"]


@st.composite
def networks(draw: st.DrawFn, sources: bool = True) -> Network:
    """Draw a connected network of R, L, C and ideal diodes, with a voltage source if asked for."""
    count = draw(st.integers(2, 5))
    nodes = ["0"] + [f"n{k}" for k in range(1, count + 1)]
    parts: list[Part] = []
    for k in range(1, count + 1):  # a tree of R and C ties every node down
        other = nodes[draw(st.integers(0, k - 1))]
        letter = draw(st.sampled_from("RC"))
        parts.append(_part(draw, letter, nodes[k], other))
    for _ in range(draw(st.integers(1, 7))):
        a = draw(st.sampled_from(nodes))
        b = draw(st.sampled_from([n for n in nodes if n != a]))
        letter = draw(st.sampled_from("DDDRLC"))
        parts.append(_part(draw, letter, a, b))
    if sources:
        # behind a resistor, so that no diode can short it
        parts.append(Part("V", "src", "0", draw(st.sampled_from((5.0, -5.0, 12.0)))))
        parts.append(_part(draw, "R", "src", draw(st.sampled_from(nodes[1:]))))
    return Network(tuple(parts), tuple(range(1, len(parts) + 1)))


def _part(draw: st.DrawFn, letter: str, a: str, b: str) -> Part:
    if letter == "R":
        return Part("R", a, b, draw(st.sampled_from(RESISTANCES)))
    if letter == "C":
        initial = draw(st.sampled_from((0.0, 5.0, -3.0)))
        return Part("C", a, b, draw(st.sampled_from(CAPACITANCES)), initial)
    if letter == "L":
        initial = draw(st.sampled_from((0.0, 0.5, -1.0)))
        return Part("L", a, b, draw(st.sampled_from(INDUCTANCES)), initial)
    return Part("D", a, b)


#: decks of the eight hard classes, by seed
hard_circuits = st.builds(generate, st.sampled_from(CLASSES), st.integers(1000, 10**6))
