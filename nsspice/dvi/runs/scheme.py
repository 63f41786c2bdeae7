r"""The time-stepping schemes of the thesis, step by step as they are written there.

With theta the weight of the new state (the thesis writes ``1 - theta``), x_m the average
``theta x_1 + (1 - theta) x_0`` and h the step,

.. math::

    x_1 = x_0 + h f(t_m, x_m, u_1), \qquad u_1 \in \mathrm{SOL}(K, g(t_1, x_1, \cdot))

is (3.5), and (3.6) for a linear problem.  Variant 2 takes ``g(t_1, x_0, .)``; (3.8) takes the
coefficients of the multipliers at ``t_0, x_0``.  Each step is one generalized equation, solved by
the Josephy-Newton method, for a linear problem by one complementarity problem.

References: J.-S. Pang, D. E. Stewart, *Differential variational inequalities*, Math. Program. 113
(2008) 345-424; T. Roubal, *Non-smooth analysis in engineering and economics* (2015), section 3.3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...netlist.expressions import evaluate as _evaluate
from ...netlist.expressions.node import Node, add, mul, num, var
from ..equations.assembly import Model, Row, assemble, start_vector
from ..equations.newton import StepProblem
from ..terms.errors import wrong
from ..terms.expression import Expr, names_of

Floats = npt.NDArray[np.float64]

THETA_ON = ("states", "multipliers", "slacks")


@dataclass(frozen=True, slots=True)
class Scheme:
    """Which scheme.

    Parameters
    ----------
    theta : float
        Weight of the new state: 1 implicit, 0 explicit.
    variant : int
        1: the variational inequality holds at the new state; 2: at the old one.
    theta_on : str
        What is averaged besides the states in f: ``states`` nothing (the multiplier is implicit, as
        in the thesis), ``multipliers`` the multiplier as well, ``slacks`` the states in g as well.
    time : str
        Instant of f: ``average`` is ``t_0 + theta h``, ``new`` is t_1, as printed in the thesis.
    coefficients : str
        ``average``: coefficients of multipliers in f are taken at the averaged state, as in (3.5);
        ``old``: at ``t_0, x_0``, as in (3.8).
    """

    theta: float = 1.0
    variant: int = 1
    theta_on: str = "states"
    time: str = "average"
    coefficients: str = "average"

    def __post_init__(self) -> None:
        if not 0.0 <= self.theta <= 1.0:
            raise wrong("NS6004", f"theta cannot be {self.theta}", "a weight from 0 to 1")
        for name, value, known in (
            ("variant", self.variant, (1, 2)),
            ("theta_on", self.theta_on, THETA_ON),
            ("time", self.time, ("average", "new")),
            ("coefficients", self.coefficients, ("average", "old")),
        ):
            if value not in known:
                choices = ", ".join(map(str, known))
                raise wrong("NS6004", f"{name} cannot be {value!r}", f"choose one of {choices}")

    @property
    def plain(self) -> bool:
        """True for implicit steps of (3.5), which the compiled stepper takes."""
        return self == Scheme()

    def step_problem(self, model: Model, h: float) -> Model:
        """Return the static problem of one step of length h [s].

        Given are ``x#old`` for each state x, ``u#old`` for the others, and ``time#old``.
        """
        closed = model.close()
        states = [row.name for row in closed.rows if row.state]
        others = [row.name for row in closed.rows if not row.state]
        others += [pair.name for pair in closed.pairs if pair.multiplier]
        average = {name: self._between(name) for name in states}
        if self.theta_on == "multipliers":
            average.update({name: self._between(name) for name in others})
        if self.time == "average":
            average["time"] = self._between("time")
        old = {name: var(f"{name}#old") for name in states}
        before = {**old, "time": var("time#old")}
        within: dict[str, Node] = {}
        if self.variant == 2:
            within = old
        elif self.theta_on == "slacks":
            within = {name: self._between(name) for name in states}
        free = set(others)

        def rate(node: Node) -> Node:
            if self.coefficients == "old":
                terms = node.args if node.op == "add" else (node,)
                return add(
                    [put(term, before if names_of(term) & free else average) for term in terms]
                )
            return put(node, average)

        rows = []
        for row in closed.rows:
            if row.state:
                # 0 = x_0 + h f - x_1
                node = add(
                    (
                        var(f"{row.name}#old"),
                        mul((num(h), rate(row.right.node))),
                        mul((num(-1.0), var(row.name))),
                    )
                )
            else:
                node = put(row.right.node, within)
            rows.append(Row(row.name, Expr(node)))
        pairs = [replace(p, slack=Expr(put(p.slack.node, within))) for p in closed.pairs]
        given = tuple(f"{name}#old" for name in (*states, *others, "time"))
        return Model(rows, pairs, {}, given)

    def _between(self, name: str) -> Node:
        if self.theta == 1.0:
            return var(name)
        old = var(f"{name}#old")
        if self.theta == 0.0:
            return old
        return add((mul((num(self.theta), var(name))), mul((num(1.0 - self.theta), old))))


def put(node: Node, values: dict[str, Node]) -> Node:
    """Return a tree with variables replaced by trees."""
    if not values:
        return node
    return _evaluate.rebuild(node, lambda leaf: values.get(str(leaf.value), leaf))


@dataclass(slots=True)
class Steps:
    """The points of a run by steps of one length.

    Parameters
    ----------
    times : ndarray, shape (k,)
    values : dict of str to ndarray, shape (k,)
        By variable; of multipliers those of the step that ends there.
    residual : float
        Worst relative residual of a step problem.
    solved : int
        Linear complementarity problems in all.
    """

    times: Floats
    values: dict[str, Floats]
    residual: float
    solved: int


def march(
    model: Model,
    scheme: Scheme,
    start: dict[str, float],
    begin: float,
    stop: float,
    step: float,
    progress: Callable[[float], None] | None = None,
    near: Mapping[str, float] | None = None,
) -> Steps:
    """Run a scheme on the uniform grid of ``ceil((stop - begin) / step)`` steps.

    Parameters
    ----------
    model : Model
    scheme : Scheme
    start : dict of str to float
        The states at the beginning.
    begin, stop, step : float
        [s]
    progress : callable, optional
        Called with the fraction completed, 0 to 1.
    near : mapping of str to float, optional
        Other unknowns at the beginning, near which the first step is solved.

    Raises
    ------
    NumericalError
        NS6020 if a step has no solution.
    """
    count = max(1, int(np.ceil((stop - begin) / step * (1.0 - 1e-12))))
    h = (stop - begin) / count
    first = Scheme(scheme.theta, scheme.variant, "states", scheme.time, scheme.coefficients)
    averaged = scheme.theta_on == "multipliers"
    problem = StepProblem(assemble((first if averaged else scheme).step_problem(model, h)))
    later = StepProblem(assemble(scheme.step_problem(model, h))) if averaged else problem
    if near:
        problem.point = start_vector(problem.assembly, {**start, **near}), problem.point[1]
    names = list(problem.assembly.places)
    table = np.zeros((count + 1, len(names)))
    old = {name: start.get(name, 0.0) for name in names}
    table[0] = [old[name] for name in names]
    times: Floats = begin + h * np.arange(count + 1, dtype=np.float64)
    times[-1] = stop
    residual = 0.0
    for k in range(count):
        if k == 1:
            problem = _continued(problem, later)
        found = problem.solve(old, float(times[k]), float(times[k + 1]))
        residual = max(residual, problem.residual)
        old = found
        table[k + 1] = [found[name] for name in names]
        if progress is not None and k % 256 == 0:
            progress((k + 1) / count)
    multipliers = [name for name in names if name not in start]
    for j, name in enumerate(names):
        if name in multipliers:
            table[0, j] = table[
                1, j
            ]  # those of the first step: at the start they are not asked for
    solved = problem.solved + (0 if later is problem else later.solved)
    return Steps(times, {n: table[:, j] for j, n in enumerate(names)}, residual, solved)


def _continued(first: StepProblem, later: StepProblem) -> StepProblem:
    if first is not later:
        later.point = first.point
    return later
