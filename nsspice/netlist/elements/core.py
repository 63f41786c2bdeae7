"""Inductors with hysteresis, as elements of their own: a Prandtl-Ishlinskii model.

The current is a function of the flux and a sum of *stops*: each follows the flux with the rate
``1/l`` and stays within ``-i`` and ``i``,

    i(t) = flux/L + stop_1(flux) + stop_2(flux) + ...

A stop is an inductor in series with two limiters of its current, each of which is a current source
and an ideal diode: all is passive and reciprocal, and loops are exact.

    a --- 0 V --- inductor --------------------------------- b
               |- inductor 1 -- limiter +i -- limiter -i -- -|

References: A. Visintin, Differential Models of Hysteresis (Springer, 1994), chapter III; J. H. Chan
and others, "Nonlinear transformer model for circuit simulation", IEEE Trans. CAD 10 (1991) 476,
doi:10.1109/43.75630.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from ..deck import Element, Grid, Param, Source
from ..expressions.expression import Expression
from ..expressions.node import call, num, var
from ..findings import Findings, Unreadable

HYSTERESIS = frozenset({"hysteresis", "remanence"})
#: Chan's core, LTspice's
CHAN = frozenset({"hc", "bs", "br", "a", "lm", "lg", "n"})
_NEEDED = ("hc", "bs", "br", "a", "lm", "n")
_MU0 = 4e-7 * math.pi
#: pieces of the curve without hysteresis between 0 and saturation, which err by 1/n^2 of it at most
_PIECES = 10
#: where the saturated part begins, in units of the field of half saturation
_SATURATED = 400.0
#: times the field where the saturated part begins, to which the table goes
_FAR = 1e3
#: stops of a fitted core, and the part of saturation within which they all reach their limits
_STOPS, _REACH = 4, 0.125
#: points at which a fit is compared
_COMPARED = 400


def with_core(element: Element, findings: Findings) -> Iterator[Element]:
    """Yield an inductor with its hysteresis taken apart.

    Parameters
    ----------
    element : Element
    findings : Findings
        Receives how well a core of LTspice is fitted.

    Raises
    ------
    Unreadable
        For lists that do not fit each other, or values that are impossible.
    """
    chan = {key: p for key, p in element.params.items() if key in CHAN}
    if not (chan or HYSTERESIS & element.params.keys()):
        yield element
        return
    kept = {k: p for k, p in element.params.items() if k not in CHAN | HYSTERESIS}
    element, given = replace(element, params=kept), element.params
    if chan:
        core = _Chan.of(element, chan)
        element = _with_table(element, core.table())
        stops = core.stops()
        loop, first = core.errors()
        message = f"{element.name}: Chan's core is fitted by a table and {len(stops)} stops; "
        message += f"flux densities differ by up to {loop:.0%} of Bs on the major loop, and by "
        message += f"{first:.0%} on the initial curve"
        findings.warning("NS1101", message, element.span, "minor loops close, other than Chan's")
    else:
        stops = _stops(element, given.get("hysteresis"))
    share = given.get("remanence")
    rest = 0.0 if share is None else _number(element, share)
    if not -1.0 <= rest <= 1.0:
        raise _impossible(element, "remanence", rest, "give -1 to 1")
    yield from _parts(element, stops, rest)


def hysteretic(
    element: Element, table: Sequence[tuple[float, float]], stops: Sequence[tuple[float, float]]
) -> Iterator[Element]:
    """Yield an inductor of a table (current [A], flux [V s]) and stops (limit [A], [H])."""
    yield from _parts(_with_table(element, table), stops, 0.0)


def _with_table(element: Element, table: Sequence[tuple[float, float]]) -> Element:
    values = [num(v) for point in table for v in point]
    law = Expression(call("pwl", var("i"), *values), element.span)
    return replace(element, value=law, quantity="flux")


def _parts(
    element: Element, stops: Sequence[tuple[float, float]], remanence: float
) -> Iterator[Element]:
    """Yield the elements: the one with the name carries the whole current."""
    name, where, spans = element.name, element.span, element.node_spans
    a, b = element.nodes
    core = f"{name}#core"
    initial = element.params.get("ic")
    current = 0.0 if initial is None else _number(element, initial)
    total = sum(limit for limit, _ in stops)
    # a stop has no current at an operating point unless something else decides about it
    flags = {"on": where}

    def source(letter: str, label: str, nodes: tuple[str, str], value: float) -> Element:
        law = Source(value, None, "", (), {}, where)
        return Element(label, letter, nodes, where, source=law, node_spans=spans)

    def started(part: Element, value: float) -> Element:
        return replace(part, params={**part.params, "ic": Param("ic", value, where)})

    yield source("v", name, (a, core), 0.0)
    main = replace(element, name=f"{name}.main", nodes=(core, b))
    yield started(main, current + remanence * total)
    for k, (limit, inductance) in enumerate(stops, start=1):
        upper, lower = f"{name}#u{k}", f"{name}#d{k}"
        part = Element(
            f"{name}.l{k}", "l", (core, upper), where, value=inductance, node_spans=spans
        )
        yield started(part, -remanence * limit)
        yield source("i", f"{name}.iu{k}", (upper, lower), limit)
        yield Element(f"{name}.du{k}", "d", (lower, upper), where, flags=flags, node_spans=spans)
        yield source("i", f"{name}.id{k}", (b, lower), limit)
        yield Element(f"{name}.dd{k}", "d", (lower, b), where, flags=flags, node_spans=spans)


def _stops(element: Element, param: Param | None) -> list[tuple[float, float]]:
    """Return limit [A] and inductance [H] of each stop."""
    hint = "write hysteresis=table(i=10m 30m l=20m 40m): limits and inductances"
    if param is None or not isinstance(param.value, Grid):
        where = element.span if param is None else param.span
        raise Unreadable("NS1080", f"{element.name}: hysteresis is a table", where, hint)
    lists = param.value.lists
    if set(lists) != {"i", "l"} or len(lists["i"]) != len(lists["l"]):
        message = f"{element.name}: hysteresis has lists of i and l that are equally long"
        raise Unreadable("NS1080", message, param.span, hint)
    for key, values in lists.items():
        for value in values:
            if not 0.0 < value < math.inf:
                raise _impossible(element, key, value, "give positive numbers")
    return list(zip(lists["i"], lists["l"], strict=True))


def _number(element: Element, param: Param) -> float:
    if not isinstance(param.value, float):
        message = f"{element.name}: {param.name} is not a number"
        raise Unreadable("NS1010", message, param.span)
    return param.value


def _impossible(element: Element, key: str, value: float, hint: str) -> Unreadable:
    message = f"{element.name}: {key} cannot be {value:g}"
    return Unreadable("NS1025", message, element.span, hint)


@dataclass(frozen=True, slots=True)
class _Chan:
    """Chan's core.

    The branches of the major loop are ``F(H + hc)`` and ``F(H - hc)`` plus ``mu0 H``, with
    ``F(H) = bs H/(|H| + d)``, ``d = hc (bs/br - 1)``; the initial curve is their mean.  So a field
    of F's inverse and one of plus or minus ``hc`` add up on the loop, as with stops.

    Parameters
    ----------
    hc : float
        Coercive field [A/m].
    bs, br : float
        Saturation and remanence [T].
    a : float
        Cross section [m^2].
    lm, lg : float
        Lengths of core and gap [m].
    n : float
        Turns.
    """

    hc: float
    bs: float
    br: float
    a: float
    lm: float
    n: float
    lg: float = 0.0

    @classmethod
    def of(cls, element: Element, given: dict[str, Param]) -> _Chan:
        missing = [key for key in _NEEDED if key not in given]
        if missing:
            message = f"{element.name}: the core needs {', '.join(missing).title()}"
            raise Unreadable("NS1008", message, element.span, "Hc= Bs= Br= A= Lm= N= (and Lg=)")
        values = {key: _number(element, param) for key, param in given.items()}
        for key, value in values.items():
            if not (0.0 < value < math.inf or (key == "lg" and value == 0.0)):
                raise _impossible(element, key, value, "give positive numbers")
        if values["br"] >= values["bs"]:
            raise _impossible(element, "br", values["br"], "give less than Bs")
        return cls(**values)

    @property
    def _d(self) -> float:
        return self.hc * (self.bs / self.br - 1.0)

    def _density(self, field: float, shift: float) -> float:
        return self.bs * (field + shift) / (abs(field + shift) + self._d) + _MU0 * field

    def _field(self, density: float) -> float:
        """Return the field of the table [A/m]."""
        points = self._curve()
        size = abs(density)
        for (h0, b0), (h1, b1) in itertools.pairwise(points):
            if size <= b1 or (h1, b1) == points[-1]:
                return math.copysign(h0 + (h1 - h0) * (size - b0) / (b1 - b0), density)
        raise AssertionError

    def _curve(self) -> list[tuple[float, float]]:
        """Return points (H, B) of the curve without hysteresis, the last of them far out."""
        last = (1.0 + _SATURATED) ** -0.5
        points = []
        for k in range(_PIECES + 1):
            # the density of points of equal errors: the square root of the curvature
            root = 1.0 - k / _PIECES * (1.0 - last)
            field = self._d * (root**-2 - 1.0)
            points.append((field, self._density(field, 0.0)))
        field, density = points[-1]
        return [*points, (_FAR * field, density + _MU0 * (_FAR - 1.0) * field)]

    def table(self) -> list[tuple[float, float]]:
        """Return points (current, flux) without hysteresis [A, V s]."""
        gap = self.lg / _MU0
        upper = [
            ((h * self.lm + b * gap) / self.n, self.n * self.a * b) for h, b in self._curve()[1:]
        ]
        return [*((-i, -f) for i, f in reversed(upper)), (0.0, 0.0), *upper]

    def _levels(self) -> list[tuple[float, float]]:
        """Return of each stop its limit [A/m], and the density at which it reaches it [T].

        Limits together are Hc; the sum of the stops rises to it as a parabola, as in Rayleigh's
        law.  The less it takes, the nearer is the major loop to Chan's, which jumps from one branch
        to the other at its tips, and the steeper the field of the initial curve.
        """
        reach = _REACH * self.bs
        knots = [k / _STOPS for k in range(_STOPS + 1)]
        curve = [self.hc * (1.0 - (1.0 - x) ** 2) for x in knots]
        slopes = [(v - u) * _STOPS / reach for u, v in itertools.pairwise(curve)] + [0.0]
        falls = [u - v for u, v in itertools.pairwise(slopes)]
        return [(fall * x * reach, x * reach) for fall, x in zip(falls, knots[1:], strict=True)]

    def stops(self) -> list[tuple[float, float]]:
        """Return limit [A] and inductance [H] of each stop."""
        return [
            (limit * self.lm / self.n, self.n * self.a * level / (limit * self.lm / self.n))
            for limit, level in self._levels()
        ]

    def errors(self) -> tuple[float, float]:
        """Return the largest differences on the major loop and the initial curve, parts of Bs."""
        levels, top = self._levels(), self._density(20.0 * (self.hc + self._d), 0.0)
        loop = first = 0.0
        for k in range(_COMPARED):
            density = top * (1.0 - 2.0 * k / _COMPARED)
            field = self._field(density)
            way = top - density
            back = field + sum(max(-h, h - way * h / b) for h, b in levels)
            loop = max(loop, abs(self._density(back, self.hc) - density))
            if density > 0.0:
                ahead = field + sum(min(h, density * h / b) for h, b in levels)
                mean = self._density(ahead, self.hc) + self._density(ahead, -self.hc)
                first = max(first, abs(0.5 * mean - density))
        return loop / self.bs, first / self.bs
