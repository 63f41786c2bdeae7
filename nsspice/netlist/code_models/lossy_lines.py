r"""Transmission lines with losses: ``O`` (LTRA), ``Y`` (TXL) and ``U`` (URC).

With p = s L/R, a delay T and an impedance Z0 = sqrt(L/C) without loss, what a line of R, L and C
does at its ports is

    I1 = Y V1 - W(s) exp(-s T) (Y V2 + I2),    Y = sqrt(p/(1 + p))/Z0,
    W = exp(-(T R/L) (sqrt(p (1 + p)) - p))

and the same with both ends exchanged.  The delay is exact.  Y and W have a cut from p = -1 to 0, on
which poles are put, ever denser towards both ends; their residues are fitted on the imaginary axis.
At p = 0 something is left of Y, and W is chosen such that the resistance between the ends is R; the
line leaks by the square of what is left, 1e-7/Z0.

A line without L is a series of modes, each a resistor and a capacitor; the capacitance of all
higher ones is kept.

References: F. Y. Chang, "The generalized method of characteristics for waveform relaxation analysis
of lossy coupled transmission lines", IEEE Trans. Microw. Theory Tech. 37 (1989) 2028.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..elements.transmission import lossless
from .block import Block, wrong

Floats = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

#: largest difference of Y Z0 and of W from their closed forms, and most poles of each
_ERROR, _MOST = 1e-4, 28
#: the slowest pole, in units of R/L; below it Y and W are constant
_SLOWEST = 1e-6
#: how dense the poles are at the fast end
_FAST = 3.0
#: modes of a line without inductance; an odd number, so that no capacitor of the rest is negative
_MODES = 15


class Fit(NamedTuple):
    """Sums of poles: ``1 + sum(of_y x/(p + x))`` and ``limit + sum(of_w x/(p + x))``.

    ``error`` is the largest difference from the closed forms on the imaginary axis.
    """

    poles: Floats
    of_y: Floats
    of_w: Floats
    limit: float
    error: float


def fitted(loss: float) -> Fit:
    """Return the rational functions of a line with ``loss = T R/L``.

    Parameters
    ----------
    loss : float
        Resistance of the whole line in units of its impedance.

    Examples
    --------
    >>> fit = fitted(1.0)
    >>> fit.error < 1e-4
    True
    """
    for count in range(12, _MOST + 1, 2):
        fit = _fit(loss, count)
        if fit.error < _ERROR:
            break
    return fit


def _fit(loss: float, count: int) -> Fit:
    poles = 1.0 / (1.0 + np.exp(-np.linspace(math.log(_SLOWEST), _FAST, count)))
    p = np.asarray(1j * np.geomspace(_SLOWEST / 3.0, 1e3, 400), dtype=np.complex128)
    y, w = closed_forms(loss, p)
    basis = poles / (p[:, np.newaxis] + poles)
    limit = math.exp(-0.5 * loss)
    of_y = _least_squares(basis, y - 1.0, 1.0 / np.sqrt(np.abs(y)))
    left = 1.0 + of_y.sum()
    # two ends that differ by 2 V carry 2 V Y (1 + W)/(1 - W): the current of the resistance
    at_dc = 1.0 - 2.0 * loss * left / (2.0 + loss * left)
    weight = 1.0 / np.sqrt(np.abs(1.0 - w))
    # the sum of the residues is given: the last one is what the others leave
    rest = at_dc - limit
    shifted = basis[:, :-1] - basis[:, -1:]
    of_w = _least_squares(shifted, w - limit - rest * basis[:, -1], weight)
    of_w = np.append(of_w, rest - of_w.sum())
    errors = np.abs(1.0 + basis @ of_y - y), np.abs(limit + basis @ of_w - w)
    # the lowest frequencies, where both are constant, are those of the resistance at DC
    above = np.abs(p) > 30.0 * _SLOWEST
    return Fit(poles, of_y, of_w, limit, float(max(e[above].max() for e in errors)))


def closed_forms(loss: float, p: Complex) -> tuple[Complex, Complex]:
    """Return ``Y Z0`` and ``W`` of a line by their closed forms."""
    return np.sqrt(p / (1.0 + p)), np.exp(-loss * (np.sqrt(p * (1.0 + p)) - p))


def _least_squares(basis: Complex, target: Complex, weight: Floats) -> Floats:
    """Return real coefficients of complex functions."""
    matrix, right = basis * weight[:, np.newaxis], target * weight
    rows = np.vstack([matrix.real, matrix.imag])
    found = np.linalg.lstsq(rows, np.concatenate([right.real, right.imag]), rcond=None)[0]
    return np.asarray(found, dtype=np.float64)


def line(block: Block) -> list[str]:
    """Return the line of a card with ``R L G C`` of a length, and that length."""
    length = block.number("len", block.number("length", 0.0))
    r, inductance, g, c = (block.number(key, 0.0) * length for key in "rlgc")
    if min(r, inductance, g, c) < 0.0 or not length > 0.0:
        raise wrong(block, "a line needs a length, and no value may be negative")
    kind = "".join(k for k, v in zip("rlgc", (r, inductance, g, c), strict=True) if v > 0.0)
    (a, b), (d, e) = ((vector[0].plus, vector[0].minus) for vector in block.ports[:2])
    if kind == "rg":
        return _resistive(r, g, (a, b), (d, e))
    if kind == "rc":
        if b != e:
            raise wrong(block, "a line without inductance needs one node as its reference")
        return diffusive(r, c, a, d, b)
    if kind not in ("lc", "rlc"):
        raise wrong(block, "lines of R L C, L C, R C and R G are simulated, no others")
    impedance, delay = math.sqrt(inductance / c), math.sqrt(inductance * c)
    if kind == "lc":
        return lossless(impedance, delay, (a, b), (d, e))
    return attenuated(r, impedance, delay, ((a, b), (d, e)))


def attenuated(
    r: float,
    impedance: float,
    delay: float,
    ports: tuple[tuple[str, str], tuple[str, str]],
    label: str = "",
) -> list[str]:
    """Return the line of R, L and C; ``label`` is part of the names of its inner nodes."""
    loss = r / impedance
    fit, rate = fitted(loss), loss / delay
    lines = [
        f"* its attenuation and admittance are fitted by {fit.poles.size} poles each: they differ "
        f"by up to {fit.error:.1g} from the closed forms"
    ]
    ends = [f"{label}{k}" for k in range(2)]
    for k, other, (plus, minus) in zip(ends, ends[::-1], ports, strict=True):
        # waves are volts: Z0 times currents
        drive = f"v({plus},{minus})"
        lines += _filter(f"y{k}", drive, 1.0, fit.poles, fit.of_y, rate)
        wave = f"v(y{other}) + {impedance!r}*i(Bport{other})"
        lines += [
            f"Blate{k} in{k} 0 V={{delay({wave}, {delay!r})}}",
            *_filter(f"w{k}", f"v(in{k})", fit.limit, fit.poles, fit.of_w, rate),
            f"Bport{k} {plus} {minus} I={{(v(y{k}) - v(w{k}))/{impedance!r}}}",
        ]
    return lines


def _filter(
    node: str, drive: str, direct: float, poles: Floats, gains: Floats, rate: float
) -> list[str]:
    """Return a node with the sum of an input and of what its poles make of it."""
    lines, terms = [], [f"{direct!r}*{drive}"]
    for k, (pole, gain) in enumerate(zip(poles.tolist(), gains.tolist(), strict=True)):
        state = f"{node}x{k}"
        lines += [f"C{state} {state} 0 {1.0 / (rate * pole)!r}"]
        lines += [f"B{state} 0 {state} I={{{drive} - v({state})}}"]
        terms.append(f"{gain!r}*v({state})")
    return [*lines, f"B{node} {node} 0 V={{{' + '.join(terms)}}}"]


def diffusive(r: float, c: float, a: str, b: str, low: str) -> list[str]:
    """Return the line of R and C between two nodes: its modes, and the rest as capacitors.

    Mode n carries ``(2/R) s t/(1 + s t)``, t = R C/(n pi)^2, times the sum of both voltages (n odd)
    or their difference.
    """
    lines = [f"R1 {a} {b} {r!r}"]
    ends = (f"v({a},{low})", f"v({b},{low})")
    flows: dict[bool, list[str]] = {True: [], False: []}
    left = {True: c / 4.0, False: c / 12.0}
    for n in range(1, _MODES + 1):
        odd = n % 2 == 1
        time = r * c / (n * math.pi) ** 2
        left[odd] -= 2.0 * time / r
        drive = " + ".join(ends) if odd else " - ".join(ends)
        lines += [f"C{n} x{n} 0 {time!r}", f"B{n} 0 x{n} I={{{drive} - v(x{n})}}"]
        flows[odd].append(f"({drive} - v(x{n}))")
    total, apart = (f"{2.0 / r!r}*({' + '.join(flows[k])})" for k in (True, False))
    return [
        *lines,
        f"Ba {a} {low} I={{{total} + {apart}}}",
        f"Bb {b} {low} I={{{total} - {apart}}}",
        f"Ca {a} {low} {2.0 * left[True]!r}",
        f"Cb {b} {low} {2.0 * left[True]!r}",
        f"Cab {a} {b} {left[False] - left[True]!r}",
        f"* it has {_MODES} modes, exact up to about {_MODES**2 / (r * c):.2g} 1/s",
    ]


def _resistive(r: float, g: float, near: tuple[str, str], far: tuple[str, str]) -> list[str]:
    """Return the line of R and G: a two-port of its hyperbolic functions."""
    angle, admittance = math.sqrt(r * g), math.sqrt(g / r)
    own, other = admittance / math.tanh(angle), admittance / math.sinh(angle)
    v, w = f"v({near[0]},{near[1]})", f"v({far[0]},{far[1]})"
    return [
        f"B1 {near[0]} {near[1]} I={{{own!r}*{v} - {other!r}*{w}}}",
        f"B2 {far[0]} {far[1]} I={{{own!r}*{w} - {other!r}*{v}}}",
    ]


def uniform(block: Block) -> list[str]:
    """Return the URC line: ports a and b, and the node of its capacitance."""
    if block.number("isperl", 0.0) > 0.0:
        raise wrong(block, "a URC line with diodes (ISPERL) is not simulated")
    length = block.number("l", 0.0)
    r, c = block.number("rperl", 1000.0) * length, block.number("cperl", 1e-15) * length
    if not (r > 0.0 and c > 0.0):
        raise wrong(block, "a URC line needs L=, RPERL and CPERL above zero")
    a, b, low = (vector[0].plus for vector in block.ports)
    return diffusive(r, c, a, b, low)
