"""Which net is drawn above which: rails at the top, ground at the bottom, midpoints between."""

from __future__ import annotations

from collections.abc import Sequence

from .parts import GROUND, VALVES, Part

#: what decides first where two elements disagree
_ORDER = "vdmqjzswi"


class Order:
    """Nets in groups of one level, and which group is above which."""

    def __init__(self, parts: Sequence[Part]) -> None:
        nets = dict.fromkeys(n for p in parts for n in (p.low, p.high))
        self.home = {net: net for net in nets}
        self.above: dict[str, set[str]] = {net: set() for net in nets}
        ranked = sorted(
            (p for p in parts if p.directed),
            key=lambda p: _ORDER.find(p.letter) if p.letter in _ORDER else len(_ORDER),
        )
        for part in ranked:
            if not self.put_above(part.high, part.low):
                part.turn()
                self.put_above(part.high, part.low)
        for letter in "lrc":
            for part in parts:
                if part.level and part.letter == letter:
                    part.level = self.join(part.high, part.low)
        # what has no direction of its own, such as loads and capacitors between rails
        for part in parts:
            if not part.directed and not part.level and not self.put_above(part.high, part.low):
                part.turn()
                self.put_above(part.high, part.low)

    def group(self, net: str) -> str:
        """Return the net that stands for all nets of its level."""
        while self.home[net] != net:
            net = self.home[net]
        return net

    def reaches(self, low: str, high: str) -> bool:
        """Return whether a group is above another one, by way of others."""
        seen, todo = set(), [low]
        while todo:
            net = todo.pop()
            if net == high:
                return True
            if net not in seen:
                seen.add(net)
                todo += [self.group(n) for n in self.above[net]]
        return False

    def put_above(self, high: str, low: str) -> bool:
        """Note that a net is above another one, False where that contradicts what is known."""
        high, low = self.group(high), self.group(low)
        if high == low or self.reaches(high, low):
            return False
        self.above[low].add(high)
        return True

    def join(self, one: str, other: str) -> bool:
        """Put two nets on one level, False if one is above the other."""
        one, other = self.group(one), self.group(other)
        if one == other:
            return True
        if self.reaches(one, other) or self.reaches(other, one):
            return False
        self.home[other] = one
        self.above[one] |= self.above.pop(other)
        return True

    def levels(self) -> dict[str, int]:
        """Return the level of each net, counted from the bottom."""
        found: dict[str, int] = {}

        def depth(group: str) -> int:
            if group not in found:
                below = [g for g, ups in self.above.items() if group in map(self.group, ups)]
                found[group] = 1 + max(map(depth, below), default=-1)
            return found[group]

        return {net: depth(self.group(net)) for net in self.home}


def columns_of(parts: Sequence[Part], levels: dict[str, int]) -> list[list[Part]]:
    """Return parts that share a column, the highest first: legs of valves, windings and switches.

    Each other part has a column for itself.
    """
    falls = {part: levels[part.high] > levels[part.low] for part in parts}
    below: dict[Part, Part] = {}
    taken: set[Part] = set()
    for match in (_both_valves, _both_capacitors, _winding_and_valve):
        for upper in parts:
            if upper in below or not falls[upper] or upper.low == GROUND:
                continue
            for lower in parts:
                fits = lower is not upper and lower not in taken and falls[lower]
                if fits and lower.high == upper.low and match(upper, lower):
                    below[upper] = lower
                    taken.add(lower)
                    break
    stacks = []
    for part in parts:
        if part not in taken:
            stack = [part]
            while stack[-1] in below:
                stack.append(below[stack[-1]])
            stacks.append(stack)
    return stacks


def _both_valves(a: Part, b: Part) -> bool:
    return a.letter == b.letter and a.letter in VALVES


def _both_capacitors(a: Part, b: Part) -> bool:
    return a.letter == b.letter == "c"


def _winding_and_valve(a: Part, b: Part) -> bool:
    valve = {a.letter, b.letter} <= VALVES
    return valve or (bool(a.coupled) and b.letter in VALVES)
