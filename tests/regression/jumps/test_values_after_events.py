"""Right after an event: values and rates in closed form, without short steps.

The statistic ``short_steps`` counts the instants whose values were limits of short steps.  Each
value is compared with the closed form from the charges and fluxes, which stay what they were.
"""

from pathlib import Path

import numpy as np
import pytest

import nsspice

#: values right after an event follow from one linear system, known to rounding of its largest terms
ROUNDING = 1e-11
NETS = Path(__file__).parents[3] / "netlists"


def _sides(run: nsspice.Solution, time: float, name: str) -> tuple[float, float]:
    """Return a signal before and after an instant at which both sides are shown."""
    both = np.flatnonzero(np.abs(run.time - time) <= 1e-12 * time)
    assert len(both) >= 2
    return float(run[name][both[0]]), float(run[name][both[-1]])


def _run(text: str, *signals: str) -> nsspice.Solution:
    run = nsspice.tran(nsspice.read(text), method="sdirk", all_points=True, signals=signals)
    assert run.certificate.passed
    return run


def test_a_current_divides_between_a_capacitor_and_a_junction() -> None:
    """A switch lets `v / 2k` into 1 nF and a blocking junction side by side: by capacitances."""
    cjo, vj, m, saturation = 2e-9, 0.7, 0.4, 1e-14
    run = _run(
        f"""capacitor beside a junction
V1 in 0 5
S1 in a g 0 SM
R1 a x 2k
C1 x 0 1n IC=3
D1 0 x DJ
Vg g 0 PULSE(0 1 1u 0 0 1)
.model SM SW(VT=0.5 RON=0 ROFF=1e12)
.model DJ D(IS={saturation} CJO={cjo} VJ={vj} M={m})
.tran 0.1u 2u uic
""",
        *("v(x)", "i(c1)", "i(s1)"),
    )
    voltage = _sides(run, 1e-6, "v(x)")
    assert voltage[0] == pytest.approx(voltage[1], rel=1e-14)
    # the current of the resistor less the leakage of the junction, which is 10 fA
    entering = (5.0 - voltage[1]) / 2000.0
    junction = cjo / (1.0 + voltage[1] / vj) ** m
    share = 1e-9 / (1e-9 + junction)
    assert _sides(run, 1e-6, "i(c1)")[1] == pytest.approx(entering * share, rel=ROUNDING)
    assert _sides(run, 1e-6, "i(s1)")[1] == pytest.approx(entering, rel=ROUNDING)
    assert run.stats["short_steps"] == 0


def test_a_ramp_begins_across_a_junction() -> None:
    """The source carries the charge of the junction: its capacitance times the slope, at once."""
    cjo, vj, m = 100e-12, 0.8, 0.5
    run = _run(
        f"""ramp across a junction
V1 a 0 PWL(0 -4 1u -4 2u -1)
D1 a 0 DJ
C1 a b 1n
R1 b 0 1k
.model DJ D(IS=1e-14 CJO={cjo} VJ={vj} M={m})
.tran 0.1u 1.5u
""",
        "i(v1)",
    )
    # the capacitor in series with the resistor carries nothing yet, the junction 10 fA
    charging = 3.0 / 1e-6 * cjo / np.sqrt(1.0 + 4.0 / vj)
    assert _sides(run, 1e-6, "i(v1)")[1] == pytest.approx(-charging, rel=1e-9)


def test_a_perfect_transformer_hands_its_current_over() -> None:
    """At turn-off the primary current goes on in the secondary, which carries `n` times as much."""
    run = _run(
        """flyback, perfectly coupled
Vin in 0 48
Lp in sw 50u IC=0
S1 sw 0 g 0 SM
Ls 0 sec 3.125u IC=0
Kt Lp Ls 1
D1 sec out
C1 out 0 100u IC=14
R1 out 0 10
Vg g 0 PULSE(0 1 0 0 0 3u 10u)
.model SM SW(VT=0.5 VH=0)
.tran 0.1u 45u uic
""",
        *("i(lp)", "i(d1)", "v(sec)", "v(out)"),
    )
    before, _ = _sides(run, 13e-6, "i(lp)")
    assert before == pytest.approx(48.0 * 3e-6 / 50e-6, rel=1e-9)
    assert _sides(run, 13e-6, "i(d1)")[1] == pytest.approx(4.0 * before, rel=ROUNDING)
    # all of it is discontinuous: the diode blocks before the next turn-on, which meets no flux
    assert _sides(run, 13e-6, "v(sec)")[1] == pytest.approx(float(_sides(run, 13e-6, "v(out)")[1]))
    assert run.stats["short_steps"] == 0


def test_a_bridge_of_perfect_transformers_agrees_with_the_exact_engine() -> None:
    """Currents of the dual active bridge of the collection by steps and by closed forms."""
    circuit = (NETS / "converters/dual_active_bridge.net").read_text()
    text = circuit.replace(".tran 50n 2m uic", ".tran 50n 100u uic")
    exact, steps = (
        nsspice.tran(nsspice.read(text), method=method, on_failure="ignore")
        for method in ("modewise", "sdirk")
    )
    for name in ("i(lk)", "i(l2)", "v(w)"):
        # both hold to rounding within a period; switches act at the same rows
        difference = np.abs(exact[name] - steps[name]).max()
        assert difference <= 1e-9 * np.ptp(exact[name])
    # where closed switches and diodes form a loop, their currents are shared by short steps
    assert steps.stats["short_steps"] <= steps.stats["events"] / 10


def test_a_diode_begins_to_conduct_beside_a_junction_with_series_resistance() -> None:
    """The laws of both ends of the resistor contain the charge, and their sum no rate."""
    saturation, resistance = 1e-14, 0.5
    run = _run(
        f"""ramp into a junction and an ideal diode side by side
I1 0 x PWL(0 0 1u 1)
D1 x 0 DJ
D2 x 0 DI
R1 x 0 1k
.model DJ D(IS={saturation} RS={resistance} CJO=1n VJ=0.7 M=0.5)
.model DI D(VFWD=0.3 RON=20m)
.tran 10n 1u uic
""",
        *("v(x)", "i(d2)", "i(d1)"),
    )
    event = next(e.time for e in run.events if e.element == "d2")
    voltage, current = _sides(run, event, "v(x)"), _sides(run, event, "i(d2)")
    assert voltage[1] == pytest.approx(0.3, rel=1e-6)  # to the tolerance of an event
    assert current[1] == pytest.approx(0.0, abs=1e-6)
    # the rest of the ramp goes through the resistor into the charge
    assert _sides(run, event, "i(d1)")[1] == pytest.approx(event / 1e-6 - 0.3e-3, rel=1e-5)
    assert run.stats["short_steps"] == 0


def test_diodes_that_nothing_reaches_stay_as_they_are() -> None:
    """Three-level leg: a clamping diode at an isolated node, another across closed switches.

    No rate decides about them.  The exact engine finds the same changes of state.
    """
    circuit = (NETS / "converters/npc_leg.net").read_text()
    text = circuit.replace(".tran 10u 40m", ".tran 10u 8m").replace("AT=40m", "AT=8m")
    exact, steps = (nsspice.tran(nsspice.read(text), method=m) for m in ("modewise", "sdirk"))
    assert steps.stats["short_steps"] <= 1  # all currents begin at zero

    def clamped(run: nsspice.Solution) -> int:
        return sum(event.element in ("d5", "d6") for event in run.events)

    # the first period begins without a current, where either may conduct
    assert abs(clamped(exact) - clamped(steps)) <= 4
    # what `sdirk` errs by at its default tolerance
    assert np.abs(exact["i(l1)"] - steps["i(l1)"]).max() <= 5e-6 * np.ptp(exact["i(l1)"])


@pytest.mark.parametrize("name", ["smooth/clamp", "control/second_order_filter",
                                  "thesis/ex413_normal_compliance", "bipolar/astable"])  # fmt: skip
def test_a_start_from_charges_needs_no_short_steps(name: str) -> None:
    """Junctions, gains and transistors: the first row obeys the laws, and stores what is given."""
    circuit = nsspice.read((NETS / f"{name}.net").read_text())
    run = nsspice.tran(circuit, method="sdirk", stop=1e-6, row_step=1e-6)
    assert run.stats["short_steps"] == 0
    assert run.certificate.passed


def test_without_storage_nothing_is_a_short_step() -> None:
    """A ladder of resistors and ideal switches: each instant is a static solution."""
    text = (NETS / "basics/switch_sequence.net").read_text()
    run = nsspice.tran(nsspice.read(text), method="sdirk")
    assert run.stats["short_steps"] == 0
    # S1 short-circuits a branch of its own; S2 halves nothing but R3; R4 and R5 part after 3 ms
    after = run["v(b)"][np.searchsorted(run.time, 1.5e-3)]
    assert after == pytest.approx(6.0, rel=1e-12)
    assert run["v(b)"][-1] == pytest.approx(0.0, abs=1e-12)
