"""Disjoint sets (union-find), for questions about the circuit graph."""

from __future__ import annotations


class UnionFind:
    """Disjoint sets of the integers 0 .. n-1.

    Examples
    --------
    >>> sets = UnionFind(3)
    >>> sets.union(0, 2), sets.union(2, 0)
    (True, False)
    >>> sets.find(0) == sets.find(2)
    True
    """

    __slots__ = ("parent",)

    def __init__(self, n: int) -> None:
        self.parent = list(range(n))

    def find(self, x: int) -> int:
        """Return the representative of x."""
        parent = self.parent
        while parent[x] != x:
            parent[x] = parent[parent[x]]  # halving the path keeps later searches short
            x = parent[x]
        return x

    def union(self, x: int, y: int) -> bool:
        """Join two sets; return False if they were one already.  The smaller number represents."""
        x, y = self.find(x), self.find(y)
        if x == y:
            return False
        if y < x:
            x, y = y, x
        self.parent[y] = x
        return True
