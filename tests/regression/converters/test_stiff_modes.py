"""One mode with time constants up to twelve decades apart, against sixty-digit arithmetic."""

from __future__ import annotations

from decimal import Decimal, localcontext

import pytest

import nsspice

Rows = list[list[Decimal]]
TIMES = ("1e-12", "1e-9", "1e-6", "1e-3", "0.1", "1", "10")


def times(a: Rows, b: Rows) -> Rows:
    """Return the product of two matrices."""
    columns = list(zip(*b, strict=True))
    return [
        [sum((x * y for x, y in zip(r, c, strict=True)), Decimal(0)) for c in columns] for r in a
    ]


def exponential(a: Rows, t: Decimal) -> Rows:
    """Return ``exp(a t)`` by scaling and squaring; each squaring loses a factor of 2."""
    n = len(a)
    size = max(sum(abs(v) for v in row) for row in a) * t
    halvings = 0
    while size > Decimal("0.01"):
        size /= 2
        halvings += 1
    scaled = [[v * t / 2**halvings for v in row] for row in a]
    out = [[Decimal(int(i == j)) for j in range(n)] for i in range(n)]
    term = [row[:] for row in out]
    for k in range(1, 26):
        term = [[v / k for v in row] for row in times(term, scaled)]
        out = [[x + y for x, y in zip(r, s, strict=True)] for r, s in zip(out, term, strict=True)]
    for _ in range(halvings):
        out = times(out, out)
    return out


def sizes(count: int, decades: int) -> list[str]:
    """Return element values spread evenly over so many decades up to 1."""
    return [f"{10.0 ** (-decades * (1 - k / (count - 1))):.6e}" for k in range(count)]


def rc(count: int, decades: int) -> tuple[str, Rows, list[int]]:
    """Return a ladder of 1 Ohm and C behind 1 V; equations of [states; 1]; the output states."""
    values = sizes(count, decades)
    lines = ["ladder", "V1 n0 0 1"]
    a = [[Decimal(0)] * (count + 1) for _ in range(count + 1)]
    for k, value in enumerate(values):
        lines += [f"R{k + 1} n{k} n{k + 1} 1", f"C{k + 1} n{k + 1} 0 {value} IC=0"]
        rate = 1 / Decimal(value)
        a[k][k] = -2 * rate if k + 1 < count else -rate
        a[k][k - 1 if k else count] = rate
        if k + 1 < count:
            a[k][k + 1] = rate
    return "\n".join(lines) + "\n", a, list(range(count))


def rlc(count: int, decades: int) -> tuple[str, Rows, list[int]]:
    """Return a ladder of 1 Ohm and L in series, C to ground."""
    values = sizes(count, decades)
    lines = ["ladder", "V1 n0 0 1"]
    n = 2 * count
    a = [[Decimal(0)] * (n + 1) for _ in range(n + 1)]
    for k, value in enumerate(values):
        lines += [
            f"R{k + 1} n{k} m{k + 1} 1", f"L{k + 1} m{k + 1} n{k + 1} {value} IC=0",
            f"C{k + 1} n{k + 1} 0 {value} IC=0",
        ]  # fmt: skip
        rate, i, u = 1 / Decimal(value), 2 * k, 2 * k + 1
        a[i][i] = a[i][u] = -rate
        a[i][u - 2 if k else n] = rate
        a[u][i] = rate
        if k + 1 < count:
            a[u][i + 2] = -rate
    return "\n".join(lines) + "\n", a, list(range(1, n, 2))


@pytest.mark.parametrize("decades", [6, 9, 12])
@pytest.mark.parametrize(("ladder", "count"), [(rc, 4), (rc, 7), (rlc, 4), (rlc, 7)])
def test_a_mode_of_many_decades(ladder, count, decades):
    assert worst(*ladder(count, decades)) < 1e-9


@pytest.mark.parametrize("decades", [6, 9, 12])
def test_a_double_rate_beside_a_fast_one(decades):
    """The slow stage is damped critically: without a basis of eigenvectors it forms a block."""
    assert worst(*rlc(2, decades)) < 1e-13


def test_windings_that_meet_in_a_node_on_a_large_resistance():
    """A swing of two windings through a capacitor, whose node hangs on 100 GOhm.

    Their currents differ by what flows there, with a rate of 6e16/s. In coordinates that have it in
    both rows, what is slow is rounded to 1e-16 of that: the swing was off by 30 nV after 1 ms.
    """
    l1, l2, c, r = (Decimal(v) for v in ("22e-6", "33e-6", "4.7e-6", "1e11"))
    m = Decimal("0.9") * (l1 * l2).sqrt()
    det = l1 * l2 - m * m
    zero, one = Decimal(0), Decimal(1)
    # -va = L1 i1' + M i2', va - v = L2 i2' + M i1' with va = R (i1 - i2), C v' = i2
    rates = [
        [-(l2 + m) * r / det, (l2 + m) * r / det, m / det],
        [(l1 + m) * r / det, -(l1 + m) * r / det, -l1 / det],
        [zero, one / c, zero],
    ]
    deck = """windings
L1 0 a 22u IC=0
L2 b 0 33u IC=0
K1 L1 L2 0.9
C1 a b 4.7u IC=10
R1 a 0 1e11
"""
    circuit = nsspice.read(deck)
    for at in ("1e-5", "1e-3", "0.1"):
        with localcontext() as context:
            context.prec = 60
            exact = float(10 * exponential(rates, Decimal(at))[2][2])
        stop = float(at)
        sol = nsspice.tran(circuit, stop=stop, row_step=stop, uic=True, method="modewise")
        # 4500 radians at 0.1 s, rounded each to 1e-16 or so; the loss itself is 4e-7 of 10 V
        assert abs(sol["v(a)"][-1] - sol["v(b)"][-1] - exact) < 1e-11 * 10.0
        assert sol.certificate.passed


def worst(text: str, equations: Rows, outputs: list[int]) -> float:
    """Return the largest error of the node voltages at the ends of seven runs."""
    circuit = nsspice.read(text)
    error = 0.0
    for at in TIMES:
        with localcontext() as context:
            context.prec = 60
            exact = [row[-1] for row in exponential(equations, Decimal(at))]
        stop = float(at)
        sol = nsspice.tran(circuit, stop=stop, row_step=stop, uic=True, method="modewise")
        assert sol.stats["fixed_steps"] == 0
        for k, state in enumerate(outputs):
            error = max(error, abs(sol[f"v(n{k + 1})"][-1] - float(exact[state])))
    return error
