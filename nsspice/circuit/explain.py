"""What a circuit is, without simulating it: islands, unknowns, class and why, active effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from ..devices.device import Device
from ..errors import Diagnostic, RegularityError
from ..problems.verdict import Verdict
from .circuit import Circuit, Island
from .dlcp import DlcpForm, dlcp_form
from .mna import MnaSystem
from .problem_class import ProblemClass
from .regularity import DcUniqueness, dc_uniqueness
from .render import label_list, labelled_matrix


class Told(NamedTuple):
    """How an island is solved, what decides its cost, and what could be written differently."""

    method: str = ""
    cost: str = ""
    hints: tuple[str, ...] = ()


_NOTHING_TOLD = Told()

#: describes how an island is solved
Teller = Callable[[Circuit, Island, MnaSystem], Told]


@dataclass(frozen=True, slots=True)
class EffectLine:
    """Elements of one kind that the deck asked for the same effects.

    Parameters
    ----------
    kind : str
        ``diode``, ``resistor`` ...
    elements : tuple of str
    effects : tuple of str
        ``forward drop (vfwd=0.7 V)``: the effect and the parameter that called for it; the value
        is there if it is the same for all elements.
    """

    kind: str
    elements: tuple[str, ...]
    effects: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.kind} {label_list(self.elements)}: {', '.join(self.effects)}"


@dataclass(frozen=True, slots=True)
class IslandExplanation:
    """What one island is.

    Parameters
    ----------
    number : int
        Counted from 1.
    names : tuple of str
        Its elements.
    nodes : int
    unknowns, pairs : tuple of str
    problem_class : ProblemClass
    reason : str
    effects : tuple of EffectLine
    form : DlcpForm or None
        Only if asked for.
    without_form : str
        Why there is no DLCP form although it was asked for.
    uniqueness : DcUniqueness or None
        Whether the DC problem has at most one solution; None for linear islands.
    told : Told
        How it is solved, and what decides its cost.
    trajectory : tuple of Verdict
        Of an island that stores energy: whether each short step has one solution for all
        sources, and whether what is stored has one trajectory at most.
    """

    number: int
    names: tuple[str, ...]
    nodes: int
    unknowns: tuple[str, ...]
    pairs: tuple[str, ...]
    problem_class: ProblemClass
    reason: str
    effects: tuple[EffectLine, ...]
    form: DlcpForm | None = None
    without_form: str = ""
    uniqueness: DcUniqueness | None = None
    told: Told = _NOTHING_TOLD
    trajectory: tuple[Verdict, ...] = ()

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.names)

    def to_dict(self) -> dict[str, object]:
        """Return a JSON-ready mapping."""
        return {
            "island": self.number,
            "elements": self.elements,
            "nodes": self.nodes,
            "unknowns": list(self.unknowns),
            "pairs": list(self.pairs),
            "class": self.problem_class.name,
            "class_name": self.problem_class.value,
            "reason": self.reason,
            "method": self.told.method,
            "cost": self.told.cost,
            "hints": list(self.told.hints),
            "uniqueness": (
                {
                    "unique": self.uniqueness.unique,
                    "reason": self.uniqueness.reason,
                    "elements": list(self.uniqueness.elements),
                }
                if self.uniqueness
                else None
            ),
            "trajectory": [found.to_dict() for found in self.trajectory],
            "effects": [
                {"kind": e.kind, "elements": list(e.elements), "effects": list(e.effects)}
                for e in self.effects
            ],
            "dlcp": self.form.to_dict() if self.form else None,
            "no_dlcp": self.without_form,
        }

    def text(self) -> str:
        """Return the paragraph shown to the user."""
        told = self.told
        lines = [f"island {self.number}: {label_list(self.names, 12)}"]
        if told.method:
            lines.append(f"  solved by {told.method}")
        if told.cost:
            lines.append(f"  cost      {told.cost}")
        lines += [f"  hint      {hint}" for hint in told.hints]
        lines.append("  effects")
        lines += [f"    {line}" for line in self.effects]
        lines += [
            f"  class     {self.problem_class.name}, {self.problem_class.value}",
            f"  why       {self.reason}",
            f"  size      {_count(self.elements, 'element')}, {_count(self.nodes, 'node')}, "
            f"{_count(len(self.unknowns), 'unknown')}, {_count(len(self.pairs), 'pair')}",
            f"  unknowns  {label_list(self.unknowns, 12)}",
        ]
        if self.pairs:
            lines.append(f"  pairs     {label_list(self.pairs, 12)}")
        if self.uniqueness is not None:
            lines.append(f"  DC point  {self.uniqueness}")
        for label, found in zip(("steps", "path"), self.trajectory, strict=False):
            lines.append(f"  {label:<9} {found}")
        if self.form is not None:
            lines += _matrices(self.form)
        elif self.without_form:
            lines.append(f"  no DLCP form: {self.without_form}")
        return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class Explanation:
    """What a circuit is.

    Parameters
    ----------
    title, file : str
    islands : tuple of IslandExplanation
    warnings : tuple of Diagnostic
    skipped : tuple of str
        Elements that a transient leaves out, since nothing that is saved or measured depends on
        them.
    """

    title: str
    file: str
    islands: tuple[IslandExplanation, ...]
    warnings: tuple[Diagnostic, ...]
    skipped: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Return a JSON-ready mapping."""
        return {
            "title": self.title,
            "file": self.file,
            "islands": [island.to_dict() for island in self.islands],
            "skipped": list(self.skipped),
            "warnings": [warning.to_dict() for warning in self.warnings],
        }

    def text(self) -> str:
        """Return the text shown to the user; islands that look alike are shown once."""
        blocks = [f"{self.title or self.file}: {_count(len(self.islands), 'island')}"]
        if self.skipped:
            blocks.append(
                f"not simulated: {label_list(self.skipped, 12)}: no saved or measured signal "
                f"depends on them (--all)"
            )
        alike: dict[tuple[object, ...], list[IslandExplanation]] = {}
        for island in self.islands:
            key: tuple[object, ...] = (
                island.problem_class,
                island.elements,
                island.nodes,
                len(island.unknowns),
                len(island.pairs),
                tuple((e.kind, len(e.elements), e.effects) for e in island.effects),
            )
            alike.setdefault(key if island.form is None else (island.number,), []).append(island)
        for group in alike.values():
            block = group[0].text()
            if len(group) > 1:
                numbers = label_list([str(island.number) for island in group[1:]], 6)
                block += f"\n  and {_count(len(group) - 1, 'island')} like it: {numbers}"
            blocks.append(block)
        if self.warnings:
            blocks.append("\n".join(warning.render() for warning in self.warnings))
        return "\n\n".join(blocks) + "\n"


def explain(
    circuit: Circuit,
    matrices: bool = False,
    method: Teller | None = None,
    skipped: tuple[str, ...] = (),
) -> Explanation:
    """Return what a circuit is, without simulating it.

    Parameters
    ----------
    circuit : Circuit
    matrices : bool
        Also derive the DLCP matrices of each dynamic or set-valued island.
    method : callable, optional
        Describes how an island is solved; left out of the explanation without it.
    skipped : tuple of str
        Elements that have been left out of the circuit before.
    """
    return Explanation(
        circuit.deck.title,
        circuit.deck.file,
        tuple(
            _explain(circuit, k, island, matrices, method)
            for k, island in enumerate(circuit.islands, 1)
        ),
        tuple(circuit.warnings),
        skipped,
    )


def _explain(
    circuit: Circuit, number: int, island: Island, matrices: bool, method: Teller | None
) -> IslandExplanation:
    """Return what one island is."""
    mna = island.assemble()
    form, without = None, ""
    nonlinear = bool(mna.pairs) or mna.system.smooth is not None
    if matrices:
        try:
            form = dlcp_form(mna)
        except RegularityError as error:
            without = error.diagnostics[0].message
    return IslandExplanation(
        number,
        tuple(device.name for device in island.devices),
        len(island.nodes),
        tuple(mna.unknowns),
        tuple(mna.pairs),
        island.problem_class,
        island.reason,
        effect_lines(island.devices),
        form,
        without,
        dc_uniqueness(island.assemble(analysis="dc")) if nonlinear else None,
        method(circuit, island, mna) if method else _NOTHING_TOLD,
        _trajectory(mna) if nonlinear and not mna.system.static else (),
    )


def _trajectory(mna: MnaSystem) -> tuple[Verdict, ...]:
    """Return what theorems say of the trajectories of an island."""
    from ..problems.theorems.trajectories import each_step, one_trajectory

    return each_step(mna.system), one_trajectory(mna.system)


def effect_lines(devices: Sequence[Device]) -> tuple[EffectLine, ...]:
    """Return the active effects, elements with the same effects together.

    Parameters
    ----------
    devices : sequence of Device
    """
    groups: dict[tuple[object, ...], list[Device]] = {}
    for device in devices:
        key = (device.KIND, *((e.name, e.parameter) for e in device.effects))
        groups.setdefault(key, []).append(device)
    lines = []
    for members in groups.values():
        texts = []
        for k, effect in enumerate(members[0].effects):
            same = len({d.effects[k].value for d in members}) == 1
            texts.append(str(effect if same else replace(effect, value=None)))
        names = tuple(d.name for d in members)
        lines.append(EffectLine(members[0].KIND, names, tuple(texts)))
    return tuple(lines)


def _matrices(form: DlcpForm) -> list[str]:
    """Return the DLCP form as text, sources and constants only where there are any."""

    def terms(*names: tuple[str, str]) -> str:
        """Return a sum of the matrices that are not empty; sources and constants if not zero."""
        used = [n for n in names if getattr(form, n[0]).size and _shown(form, n[0])]
        return " + ".join(f"{matrix} {vector}".strip() for matrix, vector in used) or "0"

    lines = ["  DLCP form"]
    if form.states:
        rates = terms(("A", "x"), ("B", "u"), ("F", "s"), ("F1", "s'"), ("a", ""))
        lines.append(f"    x' = {rates}")
    if form.inputs:
        outputs = terms(("C", "x"), ("D", "u"), ("G", "s"), ("c", ""))
        lines.append(f"    y  = {outputs},  0 <= u perp y >= 0")
    for letter, names in (
        ("x", form.states),
        ("u", form.inputs),
        ("y", form.outputs),
        ("s", form.sources),
    ):
        if names:
            lines.append(f"    {letter} = ({', '.join(names)})")
    blocks = [
        ("A", form.states, form.states),
        ("B", form.states, form.inputs),
        ("C", form.outputs, form.states),
        ("D", form.outputs, form.inputs),
        ("F", form.states, form.sources),
        ("F1", form.states, form.sources),
        ("G", form.outputs, form.sources),
        ("a", form.states, ["1"]),
        ("c", form.outputs, ["1"]),
    ]
    for name, rows, columns in blocks:
        matrix = getattr(form, name)
        if matrix.size and _shown(form, name):
            shaped = matrix.reshape(len(rows), len(columns))
            lines += [f"    {line}" for line in labelled_matrix(name, rows, columns, shaped)]
    return lines


def _shown(form: DlcpForm, name: str) -> bool:
    """Return whether a matrix is worth a line: A to D always, the others if not zero."""
    return name in ("A", "B", "C", "D") or bool(getattr(form, name).any())


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
