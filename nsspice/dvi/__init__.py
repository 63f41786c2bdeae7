"""Differential variational inequalities and their relatives, written as equations.

Expressions of unknowns, states, multipliers and time are compiled by the same compiler as in
netlists: derivatives are exact, and the compiled circuit engines solve the problems.
``docs/how-to/equations.md`` is the introduction, ``docs/gallery/dvi`` has an example of each kind.

Rooms in the order of reading: ``terms`` (what a model consists of), ``equations`` (from equations
to arrays), ``runs`` (in time), ``models`` (what a user writes down).  Imports ``analyses`` and
everything below it.

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

from .equations.conditions import complementarity, contact, equation
from .equations.point import Point
from .models.circuits import from_circuit
from .models.dlcp import DLCP, DNCP
from .models.dmvi import DMVI
from .models.dvi import DVI
from .models.functions import FunctionDVI
from .models.lcp import LCP, MLCP
from .models.vi import GE, NCP, VI
from .terms.errors import RegularityLost
from .terms.expression import (
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
from .terms.sets import Box, Cone, Polyhedron, SecondOrderCone
from .terms.setvalued import Sgn
from .terms.variables import multiplier, states, unknowns

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
