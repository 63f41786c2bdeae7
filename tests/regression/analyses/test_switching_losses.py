"""Energies of switchings looked up at exact events, and junction temperatures: closed forms."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.linalg import expm

import nsspice
from nsspice.analyses.averages.heat import Heating, heating
from tests.regression.analyses.test_losses import table

#: an energy k i v is bilinear, so that four points of a grid give it everywhere
K_ON, K_OFF, K_REC = 2e-8, 3e-8, 1e-8


def product(k: float, more: str = "") -> str:
    return f"table(i=0 10 v=0 50{more} e=0 0 0 {500 * k!r})"


BUCK = f"""Buck with resistances and tables
Vin in 0 24
S1 in sw g 0 SH
D1 0 sw DX
L1 sw x 100u
RL x out 20m
C1 out 0 100u
R1 out 0 5
Vg g 0 PULSE(-1 1 0 0 0 5u 10u)
.model SH SW(VT=0 RON=30m Eon={product(K_ON)} Eoff={product(K_OFF)})
.model DX D(Ron=10m Vfwd=0.6 Err={product(K_REC)})
.pss
.measure pss both AVG psw(S1)
.measure pss diode AVG psw(D1)
"""


def hot(text: str) -> tuple[nsspice.Solution, dict[str, Heating]]:
    circuit = nsspice.read(text)
    solution = table(text)
    return solution, heating(circuit, solution.integrals)


def currents_of_the_buck() -> tuple[float, float]:
    """Return the inductor's current at the turn-on and at the turn-off."""
    L, C, R = 100e-6, 100e-6, 5.0

    def flow(r: float, drive: float) -> np.ndarray:
        M = np.zeros((3, 3))
        M[0, :] = -(r + 20e-3) / L, -1 / L, drive / L
        M[1, :2] = 1 / C, -1 / (R * C)
        return expm(M * 5e-6)

    on, off = flow(30e-3, 24.0), flow(10e-3, -0.6)
    whole = off @ on
    low = np.linalg.solve(np.eye(2) - whole[:2, :2], whole[:2, 2])
    return float(low[0]), float((on @ np.append(low, 1.0))[0])


def test_energies_of_a_buck() -> None:
    solution, found = hot(BUCK)
    low, high = currents_of_the_buck()
    blocked = (24.6 + 10e-3 * low, 24.6 + 10e-3 * high)
    on, off = found["s1"].commutations
    # rounding of the orbit over 1 - 0.983, the distance of the multipliers from 1
    assert on.energy == pytest.approx(K_ON * low * blocked[0], rel=1e-12)
    assert off.energy == pytest.approx(K_OFF * high * blocked[1], rel=1e-12)
    (recovery,) = found["d1"].commutations
    assert recovery.energy == pytest.approx(K_REC * low * (24.0 - 30e-3 * low), rel=1e-12)
    power = (on.energy + off.energy) / 10e-6
    assert solution.measures["both"] == pytest.approx(power, rel=1e-14)
    assert solution.measures["diode"] == pytest.approx(recovery.energy / 10e-6, rel=1e-14)
    rows = {row.element: row for row in solution.powers.rows}
    assert rows["s1"].switching == pytest.approx(power, rel=1e-14)
    assert solution.powers.switching == pytest.approx(power + recovery.energy / 10e-6, rel=1e-14)


def test_the_circuit_and_its_balance_do_not_change() -> None:
    plain, _ = hot(re.sub(r" E(on|off|rr)=table\([^)]*\)", "", BUCK).replace("AVG psw", "AVG p"))
    with_tables, _ = hot(BUCK)
    assert plain.certificate.energy == with_tables.certificate.energy
    assert np.array_equal(plain["v(out)"], with_tables["v(out)"])
    assert plain.powers.lost == with_tables.powers.lost


def test_an_efficiency_counts_switchings() -> None:
    solution = table(BUCK, loads=("r1",))
    p = solution.powers
    assert p.efficiency == pytest.approx(p.useful / (p.delivered + p.switching), rel=1e-14)


BRIDGE = f"""Synchronous buck of MOSFETs with dead times
Vin in 0 24
M1 in g1 sw sw MX
M2 sw g2 0 0 MX
L1 sw out 100u
C1 out 0 100u
R1 out 0 5
V1 g1 sw PULSE(0 10 0 0 0 4.9u 10u)
V2 g2 0 PULSE(0 10 5u 0 0 4.9u 10u)
.model MX NMOS(ideal Vto=5 Eon={product(K_ON)} Eoff={product(K_OFF)} body=DB)
.model DB D(ideal Err={product(K_REC)})
.pss
"""


def test_soft_switchings_cost_what_the_table_says_at_no_voltage() -> None:
    """The lower transistor turns on and off while its body diode carries the current."""
    _, found = hot(BRIDGE)
    kinds = {e: {c.kind: c for c in h.commutations} for e, h in found.items()}
    assert kinds["m2"]["on"].energy == kinds["m2"]["off"].energy == 0.0
    low, high = kinds["m1"]["on"], kinds["m1"]["off"]
    ripple = (24.0 - 24.0 * 0.49) * 4.9e-6 / 100e-6
    # the output's ripple, 0.6 A 10 us/(8 100 uF) = 8 mV of 12 V, bends the current
    assert high.current - low.current == pytest.approx(ripple, rel=2e-3)
    for event, k in ((low, K_ON), (high, K_OFF), (kinds["m2"]["recovery"], K_REC)):
        assert event.voltage == pytest.approx(24.0, rel=1e-14)
        assert event.energy == pytest.approx(k * event.current * 24.0, rel=1e-13)
    assert kinds["m2"]["recovery"].current == pytest.approx(low.current, rel=1e-13)


def test_parallel_switches_share_the_current() -> None:
    one, two = (hot(BUCK.replace("g 0 SH", f"g 0 SH m={m}"))[1]["s1"] for m in (1, 2))
    for a, b in zip(one.commutations, two.commutations, strict=True):
        # half the resistance moves the currents by 1e-2; a product k (i/2) v twice is the same
        assert b.current == pytest.approx(a.current / 2.0, rel=2e-2)
        assert b.energy == pytest.approx(2.0 * K(b.kind) * b.current * b.voltage, rel=1e-13)


def K(kind: str) -> float:
    return {"on": K_ON, "off": K_OFF, "recovery": K_REC}[kind]


def warm(resistance: float) -> str:
    """Return the buck with energies that grow by 1 % per kelvin, and a thermal network."""
    tables = f"table(i=0 10 v=0 50 t=25 125 e=0 0 0 {500 * K_ON!r} 0 0 0 {1000 * K_ON!r})"
    text = BUCK.replace(product(K_ON), tables).replace(f" Eoff={product(K_OFF)}", "")
    return text.replace("VT=0", f"VT=0 Foster=table(r={0.4 * resistance!r} {0.6 * resistance!r} "
                        "tau=10u 1m)")  # fmt: skip


def test_the_temperature_that_losses_keep() -> None:
    text = warm(20.0) + ".measure pss tj AVG tj(S1)\n.measure pss highest MAX tj(S1)\n"
    solution, found = hot(text)
    s1 = found["s1"]
    low, _ = currents_of_the_buck()
    cold = K_ON * low * (24.6 + 10e-3 * low) / 10e-6
    ambient, slope = 27.0, 0.01 * cold
    exact = (ambient + 20.0 * (s1.conduction + cold - 25.0 * slope)) / (1.0 - 20.0 * slope)
    assert s1.temperature == pytest.approx(exact, rel=1e-13)
    assert solution.measures["tj"] == s1.temperature
    assert solution.measures["highest"] == s1.highest
    # the average of the course, whose pieces are curved by (h/tau)^2/12 = 5e-7 of their rise
    mean = np.trapezoid(s1.temperatures, s1.times) / 10e-6
    assert mean == pytest.approx(s1.temperature, abs=1e-5 * (s1.highest - ambient))
    assert s1.temperatures[-1] == pytest.approx(
        s1.temperatures[0] - s1.commutations[0].energy * (8.0 / 10e-6 + 12.0 / 1e-3), rel=1e-12
    )


def test_a_runaway_is_refused() -> None:
    low, _ = currents_of_the_buck()
    slope = 0.01 * K_ON * low * (24.6 + 10e-3 * low) / 10e-6
    solution = table(warm(1.001 / slope))
    (warning,) = [w for w in solution.warnings if w.code == "NS5003"]
    assert "s1 has no steady temperature" in warning.message
    assert table(warm(0.999 / slope)).powers is not None


@pytest.mark.parametrize("form", ["Foster", "Cauer"])
def test_a_constant_power_heats_a_network(form: str) -> None:
    """A switch that stays closed: 0.1 Ohm and 10 A are 10 W."""
    r, c = np.array([0.5, 1.5]), np.array([2e-3, 1e-2])
    listed = "r=0.5 1.5 " + ("tau=1m 15m" if form == "Foster" else "c=2m 10m")
    text = f"""heated
I1 0 a 10
S1 a 0 g 0 SH
Vg g 0 1
C1 a 0 1n
.model SH SW(VT=0 RON=0.1 {form}=table({listed}))
.options temp=40
.tran 1m 50m
.measure tran last MAX tj(S1)
"""
    solution, found = hot(text)
    s1 = found["s1"]
    if form == "Foster":
        rise = 10.0 * (r * -np.expm1(-s1.times[:, None] / np.array([1e-3, 15e-3]))).sum(axis=1)
    else:
        G = np.array([[1 / r[0], -1 / r[0]], [-1 / r[0], 1 / r[0] + 1 / r[1]]])
        A = -G / c[:, None]
        b = np.array([10.0 / c[0], 0.0])
        rise = np.array([np.linalg.solve(A, (expm(A * t) - np.eye(2)) @ b)[0] for t in s1.times])
    # rounding of 400 products of exponentials
    assert np.abs(s1.temperatures - 40.0 - rise).max() < 1e-12 * 20.0
    assert solution.measures["last"] == s1.highest


def test_each_event_of_a_transient_is_looked_up_at_its_temperature() -> None:
    """Impulses of energy alone: T+ = T- + E(T-) sum(R/tau), and exponentials between them."""
    text = """pulses
V1 a 0 50
R1 a b 5
S1 b 0 g 0 SH
C1 g 0 1n
Vg g 0 PULSE(-1 1 1m 0 0 1m 2m)
.model SH SW(VT=0 Eon=table(i=0 10 v=0 50 t=25 125 e=0 0 0 10m 0 0 0 20m)
+ Foster=table(r=1 tau=2m))
.tran 1m 9.5m
"""
    _, found = hot(text)
    rise, expected = 0.0, []
    for _ in range(5):
        energy = 10e-3 * (1.0 + 0.01 * (27.0 + rise - 25.0))
        expected.append(energy)
        rise = (rise + energy * 1.0 / 2e-3) * np.exp(-1.0)
    assert [c.energy for c in found["s1"].commutations] == pytest.approx(expected, rel=1e-12)


def test_windows_of_measures() -> None:
    """10 W from the start on into 2 K/W with 10 ms, and one impulse of energy in each period."""
    text = """heated
I1 0 a 10
S1 a 0 g 0 SH
Vg g 0 1
C1 a 0 1n
S2 b 0 h 0 SL
R2 c b 5
V2 c 0 50
C2 h 0 1n
Vh h 0 PULSE(-1 1 1m 0 0 1m 2m)
.model SH SW(VT=0 RON=0.1 Foster=table(r=2 tau=10m))
.model SL SW(VT=0 Eon=table(i=0 10 v=0 50 e=0 0 0 10m))
.options temp=40
.tran 1m 20m
.measure tran mean AVG tj(S1) FROM=5m TO=15m
.measure tran low MIN tj(S1) FROM=5m TO=15m
.measure tran high MAX tj(S1) FROM=5m TO=15m
.measure tran step PP tj(S1) FROM=5m
.measure tran three INTEG psw(S2) FROM=2m TO=8m
.measure tran power AVG psw(S2) FROM=2m TO=8m
"""
    (solution,) = nsspice.read(text).run()
    found, tau = solution.measures, 10e-3

    def warm(t: float) -> float:
        return 40.0 + 20.0 * -np.expm1(-t / tau)

    mean = 60.0 - 20.0 * tau * (np.exp(-0.5) - np.exp(-1.5)) / 10e-3
    # lines between instants of 20 ms/400: (50 us)^2/12 of the second derivative, 20 K/tau^2
    assert abs(found["mean"] - mean) < (50e-6) ** 2 / 8.0 * 20.0 / tau**2
    expected = {"low": warm(5e-3), "high": warm(15e-3), "step": warm(20e-3) - warm(5e-3)}
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-12)
    # on at 3, 5 and 7 ms
    assert found["three"] == pytest.approx(30e-3, rel=1e-12)
    assert found["power"] == pytest.approx(5.0, rel=1e-12)


def test_a_table_read_beyond_its_grid_is_told() -> None:
    solution = table(BUCK.replace("i=0 10", "i=0 2"))
    (warning,) = [w for w in solution.warnings if w.code == "NS5005"]
    assert "s1, d1" in warning.message


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("Eon=table(i=0 10 e=0 1m 2m)", "3 energies e for 2 points"),
        ("Eon=table(i=10 0 e=0 1m)", "must increase"),
        ("Eon=table(i=-1 1 e=0 1m)", "0 or more"),
        ("Eon=table(u=0 1 e=0 1m)", "no axis u"),
        ("Eon=table(i=0 1 e=0 -1m)", "not be negative"),
        ("Eon=table(0 1)", "named lists"),
        ("Eon=table(i=0 1 i=0 2 e=0 1)", "twice"),
        ("Foster=table(r=1 2 tau=1m)", "as many positive values"),
        ("Cauer=table(r=1 c=0)", "as many positive values"),
        ("Err=table(e=1u)", "no parameter err"),
    ],
)
def test_wrong_tables_are_refused(wrong: str, words: str) -> None:
    text = f"wrong\nV1 a 0 1\nS1 a 0 a 0 SH\nR1 a 0 1\n.model SH SW(VT=0 {wrong})\n.op\n"
    with pytest.raises(nsspice.NetlistError) as caught:
        nsspice.read(text)
    (found,) = caught.value.diagnostics
    assert words in found.message
    assert found.span is not None
    assert found.span.line == 5


SINK = """two devices on one heat sink
I1 0 a 10
S1 a 0 g 0 SA
I2 0 b 5
S2 b 0 g 0 SB
Vg g 0 1
C1 a 0 1n
C2 b 0 1n
.model SA SW(VT=0 RON=0.1 Foster=table(r=0.5 tau=1m))
.model SB SW(VT=0 RON=0.2 Foster=table(r=1 tau=2m))
.heatsink Foster=table(r=2 tau=10m) S1 S2
.options temp=40
"""


def test_a_common_heat_sink_over_a_transient() -> None:
    """10 W and 5 W flow through one network, each besides through its own."""
    _, found = hot(SINK + ".tran 1m 30m\n")
    for name, power, r, tau in (("s1", 10.0, 0.5, 1e-3), ("s2", 5.0, 1.0, 2e-3)):
        one = found[name]
        own = power * r * -np.expm1(-one.times / tau)
        both = 15.0 * 2.0 * -np.expm1(-one.times / 10e-3)
        assert np.abs(one.temperatures - 40.0 - own - both).max() < 1e-12 * 35.0
        # lines between instants of 75 us
        mean = 40.0 + 30.0 * (1.0 + (np.exp(-3.0) - 1.0) / 3.0)
        assert abs(one.sink - mean) < (75e-6) ** 2 / 12.0 * 30.0 / (10e-3) ** 2


def test_a_common_heat_sink_in_steady_state() -> None:
    """Energies that grow with the temperature: two linear equations for both junctions."""
    more = " t=25 125"
    text = f"""two switches in turn
Vin in 0 24
S1 in sw g 0 SH
S2 sw 0 0 g SH
L1 sw out 100u
C1 out 0 100u
R1 out 0 5
Vg g 0 PULSE(-1 1 0 0 0 5u 10u)
.model SH SW(VT=0 RON=30m Eoff=table(i=0 10 v=0 50{more} e=0 0 0 1m 0 0 0 2m)
+ Foster=table(r=0.4 tau=1m))
.heatsink Cauer=table(r=1 0.5 c=10m 0.1) S1 S2
.options temp=40
.pss
"""
    solution, found = hot(text)
    one, two = found["s1"], found["s2"]
    # of each junction: what it would take at 25 C, and its growth by 1 % per kelvin
    rows, right = np.eye(2), np.full(2, 40.0)
    for k, member in enumerate((one, two)):
        cold = sum(c.energy for c in member.commutations) / 10e-6
        cold /= 1.0 + 0.01 * (member.temperature - 25.0)
        for j in range(2):
            through = 1.5 + (0.4 if j == k else 0.0)
            rows[j, k] -= through * 0.01 * cold
            right[j] += through * (member.conduction + cold * (1.0 - 0.25))
    expected = np.linalg.solve(rows, right)
    assert [one.temperature, two.temperature] == pytest.approx(expected, rel=1e-12)
    total = sum(m.conduction + m.switching for m in (one, two))
    assert one.sink == pytest.approx(40.0 + 1.5 * total, rel=1e-12)
    assert one.sink == two.sink
    # the course is periodic, and its average the temperature that the losses keep
    assert one.temperatures[0] == pytest.approx(one.temperatures[-1], rel=1e-9)
    mean = np.trapezoid(one.temperatures, one.times) / 10e-6
    assert mean == pytest.approx(one.temperature, rel=1e-3)  # impulses between lines
    assert solution.powers is not None


@pytest.mark.parametrize(
    ("card", "words"),
    [
        (".heatsink S1 S2", "one of Foster and Cauer"),
        (".heatsink Foster=table(r=1 tau=1) Cauer=table(r=1 c=1) S1", "one of Foster and Cauer"),
        (".heatsink Foster=table(r=1 2 tau=1) S1", "as many positive values r as tau"),
        (".heatsink Foster=table(r=1 tau=1) S9", "no element s9"),
        (".heatsink Foster=table(r=1 tau=1) S1", "s1 is on a heat sink twice"),
    ],
)
def test_wrong_heat_sinks_are_refused(card: str, words: str) -> None:
    with pytest.raises(nsspice.NetlistError) as caught:
        nsspice.read(SINK + card + "\n")
    assert words in str(caught.value)
