"""Pairs that act along one direction: parallel and antiparallel ideal elements.

Ideal pairs (without series resistance) along one combination x of unknowns bound x from above or
from below.  The tightest bound of each side is the only one that ever conducts.  Both sides
together are one monotone curve, which determines the total current; the current of each element is
determined too, unless two of them bind at the same x: two ideal diodes in parallel, or an ideal
switch with a diode across it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .descriptor import DescriptorSystem

_DIGITS = 12  # of directions that count as one
_SAME = 8.0 * 2.0**-53  # thresholds that differ by the rounding of two products are one


@dataclass(frozen=True, slots=True)
class Parallels:
    """What is left of the pairs of a system when each direction has one.

    Parameters
    ----------
    kept : list of int
        One pair of each direction, and all others.
    merged : dict of int to tuple of int
        What a kept pair stands for besides itself.
    shared : tuple of int
        Two pairs that may share a current in any way; empty if no two do.
    """

    kept: list[int]
    merged: dict[int, tuple[int, ...]] = field(default_factory=dict)
    shared: tuple[int, ...] = ()


def parallels(system: DescriptorSystem) -> Parallels:
    """Group the pairs of a system by their directions.

    Examples
    --------
    The two sides of a sign are one curve:

    >>> from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    >>> tape = TapeBuilder()
    >>> _ = tape.output(tape.unknown(0))
    >>> parallels(GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),)).system())
    Parallels(kept=[0], merged={0: (1,)}, shared=())
    """
    A, B, D = system.A.dense(), system.B.dense(), system.D.dense()
    groups: dict[tuple[float, ...], list[tuple[int, float]]] = {}
    kept: list[int] = []
    for k in range(system.m):
        joined = np.concatenate([A[:, k], B[k]])
        if not B[k].any() or D[k].any() or D[:, k].any():
            kept.append(k)
            continue
        first = float(joined[np.flatnonzero(joined)[0]])
        groups.setdefault(tuple(np.round(joined / first, _DIGITS) + 0.0), []).append((k, first))
    merged: dict[int, tuple[int, ...]] = {}
    shared: tuple[int, ...] = ()
    switched = set(system.switched)
    for group in groups.values():
        switches = [k for k, _ in group if k in switched]
        # x is at most the bound of a positive side, at least minus that of a negative one
        bounds = sorted(
            (float(system.q[k]) / abs(f), k, f > 0.0) for k, f in group if k not in switched
        )
        sides = [[(bound, k) for bound, k, up in bounds if up is side] for side in (True, False)]
        tight = [side[0][1] for side in sides if side]
        kept += [*switches, *tight[:1]]
        rest = tuple(k for _, k, _ in bounds if k not in tight[:1])
        if rest:
            merged[tight[0]] = rest
        shared = shared or _sharing(sides, switches, tight)
    return Parallels(sorted(kept), merged, shared)


def _sharing(
    sides: list[list[tuple[float, int]]], switches: list[int], tight: list[int]
) -> tuple[int, ...]:
    """Return two pairs of one direction that conduct at the same x."""
    for side in sides:
        if len(side) > 1 and _close(side[0][0], side[1][0]):
            return side[0][1], side[1][1]
    if all(sides) and _close(sides[0][0][0], -sides[1][0][0]):
        return sides[0][0][1], sides[1][0][1]
    if len(switches) > 1:
        return switches[0], switches[1]
    if switches and tight:
        return switches[0], tight[0]
    return ()


def _close(a: float, b: float) -> bool:
    return abs(a - b) <= _SAME * max(abs(a), abs(b))
