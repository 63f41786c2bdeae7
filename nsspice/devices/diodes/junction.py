"""The smooth junction of SPICE's diode: current, charge, breakdown, temperature.

Only what the model card gives is written:

- exponential junction ``IS (exp(v / N Vt) - 1)`` (``IS N``), always
- recombination current (``ISR NR``) and high injection (``IKF``) as in PSpice
- breakdown (``BV IBV NBV``): a second exponential, such that the current at -BV is -IBV; a third
  one (``IBVL NBVL``), which is -IBVL there, for the soft knee below it
- depletion charge (``CJO VJ M FC``) and diffusion charge (``TT``)
- ohmic resistance (``RS``): one node more

In the blocking region SPICE replaces the exponential by a cube; here it stays an exponential, and
the law is smooth everywhere.  The two differ by less than 0.05 IS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..effect import Effect
from ..stamper import Conditions
from ..temperature import CELSIUS, depletion, kelvin, saturation, thermal_voltage

if TYPE_CHECKING:
    from .number_tape import LawTape, R

#: a larger grading coefficient is taken as this one (ngspice's bound)
STEEPEST = 0.9


@dataclass(frozen=True, slots=True)
class JunctionLaw:
    """The parameters of one model card; None stands for an absent effect.

    Parameters
    ----------
    given : tuple of (str, float)
        What the card gave, in its order.
    """

    is_: float = 1e-14
    n: float = 1.0
    rs: float | None = None
    isr: float | None = None
    nr: float = 2.0
    ikf: float | None = None
    bv: float | None = None
    ibv: float = 1e-3
    nbv: float | None = None
    ibvl: float | None = None
    nbvl: float = 1.0
    cjo: float | None = None
    vj: float = 1.0
    m: float = 0.5
    fc: float = 0.5
    tt: float | None = None
    eg: float = 1.11
    xti: float = 3.0
    tnom: float | None = None
    t_abs: float | None = None
    trs1: float = 0.0
    trs2: float = 0.0
    tikf: float = 0.0
    ttt1: float = 0.0
    ttt2: float = 0.0
    tm1: float = 0.0
    tm2: float = 0.0
    tbv1: float = 0.0
    tbv2: float = 0.0
    tcv: float = 0.0
    tlev: float = 0.0
    tlevc: float = 0.0
    cta: float = 0.0
    tpb: float = 0.0
    given: tuple[tuple[str, float], ...] = ()

    @property
    def stores_charge(self) -> bool:
        """True if the junction has a charge."""
        return bool(self.cjo) or bool(self.tt)

    def effects(self, parallel: float) -> tuple[Effect, ...]:
        """Return what the model card called for, for ``parallel`` equal junctions."""
        listed: list[Effect] = []
        given = dict(self.given)
        listed.append(
            Effect("exponential junction", "is", self.is_ * parallel, "A")
            if "is" in given
            else Effect("exponential junction")
        )
        for key, name, unit, factor in _EFFECTS:
            if key in given and (given[key] or key not in _NEUTRAL_ZERO):
                listed.append(Effect(name, key, given[key] * parallel**factor, unit))
        rising = [key for key in _COEFFICIENTS if given.get(key)]
        if rising:
            listed.append(Effect("temperature coefficients", " ".join(rising)))
        return tuple(listed)

    def at(self, conditions: Conditions, temp: float | None, dtemp: float) -> Junction:
        """Return the junction at the temperature of its element.

        Parameters
        ----------
        conditions : Conditions
        temp : float or None
            The element's own temperature [degrees Celsius], by default that of the card.
        dtemp : float
            Above the circuit's [K].
        """
        actual = kelvin(conditions, self.t_abs if temp is None else temp, dtemp)
        nominal = (conditions.nominal if self.tnom is None else self.tnom) + CELSIUS
        vt = thermal_voltage(actual)
        rise = actual - nominal

        def growth(linear: float, quadratic: float = 0.0) -> float:
            return 1.0 + linear * rise + quadratic * rise * rise

        grading = min(self.m * growth(self.tm1, self.tm2), STEEPEST)
        current = saturation(self.is_, self.n, self.eg, self.xti, nominal, actual)
        if self.tlevc:
            cjo, vj = (self.cjo or 0.0) * growth(self.cta), self.vj - self.tpb * rise
        else:
            cjo, vj = depletion(self.cjo or 0.0, self.vj, grading, nominal, actual)
        bv = self.bv
        if bv is not None:
            fall = self.tcv * rise * (bv if self.tlev else 1.0)
            bv = bv * growth(self.tbv1, self.tbv2) - fall
        isr = saturation(self.isr or 0.0, self.nr, self.eg, self.xti, nominal, actual)
        nbv = (self.n if self.nbv is None else self.nbv) * vt
        return Junction(
            current=current,
            slope=self.n * vt,
            recombination=isr,
            recombination_slope=self.nr * vt,
            knee=(self.ikf or 0.0) * growth(self.tikf),
            resistance=(self.rs or 0.0) * growth(self.trs1, self.trs2),
            breakdown=_breakdown(bv, self.ibv, current, self.n * vt, nbv),
            breakdown_slope=nbv,
            low=(0.0, 1.0, 0.0) if bv is None else (self.ibvl or 0.0, self.nbvl * vt, bv),
            capacitance=cjo,
            potential=vj,
            grading=grading,
            bend=self.fc,
            transit=(self.tt or 0.0) * growth(self.ttt1, self.ttt2),
        )


#: parameter, effect, unit, exponent of the number of equal junctions
_EFFECTS = (
    ("n", "emission coefficient", "", 0),
    ("rs", "ohmic resistance", "Ohm", -1),
    ("isr", "recombination", "A", 1),
    ("ikf", "high injection", "A", 1),
    ("bv", "SPICE breakdown", "V", 0),
    ("ibvl", "low-level breakdown", "A", 1),
    ("cjo", "junction charge", "F", 1),
    ("tt", "diffusion charge", "s", 0),
    ("tnom", "nominal temperature", "C", 0),
    ("t_abs", "own temperature", "C", 0),
)
_NEUTRAL_ZERO = frozenset({"rs", "isr", "ikf", "ibvl", "cjo", "tt"})
_COEFFICIENTS = (
    *("trs1", "trs2", "tikf", "ttt1", "ttt2", "tm1", "tm2"),
    *("tbv1", "tbv2", "tcv", "tlevc", "cta", "tpb"),
)


@dataclass(frozen=True, slots=True)
class Junction:
    """The constants of one junction at its temperature; zero stands for an absent effect.

    ``low`` is ``IBVL``, its slope [V] and ``BV``.
    """

    current: float
    slope: float
    recombination: float
    recombination_slope: float
    knee: float
    resistance: float
    breakdown: float | None
    breakdown_slope: float
    low: tuple[float, float, float]
    capacitance: float
    potential: float
    grading: float
    bend: float
    transit: float

    def forward(self, tape: LawTape[R], v: R) -> R:
        """Return the register of the current without breakdown [A]."""
        total = tape.op("junction", v, constants=(self.current, self.slope))
        if self.knee:
            # i / sqrt(1 + i / IKF)
            share = tape.op("div", total, tape.constant(self.knee))
            root = tape.op("sqrt", tape.op("add", tape.constant(1.0), share))
            total = tape.op("div", total, root)
        if self.recombination:
            constants = (self.recombination, self.recombination_slope)
            loss = tape.op("junction", v, constants=constants)
            width = tape.op("div", v, tape.constant(self.potential))
            width = tape.op("square", tape.op("sub", tape.constant(1.0), width))
            width = tape.op("add", width, tape.constant(0.005))
            width = tape.op("pow", width, tape.constant(self.grading / 2.0))
            total = tape.op("add", total, tape.op("mul", loss, width))
        return total

    def write_current(self, tape: LawTape[R], v: R) -> R:
        """Return the register of the whole current [A]."""
        total = self.forward(tape, v)
        if self.breakdown is not None:
            for current, slope, start in (
                (self.current, self.breakdown_slope, self.breakdown),
                self.low,
            ):
                if current:
                    depth = tape.op("neg", tape.op("add", v, tape.constant(start)))
                    reverse = tape.op("junction", depth, constants=(current, slope))
                    total = tape.op("sub", total, reverse)
                    rest = current * math.expm1(-start / slope)
                    total = tape.op("add", total, tape.constant(rest))  # no current at 0 V
        return total

    def write_charge(self, tape: LawTape[R], v: R) -> R:
        """Return the register of the charge [A s]."""
        parts = []
        if self.capacitance:
            shape = (self.capacitance, self.potential, self.grading, self.bend)
            parts.append(tape.op("depletion", v, constants=shape))
        if self.transit:
            parts.append(tape.op("mul", tape.constant(self.transit), self.forward(tape, v)))
        return parts[0] if len(parts) == 1 else tape.op("add", *parts)

    def charge(self, v: float) -> float:
        """Return the charge [A s] at a voltage, for initial conditions."""
        total = depletion_charge(v, self.capacitance, self.potential, self.grading, self.bend)
        if self.transit:
            level = self.current * math.expm1(min(v / self.slope, 300.0))
            if self.knee:
                level /= math.sqrt(1.0 + level / self.knee)
            if self.recombination:
                loss = self.recombination * math.expm1(min(v / self.recombination_slope, 300.0))
                level += loss * ((1.0 - v / self.potential) ** 2 + 0.005) ** (self.grading / 2.0)
            total += self.transit * level
        return total


def depletion_charge(v: float, c: float, vj: float, m: float, fc: float) -> float:
    """Return the charge of a depletion layer [A s]; above ``fc vj`` it goes on as a parabola.

    Examples
    --------
    >>> depletion_charge(-1.0, 1e-12, 1.0, 0.5, 0.5) == 2e-12 * (1 - 2**0.5)
    True
    """
    edge = min(v, fc * vj)
    total = c * vj / (1.0 - m) * (1.0 - (1.0 - edge / vj) ** (1.0 - m))
    over = v - edge
    steep = c / (1.0 - fc) ** m
    return float(total + over * steep * (1.0 + m * over / (2.0 * vj * (1.0 - fc))))


def _breakdown(
    bv: float | None, ibv: float, current: float, slope: float, steep: float
) -> float | None:
    """Return the voltage at which the second exponential starts, so that ``i(-BV) = -IBV``."""
    if bv is None:
        return None
    # IBV = -IS expm1(-BV/nVt) + IS expm1(x/nbVt) - IS expm1((x - BV)/nbVt) for x = BV - start
    excess = ibv / current + math.expm1(-bv / slope) + math.expm1(-bv / steep)
    return bv - steep * math.log1p(excess) if excess > 0.0 else bv
