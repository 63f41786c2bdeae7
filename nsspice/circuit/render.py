"""Small text helpers: lists of names that do not flood the terminal, labelled matrices."""

from __future__ import annotations

from collections.abc import Sequence

from ..problems.csc import Floats


def label_list(names: Sequence[str], most: int = 8) -> str:
    """Return names separated by commas, the rest counted.

    Examples
    --------
    >>> label_list(["a", "b", "c", "d"], 3)
    'a, b and 2 more'
    """
    if len(names) <= most:
        return ", ".join(names)
    return f"{', '.join(names[: most - 1])} and {len(names) - most + 1} more"


def labelled_matrix(
    name: str, rows: Sequence[str], columns: Sequence[str], matrix: Floats
) -> list[str]:
    r"""Return the lines of a matrix with its row and column labels.

    Examples
    --------
    >>> import numpy as np
    >>> print("\n".join(labelled_matrix("A", ["x"], ["x", "y"], np.array([[0.5, -1.0]]))))
    A    x   y
    x  0.5  -1
    """
    head = [name, *columns]
    body = [
        [label, *(f"{value:.6g}" if value else "0" for value in values)]
        for label, values in zip(rows, matrix.tolist(), strict=True)
    ]
    table = [head, *body]
    widths = [max(len(row[j]) for row in table) for j in range(len(head))]
    return [
        "  ".join(
            cell.rjust(width) if j else cell.ljust(width)
            for j, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in table
    ]
