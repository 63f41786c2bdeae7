"""Noise of elements, as currents between two nodes.

A resistance has :math:`4 k T / R`, a junction :math:`2 q |I|`, the channel of a field-effect
transistor :math:`\\tfrac83 k T |g_m|` [A^2/Hz], one-sided and white; a bipolar transistor has those
of its collector and base currents and of its resistances.  With ``KF`` and ``AF`` diodes, base
currents and channels flicker: :math:`K_F |I|^{A_F} / f`, that of a MOSFET over
:math:`C_{ox}^2`, of level 1 over :math:`W L C_{ox}^2`, as in ngspice.  Each device yields its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from .temperature import BOLTZMANN, CHARGE

if TYPE_CHECKING:
    from ..netlist.deck import Element, Param


class NoiseSource(NamedTuple):
    """One source of noise.

    Parameters
    ----------
    a, b : str
        Nodes between which its current flows.
    density : float
        [A^2/Hz], or what a power of a current or slope at the operating point multiplies.
    signal : str
        A current; empty without one.
    function : int or None
        A smooth function, a current.
    gate : str
        Node by whose voltage the function is differentiated; empty for its value.
    exponent : float
        Of the current or slope.
    flickers : bool
        The density is that at 1 Hz, and falls with the frequency.
    """

    a: str
    b: str
    density: float
    signal: str = ""
    function: int | None = None
    gate: str = ""
    exponent: float = 1.0
    flickers: bool = False


class Flicker(NamedTuple):
    """Flicker noise of an element: ``KF`` and ``AF`` of its card, and ``M`` of its line."""

    kf: float = 0.0
    af: float = 1.0
    many: float = 1.0

    @classmethod
    def of(cls, element: Element | None) -> Flicker:
        """Return what an element and its model card give; without ``KF`` there is none."""
        cards = {} if element is None or element.model is None else element.model.params
        line = {} if element is None else element.params

        def number(params: Mapping[str, Param], key: str, default: float) -> float:
            value = params[key].value if key in params else default
            return float(value) if isinstance(value, int | float) else default

        return cls(number(cards, "kf", 0.0), number(cards, "af", 1.0), number(line, "m", 1.0))

    def sources(
        self, a: str, b: str, signal: str = "", function: int | None = None
    ) -> Iterator[NoiseSource]:
        """Yield what flickers of so many equal parallel elements that share a current."""
        if self.kf:
            density = self.kf * self.many ** (1.0 - self.af)
            yield NoiseSource(a, b, density, signal, function, exponent=self.af, flickers=True)


def thermal_noise(a: str, b: str, siemens: float, temperature: float) -> NoiseSource:
    """Return the noise of a conductance [S] at a temperature [K]."""
    return NoiseSource(a, b, 4.0 * BOLTZMANN * temperature * siemens)


def shot_noise(a: str, b: str, signal: str) -> NoiseSource:
    """Return the noise of a current across a junction."""
    return NoiseSource(a, b, 2.0 * CHARGE, signal)
