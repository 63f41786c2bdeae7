"""Which switches act upon their own control: the order in which unknowns follow from each other.

Each unknown is matched with an equation of its own, and depends on what else appears there; the
multiplier of a pair with the equation of its slack, in which that of a switch also has what
controls it.  If a switch cannot be reached from its own control, the control is decided apart from
the switch, and so is its state.  Patterns alone are looked at, no values.

Reference: A. L. Dulmage, N. S. Mendelsohn, *Coverings of bipartite graphs*, Canad. J. Math. 10
(1958).
"""

from __future__ import annotations

from .descriptor import DescriptorSystem
from .tape import OPS, Tape

_NAMES = list(OPS)


def undecided_switches(system: DescriptorSystem) -> dict[int, str]:
    """Return the pairs of switches whose state the rest does not decide, each with the reason.

    Parameters
    ----------
    system : DescriptorSystem
        Stored quantities count as unknowns of the instant, as in an implicit step.

    Examples
    --------
    A switch from 1 V to a load, which closes above 0.5 V of that load:

    >>> import numpy as np
    >>> from nsspice.problems import Csc
    >>> from nsspice.problems.descriptor import Switch
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> latch = DescriptorSystem(none((1, 1)), one, one, one, one, np.ones(1), none((1, 0)),
    ...     switches=(Switch(0, ((0, 1.0),), 0.5, 0.5),))
    >>> undecided_switches(latch)
    {0: 'it acts upon its own control'}
    """
    if not system.switches:
        return {}
    found: dict[int, str] = {}
    rows = _patterns(system)
    owner = _matching(rows)
    for switch in system.switches:
        if switch.latching:
            found[switch.pair] = "a thyristor stays as it was"
        elif switch.off_below < switch.on_above:
            found[switch.pair] = "between its thresholds a switch stays as it was"
        elif owner is None:
            found[switch.pair] = "something is left free in every mode"
        elif system.n + switch.pair in _reached(rows, owner, [j for j, _ in switch.control]):
            found[switch.pair] = "it acts upon its own control"
    return found


def _patterns(system: DescriptorSystem) -> list[set[int]]:
    """Return the unknowns in each equation: z, then the multipliers of pairs."""
    n, m = system.n, system.m
    rows: list[set[int]] = [set() for _ in range(n + m)]
    for matrix, down, across in (
        (system.G, 0, 0),
        (system.E, 0, 0),
        (system.A, 0, n),
        (system.B, n, 0),
        (system.D, n, n),
    ):
        for row, column in zip(matrix.indices.tolist(), matrix.columns.tolist(), strict=True):
            rows[down + row].add(across + column)
    smooth = system.smooth
    if smooth is not None:
        inputs = [_inputs(smooth.tape, r) for r in smooth.tape.outputs.tolist()]
        for matrix in (smooth.F, smooth.Q):
            for row, column in zip(matrix.indices.tolist(), matrix.columns.tolist(), strict=True):
                rows[row] |= inputs[column]
    for k in range(m):
        rows[n + k].add(n + k)  # where a pair blocks its multiplier is zero
    for switch in system.switches:
        rows[n + switch.pair] |= {j for j, _ in switch.control}
    return rows


def _inputs(tape: Tape, register: int) -> set[int]:
    """Return the unknowns that a register depends on."""
    found, seen, waiting = set(), set(), [register]
    while waiting:
        r = waiting.pop()
        if r in seen:
            continue
        seen.add(r)
        name = _NAMES[int(tape.ops[r])]
        if name == "unknown":
            found.add(int(tape.args[r, 0]))
        waiting += tape.args[r].tolist()[: OPS[name]]
    return found


def _matching(rows: list[set[int]]) -> list[int] | None:
    """Return an equation for each unknown, None where there are not enough of them."""
    owner = [-1] * len(rows)
    for start in range(len(rows)):
        # a path of alternating equations and unknowns, breadth first
        before: dict[int, int] = {}
        waiting, free = [start], -1
        while waiting and free < 0:
            row = waiting.pop(0)
            for column in rows[row]:
                if column in before:
                    continue
                before[column] = row
                if owner[column] < 0:
                    free = column
                    break
                waiting.append(owner[column])
        if free < 0:
            return None
        while True:
            row = before[free]
            previous = next((c for c, r in enumerate(owner) if r == row), -1)
            owner[free] = row
            if row == start:
                break
            free = previous
    return owner


def _reached(rows: list[set[int]], owner: list[int], unknowns: list[int]) -> set[int]:
    """Return what some unknowns depend on, themselves among it."""
    found: set[int] = set()
    waiting = list(unknowns)
    while waiting:
        column = waiting.pop()
        if column not in found:
            found.add(column)
            waiting += rows[owner[column]]
    return found


__all__ = ["undecided_switches"]
