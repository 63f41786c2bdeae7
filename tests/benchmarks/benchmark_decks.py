"""Netlists of the benchmarks, in any size, for nsspice and for ngspice."""

from __future__ import annotations


def bridge_oscillator(diode: str = "D(ideal)", step: float = 1e-6, stop: float = 5e-3) -> str:
    """LC oscillator whose capacitor feeds a resistor through a four-diode bridge."""
    return f"""bridge oscillator, L=10 mH, C=1 uF, R=1 kOhm, 10 V
C0 n1 0 1u IC=10
L1 n1 0 10m IC=0
DF1 n1 p dx
DR1 0 p dx
DF2 n 0 dx
DR2 n n1 dx
R1 p n 1k
.model dx {diode}
.tran {step:g} {stop:g} 0 {step:g} uic
.end
"""


def multiplier(
    diodes: int,
    diode: str = "D(ideal)",
    step: float = 1e-6,
    stop: float = 2e-3,
    print_step: float | None = None,
) -> str:
    """Cockcroft-Walton multiplier: diode k leads from node k-1 to k, capacitor k from k-2 to k."""
    lines = [
        f"Cockcroft-Walton multiplier with {diodes} diodes",
        "V1 in 0 SIN(0 10 1k)",
        "Rs in c1 1",
    ]

    def node(k: int) -> str:
        return "c1" if k == -1 else "0" if k == 0 else f"m{k}"

    for k in range(1, diodes + 1):
        lines.append(f"C{k} {node(k - 2)} {node(k)} 1u")
        lines.append(f"D{k} {node(k - 1)} {node(k)} dx")
    lines += [
        f"RL {node(diodes)} 0 {50e3 * diodes:g}",
        f".model dx {diode}",
        f".tran {print_step or step:g} {stop:g} 0 {step:g} uic",
        ".end",
    ]
    return "\n".join(lines) + "\n"
