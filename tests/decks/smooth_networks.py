"""Small networks with smooth junctions and transistors, written as arrays by hand.

They do not pass through the netlist or the device laws, so that a test of Newton's method stands on
its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from nsspice.problems import Csc, DescriptorSystem, Functional, SmoothTerms, TapeBuilder, Waveform

#: thermal voltage [V] of all junctions
VT = 0.025852

Entries = list[tuple[int, int, float]]


def dc(value: float) -> Waveform:
    """Return a constant source."""
    return Waveform("dc", (value,))


@dataclass
class Network:
    """A network under construction; node 0 is ground, others are numbered from 1 to ``nodes``."""

    nodes: int
    storage: Entries = field(default_factory=list)
    conductance: Entries = field(default_factory=list)
    multipliers: Entries = field(default_factory=list)
    slacks: Entries = field(default_factory=list)
    sources: Entries = field(default_factory=list)
    functions: Entries = field(default_factory=list)
    charges: Entries = field(default_factory=list)
    offsets: list[float] = field(default_factory=list)
    waveforms: list[Waveform] = field(default_factory=list)
    branches: int = 0
    tape: TapeBuilder = field(default_factory=TapeBuilder)
    outputs: int = 0

    def _put(self, where: Entries, node: int, column: int, value: float) -> None:
        if node:
            where.append((node - 1, column, value))

    def _across(self, where: Entries, a: int, b: int, value: float) -> None:
        for row, sign in ((a, 1.0), (b, -1.0)):
            for column, other in ((a, 1.0), (b, -1.0)):
                if column:
                    self._put(where, row, column - 1, sign * other * value)

    def resistor(self, a: int, b: int, ohm: float) -> None:
        self._across(self.conductance, a, b, 1.0 / ohm)

    def capacitor(self, a: int, b: int, farad: float) -> None:
        self._across(self.storage, a, b, farad)

    def _branch(self, a: int, b: int) -> int:
        row = self.nodes + self.branches
        self.branches += 1
        for node, sign in ((a, 1.0), (b, -1.0)):
            if node:
                self.conductance += [(node - 1, row, sign), (row, node - 1, -sign)]
        return row

    def inductor(self, a: int, b: int, henry: float) -> int:
        row = self._branch(a, b)
        self.storage.append((row, row, henry))
        return row

    def voltage(self, a: int, b: int, waveform: Waveform) -> int:
        row = self._branch(a, b)
        self.sources.append((row, len(self.waveforms), -1.0))
        self.waveforms.append(waveform)
        return row

    def ideal_diode(self, a: int, b: int, drop: float = 0.0) -> None:
        pair = len(self.offsets)
        self.offsets.append(drop)
        for node, sign in ((a, 1.0), (b, -1.0)):
            if node:
                self.multipliers.append((node - 1, pair, sign))
                self.slacks.append((pair, node - 1, sign))

    def difference(self, a: int, b: int) -> int:
        return self.tape.op("sub", self.tape.unknown(a - 1), self.tape.unknown(b - 1))

    def output(self, register: int) -> int:
        self.outputs += 1
        return self.tape.output(register)

    def flow(self, function: int, *shares: tuple[int, float], charge: bool = False) -> None:
        """Let shares of a function leave nodes."""
        for node, share in shares:
            self._put(self.charges if charge else self.functions, node, function, share)

    def junction(self, a: int, b: int, saturation: float, emission: float) -> int:
        v = self.difference(a, b)
        f = self.output(self.tape.op("junction", v, constants=(saturation, emission * VT)))
        self.flow(f, (a, 1.0), (b, -1.0))
        return f

    def transistor(
        self,
        c: int,
        b: int,
        e: int,
        saturation: float = 1e-16,
        forward: float = 100.0,
        reverse: float = 1.0,
        emission: float = 1.0,
        sign: float = 1.0,
    ) -> None:
        """Add an Ebers-Moll transistor, NPN or (sign -1) PNP."""
        ends = [(b, e), (b, c)] if sign > 0 else [(e, b), (c, b)]
        f, r = (
            self.output(
                self.tape.op(
                    "junction", self.difference(*pair), constants=(saturation, emission * VT)
                )
            )
            for pair in ends
        )
        s = sign
        self.flow(f, (c, s), (b, s / forward), (e, -s * (1.0 + 1.0 / forward)))
        self.flow(r, (c, -s * (1.0 + 1.0 / reverse)), (b, s / reverse), (e, s))

    def system(self) -> DescriptorSystem:
        n, m, p = self.nodes + self.branches, len(self.offsets), self.outputs
        kinds = np.zeros(n, np.uint8)
        kinds[self.nodes :] = 1

        def csc(entries: Entries, shape: tuple[int, int]) -> Csc:
            rows, cols, values = zip(*entries, strict=True) if entries else ((), (), ())
            return Csc.from_triplets(shape, rows, cols, values)

        return DescriptorSystem(
            E=csc(self.storage, (n, n)),
            G=csc(self.conductance, (n, n)),
            A=csc(self.multipliers, (n, m)),
            B=csc(self.slacks, (m, n)),
            D=Csc.zeros((m, m)),
            q=np.array(self.offsets, dtype=float),
            S=csc(self.sources, (n, len(self.waveforms))),
            waveforms=tuple(self.waveforms),
            row_kind=kinds,
            smooth=SmoothTerms(
                self.tape.finish(), csc(self.functions, (n, p)), csc(self.charges, (n, p))
            ),
        )

    def voltages(self) -> list[Functional]:
        return [Functional(z=((k, 1.0),)) for k in range(self.nodes)]
