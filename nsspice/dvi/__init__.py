"""Differential variational inequalities and their relatives, written as equations.

Expressions of unknowns, states, multipliers and time are compiled by the same compiler as in
netlists: derivatives are exact, and the compiled circuit engines solve the problems.
``docs/how-to/equations.md`` is the introduction, ``docs/gallery/dvi`` has an example of each kind.

Read ``variables`` and ``conditions`` (what a model consists of), ``assembly`` (from equations to
arrays), then ``dvi`` and ``vi``.  Imports ``analyses`` and everything below it.

Examples
--------
>>> from nsspice import dvi
>>> x, v = dvi.states("x", "v")
>>> n = dvi.multiplier("n")
>>> ball = dvi.DVI({x: v, v: n - 9.81}, [dvi.contact(n, gap=x)], start={x: 6, v: 1})
>>> sol = ball.run(3.0)
>>> bool(abs(sol.impulses[0].value - (1 + 2 * 9.81 * 6) ** 0.5) < 1e-12)
True
"""

from .circuits import from_circuit
from .conditions import complementarity, contact, equation
from .dlcp import DLCP, DNCP
from .dmvi import DMVI
from .dvi import DVI
from .errors import RegularityLost
from .expression import (
    Expr,
    asinh,
    atan,
    cos,
    cosh,
    exp,
    log,
    maximum,
    minimum,
    sin,
    sinh,
    sqrt,
    t,
    tan,
    tanh,
)
from .functions import FunctionDVI
from .lcp import LCP, MLCP
from .point import Point
from .sets import Box, Cone, Polyhedron, SecondOrderCone
from .setvalued import Sgn
from .variables import multiplier, states, unknowns
from .vi import GE, NCP, VI

__all__ = [
    "DLCP",
    "DMVI",
    "DNCP",
    "DVI",
    "GE",
    "LCP",
    "MLCP",
    "NCP",
    "VI",
    "Box",
    "Cone",
    "Expr",
    "FunctionDVI",
    "Point",
    "Polyhedron",
    "RegularityLost",
    "SecondOrderCone",
    "Sgn",
    "asinh",
    "atan",
    "complementarity",
    "contact",
    "cos",
    "cosh",
    "equation",
    "exp",
    "from_circuit",
    "log",
    "maximum",
    "minimum",
    "multiplier",
    "sin",
    "sinh",
    "sqrt",
    "states",
    "t",
    "tan",
    "tanh",
    "unknowns",
]
