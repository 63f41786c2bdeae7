"""What effects cost: those that nobody asks for nothing, the others their own.

``python tests/benchmarks/bench_effects.py`` prints the table of docs/explanation/performance.md.
"""

from __future__ import annotations

import time

import pytest

import nsspice

#: a regulated buck converter whose output voltage is saved
BASE = """regulated buck
Vin in 0 24
Vref ref 0 5
Vsaw saw 0 PULSE(0 1 0 9.9u 50n 50n 10u)
Ee e 0 VALUE={v(ref)-v(out)}
Gi 0 x VALUE={v(e)*2e-4}
Ci x 0 1u IC=0
Ec ctl 0 VALUE={CONTROL}
Eg g 0 VALUE={if(v(ctl)>v(saw),1,0)}
S1 in sw g 0 ideal
D1 0 sw DIODE
L1 sw out 100u IC=0
C1 out 0 100u IC=0
R1 out 0 5
.model ideal SW(VT=0.5)
.model DIODE D(DLAW)
.tran 1u 10m uic
.save v(out)
MORE"""
_FREE, _IDEAL = "v(x)+0.05*v(e)", "ideal"
_LIMIT = "limit(v(x)+0.05*v(e),0,0.95)"


def idle(count: int) -> str:
    """Return effects behind the converter that nothing which is saved depends on."""
    lines = []
    for k in range(count):
        # a filter behind a buffer, a measured power, a second converter on the same bus
        lines += [f"Em{k} m{k} 0 out 0 1", f"Rm{k} m{k} f{k} 1k", f"Cm{k} f{k} 0 1n"]
        lines += [f"Bp{k} p{k} 0 V={{v(out)*v(sw)}}", f"Rp{k} p{k} 0 1k"]
        lines += [f"S9{k} in y{k} g 0 ideal", f"D9{k} 0 y{k} JUNCTION"]
        lines += [f"L9{k} y{k} z{k} 100u", f"R9{k} z{k} 0 5"]
    return "\n".join([*lines, ".model JUNCTION D(IS=1e-12 CJO=1n)", ""])


def deck(control: str = _FREE, diode: str = _IDEAL, more: str = "") -> str:
    """Return the deck with one of its effects changed."""
    text = BASE.replace("CONTROL", control).replace("DLAW", diode).replace("MORE", more)
    return text + ".end\n"


CASES = {
    "as it is": deck(),
    "10 idle effects of each kind": deck(more=idle(10)),
    "100 idle effects of each kind": deck(more=idle(100)),
    "the controller saturates": deck(_LIMIT),
    "forward drop and on-resistance": deck(diode="Vfwd=0.7 Ron=10m"),
    "winding resistance": deck(more=".param dummy=0\n").replace(
        "L1 sw out 100u", "L1 sw out 100u Rser=50m"
    ),
    "exponential junction": deck(diode="IS=1e-9 N=1.2"),
    "junction with charges": deck(diode="IS=1e-9 N=1.2 CJO=200p TT=20n"),
}


def seconds(text: str, repeats: int = 7) -> float:
    """Return the shortest time of a run, without reading the deck."""
    circuit = nsspice.read(text)
    best = float("inf")
    for _ in range(repeats):
        begin = time.perf_counter()
        nsspice.tran(circuit)
        best = min(best, time.perf_counter() - begin)
    return best


@pytest.mark.parametrize("count", [10, 100])
def test_idle_effects_cost_nothing(count: int) -> None:
    """Finding out what is idle takes a part of the run, even with a hundred times the elements."""
    assert seconds(deck(more=idle(count))) < 1.5 * seconds(deck())


def test_a_limiter_costs_what_a_pair_costs() -> None:
    assert seconds(deck(_LIMIT)) < 2.0 * seconds(deck())


if __name__ == "__main__":
    base = 0.0
    print("| effect | time | against the deck as it is |\n|---|---|---|")
    for name, text in CASES.items():
        spent = seconds(text)
        base = base or spent
        print(f"| {name} | {1e3 * spent:.1f} ms | {spent / base:.2f} |")
