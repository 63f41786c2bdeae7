"""A tree as a linear part in variables, the time and sines of it, plus smooth nonlinear terms."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...devices.behaviour import linear_form
from ...netlist.expressions.node import Node, add, mul, num


@dataclass(slots=True)
class Split:
    """``constant + sum factors[name] * name + sum weight * tree``.

    Parameters
    ----------
    constant : float
    factors : dict of str to float
        By variable; ``time`` and ``sin(rate,phase)`` are such signals of the time.
    smooth : list of (float, Node)
        What is not linear, with its weights.

    Examples
    --------
    >>> from nsspice.dvi import sin, states, t
    >>> x, v = states("x", "v")
    >>> found = Split.of((-(2.0*x + x**3)/4.0 + 3.0*sin(2.0*t)).node)
    >>> found.factors, found.smooth[0][0]
    ({'x': -0.5, 'sin(2.0,0.0)': 3.0}, -0.25)
    """

    constant: float = 0.0
    factors: dict[str, float] = field(default_factory=dict)
    smooth: list[tuple[float, Node]] = field(default_factory=list)

    @classmethod
    def of(cls, node: Node) -> Split:
        """Return the parts of a tree."""
        out = cls()
        out._take(node, 1.0)
        out.factors = {name: value for name, value in out.factors.items() if value != 0.0}
        return out

    @property
    def tree(self) -> Node | None:
        """The nonlinear part as one tree, None without any."""
        terms = [mul((num(w), n)) if w != 1.0 else n for w, n in self.smooth]
        return add(terms) if terms else None

    def _take(self, node: Node, weight: float) -> None:
        if node.op == "add":
            for arg in node.args:
                self._take(arg, weight)
            return
        if node.op == "neg":
            self._take(node.args[0], -weight)
            return
        form = linear_form(node, timed=True)
        if form is not None:
            self.constant += weight * form[0]
            for name, value in form[1].items():
                self.factors[name] = self.factors.get(name, 0.0) + weight * value
            return
        if node.op == "mul":
            # constants before, or below, one sum of linear and other terms
            forms = [linear_form(arg, timed=True) for arg in node.args]
            varying = [k for k, f in enumerate(forms) if f is None or f[1]]
            if len(varying) == 1 and node.args[varying[0]].op in ("add", "neg", "mul"):
                for k, f in enumerate(forms):
                    if k != varying[0] and f is not None:
                        weight *= f[0]
                self._take(node.args[varying[0]], weight)
                return
        self.smooth.append((weight, node))
