"""Converters of many equal parts, by their number: legs, strings, ladders, phases.

Diodes and switches have 1 mOhm and 1 GOhm, or (``sharp``) junctions and resistances with which
ngspice converges.
"""

from __future__ import annotations

MODELS = (
    ".model dm D(Ron=1m Roff=1g Vfwd=0)",
    ".model sm SW(Ron=1m Roff=1g VT=0.5)",
    ".model cmp SW(Ron=1m Roff=1g VT=0)",
    ".model cell D(Vfwd=30 Ron=0.3 Roff=1g)",
)
SHARP = (
    ".model dm D(IS=1e-14 N=0.05 RS=1m)",
    ".model sm SW(Ron=1m Roff=1meg VT=0.5)",
    ".model cmp SW(Ron=1m Roff=1meg VT=0)",
    ".model cell D(IS=1e-9 N=51)",
)


def leg(
    cells: int,
    stop: float = 20e-3,
    *,
    sharp: bool = False,
    more: str = "",
    dead: float = 0.0,
    blocked: float | None = None,
    off: str = "1g",
) -> str:
    """Half bridges of 1 kV, complementary switches with diodes, carriers shifted in phase.

    Both switches of a cell are open for a time ``dead`` [s] while carrier and reference cross
    (where the reference stands still), and from an instant ``blocked`` [s] on; open they have
    ``off`` [Ohm].
    """
    half, carrier, edge = 500 * cells, 1e-3, "1n" if sharp else "0"
    lines = [f"leg of {cells} cells an arm", f"Vp dcp 0 {half}", f"Vn 0 dcn {half}"]
    lines += ["Vru ru 0 SIN(0.5 -0.45 50)", "Vrl rl 0 SIN(0.5 0.45 50)"]
    # the references of upper and lower switches are the same until they are beyond all carriers
    references = {arm: (f"r{arm}", f"r{arm}") for arm in "ul"}
    if blocked is not None:
        for arm in "ul":
            references[arm] = (f"g{arm}", f"h{arm}")
            lines += [
                f"V{node}{arm} {node}{arm} r{arm} PULSE(0 {volts} {blocked} 0 0 1)"
                for node, volts in (("g", -2), ("h", 2))
            ]
    for arm, top, bottom, shift in (("u", "dcp", "um", 0.0), ("l", "lm", "dcn", 0.5)):
        first, second = references[arm]
        for k in range(cells):
            name = f"{arm}{k}"
            delay = (k + shift) / cells * carrier
            delay -= carrier if delay > 0 else 0.0
            after = bottom if k == cells - 1 else f"x{name}"
            lines += [
                f"Vc{name} c{name} 0 PULSE(0 1 {delay:.9g} 0.5m 0.5m {edge} 1m)",
                f"S1{name} {top} p{name} {first} c{name} cmp",
                f"D1{name} {top} p{name} dm",
                f"S2{name} {top} {after} c{name} {second} cmp",
                f"D2{name} {after} {top} dm",
                f"C{name} p{name} {after} 2m IC=1000",
            ]
            top = after
    lines += ["Lu um a 2m IC=0", "Ll a lm 2m IC=0", f"Rl a b {5 * cells}"]
    lines += [f"Lo b 0 {5e-3 * cells:.9g} IC=0", more]
    deck = _deck(lines, 10e-6, stop, 10e-6, "i(lo)", sharp)
    # a carrier passes a band of twice the threshold
    deck = deck.replace("VT=0)", f"VT={dead / carrier:.9g})")
    return deck.replace("Roff=1g", f"Roff={off}")


def string(panels: int, *, sharp: bool = False) -> str:
    """Panels in series, a third of them shaded, with bypass diodes, and a boost converter."""
    lines, before = [f"string of {panels} panels"], "0"
    for k in range(panels):
        node, after = f"q{k}", f"p{k}" if k < panels - 1 else "pv"
        lines += [
            f"I{k} {before} {node} {8.0 if k % 3 else 4.8}",
            f"DJ{k} {node} {before} cell",
            f"Rsh{k} {node} {before} 300",
            f"Rs{k} {node} {after} 0.2",
            f"DB{k} {before} {after} dm",
            f"Cp{k} {after} {before} 1u IC=30",
        ]
        before = after
    edge = "10n" if sharp else "0"
    lines += ["Lb pv sw 1m IC=0", f"Vg g 0 PULSE(0 1 0 {edge} {edge} 5u 20u)"]
    lines += ["Sb sw 0 g 0 sm", "Db sw out dm", f"Co out 0 100u IC={36 * panels}"]
    lines += [f"Vo ob 0 {39 * panels}", "Ro out ob 1"]
    return _deck(lines, 2e-6, 2e-3, 0.2e-6, "i(lb)", sharp)


def ladder(sections: int, *, sharp: bool = False) -> str:
    """Inductors and capacitors behind a sine, each node clamped to a rail by a diode."""
    lines = [f"ladder of {sections} sections", "Vs s 0 SIN(0 10 1k)", "Rs s n0 1", "Vcl cl 0 8"]
    for k in range(1, sections + 1):
        lines += [f"L{k} n{k - 1} n{k} 100u IC=0", f"C{k} n{k} 0 1u IC=0"]
        lines += [f"D{k} n{k} cl dm", f"Rp{k} n{k} 0 10k"]
    lines.append(f"Rl n{sections} 0 10")
    return _deck(lines, 5e-6, 5e-3, 1e-6, "i(l1)", sharp)


def phases(count: int, *, sharp: bool = False) -> str:
    """An interleaved buck converter."""
    f, edge = 100e3, "10n" if sharp else "0"
    lines = [f"{count} phases", "Vin in 0 24"]
    for k in range(count):
        pulse = f"{k / count / f:.9g} {edge} {edge} {0.4 / f:.9g} {1 / f:.9g}"
        lines += [f"Vg{k} g{k} 0 PULSE(0 1 {pulse})", f"S{k} in s{k} g{k} 0 sm"]
        lines += [f"D{k} 0 s{k} dm", f"L{k} s{k} out {100e-6 * (1 + 0.03 * k / count):.9g} IC=0"]
    lines += ["Co out 0 100u IC=0", f"Ro out 0 {2 / count:.9g}"]
    return _deck(lines, 1e-6, 1e-3, 0.1e-6, "i(l0)", sharp)


def _deck(
    lines: list[str], row: float, stop: float, longest: float, signal: str, sharp: bool
) -> str:
    step = f" 0 {longest:.9g}" if sharp else ""
    end = [f".tran {row:.9g} {stop:.9g}{step} uic", f".save {signal}", ".end\n"]
    return "\n".join([*lines, *(SHARP if sharp else MODELS), *end])
