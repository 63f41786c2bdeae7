"""Random problems with verdicts, and attempts to refute these: used by the fuzz of verdicts.

Each maker returns what was claimed falsely, as text, or nothing.  What refutes a claim is plain:
complementary modes one by one, solutions from many starts put into the problem, differences of two
points, signs on a grid.
"""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
from scipy.optimize import linprog

import nsspice
from nsspice.dvi import (
    DVI,
    GE,
    LCP,
    VI,
    Box,
    Polyhedron,
    Sgn,
    atan,
    complementarity,
    exp,
    log,
    maximum,
    multiplier,
    sin,
    sqrt,
    states,
    t,
    tan,
    unknowns,
)

U = unknowns("u")


def whole(random, low, high, shape):
    """Return whole numbers, in some draws scaled by powers of ten or nearly singular."""
    M = random.integers(low, high + 1, shape).astype(float)
    kind = random.integers(0, 6)
    if kind == 0:
        M = M * 10.0 ** random.integers(-10, 11, shape)
    elif kind == 1:
        M = M + 2.0**-50 * random.integers(-1, 2, shape)
    return M


def lcp(random):
    """Existence and uniqueness of an LCP, P, monotone, against all modes."""
    m = int(random.integers(1, 4))
    M, q = whole(random, -2, 2, (m, m)), whole(random, -2, 2, m)
    problem, wrong = LCP(M, q), []
    found = problem.verdict()
    truth = _solvable(M, q)
    if found["existence"].holds not in (None, truth):
        wrong.append(f"existence {found['existence']} of M = {M.tolist()}, q = {q.tolist()}")
    minors = [
        _minor(M, rows) for k in range(1, m + 1) for rows in itertools.combinations(range(m), k)
    ]
    for statement in ("P", "uniqueness"):  # the same: one solution for every q
        if found[statement].holds not in (None, min(minors) > 0):
            wrong.append(f"{statement} {found[statement]} of {M.tolist()}")
    if found["P0"].holds not in (None, min(minors) >= 0):
        wrong.append(f"P0 {found['P0']} of {M.tolist()}")
    for _ in range(20):
        x = random.standard_normal(m)
        if found["monotone"] and x @ M @ x < -1e-12 * (np.abs(x) @ np.abs(M) @ np.abs(x)):
            wrong.append(f"monotone of {M.tolist()}")
    return wrong


def _minor(M, rows):
    """Return a principal minor in rational arithmetic, by Leibniz's sum over permutations."""
    total = Fraction(0)
    for order in itertools.permutations(range(len(rows))):
        swaps = sum(a > b for a, b in itertools.combinations(order, 2))
        product = Fraction((-1) ** swaps)
        for i, j in enumerate(order):
            product *= Fraction(float(M[rows[i], rows[j]]))
        total += product
    return total


def _solvable(M, q):
    """Return whether some mode of an LCP has a solution, in rational arithmetic by elimination."""
    m = len(q)
    for on in itertools.product((False, True), repeat=m):
        rows = np.flatnonzero(on)
        A = [[Fraction(float(M[i, j])) for j in rows] for i in range(m)]
        b = [-Fraction(float(x)) for x in q]
        # u >= 0 on rows with (A u)_i = b_i there, (A u)_i >= b_i elsewhere: vertices one by one
        cuts = [(A[i], b[i], True) for i in rows]
        cuts += [(A[i], b[i], False) for i in range(m) if not on[i]]
        unit = np.eye(len(rows), dtype=int).tolist()
        cuts += [([Fraction(x) for x in row], Fraction(0), False) for row in unit]
        if _has_vertex(cuts, len(rows)):
            return True
    return False


def _has_vertex(cuts, n):
    """Return whether a polyhedron within the positive orthant, so with vertices, is not empty."""
    if n == 0:
        return all(b == 0 if equal else b <= 0 for _, b, equal in cuts)
    for chosen in itertools.combinations(range(len(cuts)), n):
        x = _solved([cuts[k][0] for k in chosen], [cuts[k][1] for k in chosen])
        if x is None:
            continue
        values = [sum(a * v for a, v in zip(row, x, strict=True)) - b for row, b, _ in cuts]
        if all(v == 0 if cut[2] else v >= 0 for v, cut in zip(values, cuts, strict=True)):
            return True
    return False


def _solved(A, b):
    A, b, n = [list(row) for row in A], list(b), len(b)
    for k in range(n):
        place = next((i for i in range(k, n) if A[i][k]), None)
        if place is None:
            return None
        A[k], A[place], b[k], b[place] = A[place], A[k], b[place], b[k]
        for i in range(n):
            if i != k and A[i][k]:
                f = A[i][k] / A[k][k]
                A[i] = [x - f * y for x, y in zip(A[i], A[k], strict=True)]
                b[i] -= f * b[k]
    return [b[k] / A[k][k] for k in range(n)]


def _term(random, x):
    """Return a function of one unknown."""
    c = float(random.integers(-3, 4)) or 1.0
    s = float(random.integers(-2, 3))
    choices = (
        lambda: c * x + s,
        lambda: c * abs(x - s),
        lambda: c * maximum(x, s * x),
        lambda: c * atan(x) + s,
        lambda: c / (x - s),
        lambda: c * log(x + 2.0),
        lambda: c * sqrt(x + s + 1.0),
        lambda: c * exp(x) - 1.0,
        lambda: c * sin(x) + x,
        lambda: c * tan(x),
        lambda: x**3 + c * x,
    )
    return choices[int(random.integers(0, len(choices)))]()


def scalar(random):
    """A VI or GE of one unknown on an interval: signs of g on a grid count its solutions."""
    g = _term(random, U) + float(random.integers(0, 3)) * U
    if random.integers(0, 2):
        g = g + _term(random, U)
    low, high = ((-1.0, 1.0), (-2.0, 3.0), (0.0, 4.0), (0.5, 1.5))[int(random.integers(0, 4))]
    problem = VI(g, {U: Box(low, high)}, of=U)
    found = problem.verdict()
    value = problem.function()

    def at(x):
        try:
            return float(value(np.array([x]))[0])
        except (ArithmeticError, ValueError, nsspice.errors.NsspiceError):
            return np.nan

    grid = np.linspace(low, high, 4001) + 1e-9
    grid[-1] = high
    with np.errstate(all="ignore"):
        g_of = np.array([at(x) for x in grid])
    rises = np.isfinite(g_of[1:]) & np.isfinite(g_of[:-1])
    size = np.nanmax(np.abs(g_of)) if np.any(np.isfinite(g_of)) else 0.0
    steep = np.abs(np.diff(g_of)) > 0.5 * size  # a pole between two points
    crossings = int(np.sum(rises & ~steep & (g_of[1:] * g_of[:-1] < 0.0)))
    ends = int(g_of[0] > 1e-6) + int(g_of[-1] < -1e-6)
    return _refuted(problem, found, crossings + ends, g, grid, g_of)


def _refuted(problem, found, count, g, grid, g_of):
    wrong = []
    if found["uniqueness"] and count > 1:
        wrong.append(f"uniqueness of {g} in {problem.within}: {count} solutions")
    if found["existence"] and count == 0 and np.nanmin(np.abs(g_of)) > 1e-3:
        wrong.append(f"existence of {g} in {problem.within}")
    finite = np.isfinite(g_of)
    if found["monotone"] and (not finite.all() or np.any(np.diff(g_of) < -1e-9)):
        wrong.append(f"{g} is called monotone on {grid[0]:.3g}, {grid[-1]:.3g}")
    return wrong


def regular(random):
    """`.regularity` of a GE in one unknown: solutions for data beside those of the problem."""
    a, b, c = (float(x) for x in random.integers(-3, 4, 3))
    g = a * U + b * abs(U) + c * maximum(U, 0.5 * U)
    sign = bool(random.integers(0, 2))
    problem = GE(g + Sgn(U), of=U) if sign else VI(g, of=U)
    try:
        strong = problem.solve(start=0.0).regularity.strong
    except nsspice.errors.NumericalError:
        return []
    if sign:
        return [] if strong in (True, None) else [f"{g} + Sgn at 0: inside the vertical piece"]
    slopes = a - b + 0.5 * c, a + b + c
    truth = slopes[0] * slopes[1] > 0.0
    return [] if strong in (truth, None) else [f"regularity of {g}: {strong}"]


def polyhedron(random):
    """Existence over a polyhedron: none if a linear program says that it is empty."""
    n, k = int(random.integers(1, 4)), int(random.integers(1, 6))
    C, d = random.integers(-2, 3, (k, n)).astype(float), random.integers(-3, 3, k).astype(float)
    u = unknowns("v", n)
    found = VI(u - 1.0 * np.ones(n), {u: Polyhedron(C, d)}).verdict()
    got = linprog(np.zeros(n), A_ub=C, b_ub=d, bounds=(None, None))
    if got.status not in (0, 2):
        return []
    truth = got.status == 0
    right = found["existence"].holds in (None, truth)
    return [] if right else [f"existence over C = {C.tolist()}, d = {d.tolist()}"]


def trajectory(random):
    """A DVI with u from an LCP: a claim of one trajectory needs one u at each state."""
    x, u = states("x"), multiplier("u")
    b, c, d = (float(v) for v in random.integers(-2, 3, 3))
    load = (0.0 * t, 1.0 / (2.0 - t), tan(t), sin(t), sqrt(t + 1.0))[int(random.integers(0, 5))]
    pole = "/" in str(load) or "tan" in str(load)
    problem = DVI({x: -x + b * u + load}, [complementarity(u, c * x + d * u + 1.0)], start={x: 1.0})
    found, wrong = problem.verdict(), []
    for statement in ("existence", "uniqueness"):
        if found[statement] and pole and statement == "existence":
            wrong.append(f"{statement} for all times with {load}")
    # d < 0 gives two u where the slack is positive, d = 0 > c x + 1 none
    if found["existence"] and not pole and d < 0.0 and c != 0.0 and b == 0.0:
        wrong.append(f"existence with d = {d}, c = {c}: none where c x + 1 < 0")
    if found["Theorem 2.2.1"]:
        for state in (-3.0, -1.0, 0.0, 2.0):
            if len(LCP([[d]], [c * state + 1.0]).solutions()) != 1:
                wrong.append(f"u(t, x) with d = {d}, c = {c}")
    return wrong


def circuit(random):
    """A static circuit of resistors, ideal diodes and switches: its modes one by one."""
    nodes = int(random.integers(2, 5))
    lines = ["random", "V1 n0 0 1"]
    for k in range(1, nodes):
        lines.append(f"R{k} n{int(random.integers(0, k))} n{k} 1k")
    for count in range(int(random.integers(1, 4))):
        a, b = random.permutation(nodes + 1)[:2]
        one, other = (f"n{k}" if k < nodes else "0" for k in (a, b))
        kind = int(random.integers(0, 4))
        if kind == 0:
            lines.append(f"D{count} {one} {other} DI")
        elif kind == 1:
            lines.append(f"D{count} {one} {other} DR")
        else:
            gate = f"n{int(random.integers(0, nodes))}"
            lines.append(f"S{count} {one} {other} {gate} 0 {'SW' if kind == 2 else 'SH'}")
    models = [
        ".model DI D(ideal)",
        ".model DR D(Ron=10 Vfwd=0.3)",
        ".model SW SW(vt=0.4 vh=0 ron=10 roff=1meg)",
        ".model SH SW(vt=0.4 vh=0.1 ron=10 roff=1meg)",
    ]
    deck = "\n".join([*lines, *models, ".op", ""])
    try:
        (solution,) = nsspice.read(deck).run()
    except (nsspice.errors.NumericalError, nsspice.errors.NsspiceError):
        return []
    verdict = solution.islands[0].regularity
    if verdict is None:
        return []
    found = _operating_points(nsspice.read(deck))
    if verdict.kind == "unique" and len(found) > 1:
        return [f"unique, but {len(found)} operating points of\n{deck}"]
    return []


def _operating_points(circuit):
    """Return the distinct node voltages of all combinations of states, from the arrays alone."""
    mna = circuit.islands[0].assemble(analysis="dc")
    system = mna.system
    G, A, B, D = (x.dense() for x in (system.G, system.A, system.B, system.D))
    values = np.array([w.values[0] * w.scale for w in system.waveforms])
    right, found = system.S.dense() @ values, []
    switches = {s.pair: s for s in system.switches}
    for on in itertools.product((False, True), repeat=system.m):
        active = np.flatnonzero(on)
        J = np.block([[G, A[:, active]], [B[active], -D[np.ix_(active, active)]]])
        if np.linalg.cond(J) > 1e12:
            continue
        z = np.linalg.solve(J, np.concatenate([right, system.q[active]]))
        lam = np.zeros(system.m)
        lam[active], z = z[system.n :], z[: system.n]
        w = system.q - B @ z + D @ lam
        good = True
        for k in range(system.m):
            if k not in switches:
                good = good and (lam[k] > 1e-12 if on[k] else w[k] > 1e-9)
                continue
            s = switches[k]
            control = sum(f * z[j] for j, f in s.control)
            above = on[k] is not s.inverted
            good = good and (control > s.off_below + 1e-9 if above else control < s.on_above - 1e-9)
        if good and not any(np.allclose(z, other, atol=1e-6) for other in found):
            found.append(z)
    return found


MAKERS = (lcp, scalar, regular, polyhedron, trajectory, circuit)


def false_verdicts(seed: int) -> list[str]:
    """Return what is claimed falsely of one random problem; kinds take turns."""
    random = np.random.default_rng([62, seed])
    return MAKERS[seed % len(MAKERS)](random)


__all__ = ["MAKERS", "false_verdicts"]
