"""Proved bounds against orbits of random circuits, from the textbooks' state equations."""

import numpy as np
import pytest
from scipy.linalg import expm

import nsspice

RL, RON, RD, VF = 20e-3, 30e-3, 10e-3, 0.6
TAIL = """
Vg g 0 PULSE(-1 1 0 0 0 {{don*{T}}} {T})
.model SWITCH SW(VT=0 RON=30m)
.model DIODE D(Ron=10m Vfwd=0.6)
.pss
.measure pss mean AVG v(out)
.measure pss ripple PP v(out)
"""
BUCK = """Buck converter
.param don=0.5
Vin in 0 24
S1 in sw g 0 SWITCH
D1 0 sw DIODE
L1 sw x {L}
RL x out 20m
C1 out 0 {C}
R1 out 0 {R}"""
BOOST = """Boost converter
.param don=0.5
Vin in 0 12
L1 in x {L}
RL x sw 20m
S1 sw 0 g 0 SWITCH
D1 sw out DIODE
C1 out 0 {C}
R1 out 0 {R}"""
FLYBACK = """Flyback converter: an ideal transformer, and the inductance that magnetises it
.param don=0.4
Vin in 0 24
L1 in p {L}
RL p x 20m
S1 x 0 g 0 SWITCH
Es s 0 x in 0.5
Fp in x Es 0.5
D1 s out DIODE
C1 out 0 {C}
R1 out 0 {R}"""
CASES = {
    "buck": (BUCK, (24.0, 100e-6, 100e-6, 5.0, 0.5), 10e-6),
    "discontinuous buck": (BUCK, (24.0, 40e-6, 10e-6, 60.0, 0.5), 10e-6),
    "boost": (BOOST, (12.0, 100e-6, 20e-6, 20.0, 0.5), 10e-6),
    "flyback": (FLYBACK, (24.0, 150e-6, 47e-6, 5.0, 0.4), 20e-6),
}
NAMES = ("vin", "l1", "c1", "r1", "don")
TOLERANCES = (0.05, 0.1, 0.1, 0.05, 0.05)


def deck(name):
    frame, (_, L, C, R, _), T = CASES[name]
    return (frame + TAIL).format(L=L, C=C, R=R, T=T)


def modes(name, p):
    """Matrices of (i, v, 1, integral of v) while the switch is closed, while the diode conducts,
    and while neither does, for many parameters at once."""
    vin, L, C, R, _ = p
    shape = (p.shape[1], 4, 4)
    on, off, idle = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for A in (on, off, idle):
        A[:, 1, 1] = -1.0 / (R * C)
        A[:, 3, 1] = 1.0
    if "buck" in name:
        for A, r, u in ((on, RON, vin), (off, RD, -VF)):
            A[:, 0, 0], A[:, 0, 1], A[:, 0, 2], A[:, 1, 0] = -(RL + r) / L, -1 / L, u / L, 1 / C
    elif name == "boost":
        on[:, 0, 0], on[:, 0, 2] = -(RL + RON) / L, vin / L
        off[:, 0, 0], off[:, 0, 1], off[:, 0, 2] = -(RL + RD) / L, -1 / L, (vin - VF) / L
        off[:, 1, 0] = 1 / C
    else:
        # the secondary carries twice the current at half of the voltage
        on[:, 0, 0], on[:, 0, 2] = -(RL + RON) / L, vin / L
        off[:, 0, 0], off[:, 0, 1], off[:, 0, 2] = -(RL + 4 * RD) / L, -2 / L, -2 * VF / L
        off[:, 1, 0] = 2 / C
    return on, off, idle


def orbits(name, p, T):
    """Averages and ripples of v for parameters (5, n)."""
    on, off, idle = modes(name, p)
    t1, rest = p[4] * T, (1 - p[4]) * T
    E1 = expm(on * t1[:, None, None])
    z = np.zeros((p.shape[1], 4, 1))
    z[:, 2] = 1.0
    if name == "discontinuous buck":
        # i = 0 at the beginning; unknown are v and how long the diode conducts
        z[:, 1, 0], t2 = 16.0, 0.3 * t1
        for _ in range(12):
            E2, E3 = expm(off * t2[:, None, None]), expm(idle * (rest - t2)[:, None, None])
            z1 = E2 @ E1 @ z
            f = np.stack([z1[:, 0, 0], (E3 @ z1 - z)[:, 1, 0]], 1)
            by_v = (E2 @ E1)[:, :, 1:2]
            J = np.empty((p.shape[1], 2, 2))
            J[:, 0, 0], J[:, 0, 1] = by_v[:, 0, 0], (off @ z1)[:, 0, 0]
            J[:, 1, 0] = (E3 @ by_v)[:, 1, 0] - 1.0
            J[:, 1, 1] = (E3 @ (off - idle) @ z1)[:, 1, 0]
            step = np.linalg.solve(J, f[:, :, None])
            z[:, 1, 0] -= step[:, 0, 0]
            t2 = t2 - step[:, 1, 0]
        parts = [(on, t1), (off, t2), (idle, rest - t2)]
    else:
        whole = expm(off * rest[:, None, None]) @ E1
        z[:, :2] = np.linalg.solve(np.eye(2) - whole[:, :2, :2], whole[:, :2, 2:3])
        parts = [(on, t1), (off, rest)]
    first, values = z, [z[:, 1, 0]]
    for A, d in parts:
        step = expm(A * (d / 32)[:, None, None])
        for _ in range(32):
            before, z = z, step @ z
            values.append(z[:, 1, 0])
            # where the rate changes its sign the vertex of the parabola through both rates
            one, two = (A @ before)[:, 1, 0], (A @ z)[:, 1, 0]
            if A is not idle:
                share = np.clip(np.where(one * two < 0, one / (one - two), 0.0), 0.0, 1.0)
                values.append(before[:, 1, 0] + 0.5 * share * one * d / 32)
    # the orbits are closed to rounding: the samples are what they claim to be
    assert np.abs(z[:, 1] - first[:, 1]).max() < 1e-9
    assert z[:, 0].min() > -1e-9
    values = np.array(values)
    return z[:, 3, 0] / T, values.max(axis=0) - values.min(axis=0)


def compared(name, count, tolerances, seed=3):
    """Bounds of mean and ripple, and those of samples."""
    _, nominal, T = CASES[name]
    box = {n: t for n, t in zip(NAMES, tolerances, strict=True) if t}
    found = nsspice.bounds(nsspice.read(deck(name)), box)
    rng = np.random.default_rng(seed)
    spread = np.array(tolerances)[:, None] * rng.uniform(-1.0, 1.0, (5, count))
    both = orbits(name, np.array(nominal)[:, None] * (1.0 + spread), T)
    return found, both


def check(name, count, tolerances, mean, ripple):
    found, both = compared(name, count, tolerances)
    assert found.decided == 1.0
    assert not found.undecided
    for measure, values, most in zip(("mean", "ripple"), both, (mean, ripple), strict=True):
        bound = found[measure]
        # samples are exact to 1e-10 of their size (matrix exponentials and a linear solve)
        slack = 1e-9 * values.max()
        assert bound.low - slack <= values.min()
        assert values.max() <= bound.high + slack
        assert bound.high - bound.low <= most * np.ptp(values)
        assert bound.low <= bound.least < bound.most <= bound.high


@pytest.mark.parametrize("name", CASES)
def test_no_sample_leaves_the_bounds(name):
    # few samples come near the corners: what they span is less than what there is
    check(name, 100, (0.05, 0.1, 0.0, 0.0, 0.02), 1.3, 1.3)


@pytest.mark.soak
@pytest.mark.parametrize("name", CASES)
def test_no_sample_of_many_leaves_the_bounds(name):
    check(name, 100_000, TOLERANCES, 1.1, 1.3)


def test_the_edge_of_discontinuous_conduction_is_not_decided():
    text = (BUCK + TAIL).format(L=100e-6, C=100e-6, R=38, T=10e-6)
    found = nsspice.bounds(nsspice.read(text), {"r1": 0.1})
    # the current touches zero at the end of the period where its ripple is twice the mean
    assert 0.8 < found.decided < 1.0
    for part in found.undecided:
        low, high = part["r1"]
        assert orbits("buck", np.array([[24.0], [1e-4], [1e-4], [low], [0.5]]), 1e-5)
        with pytest.raises(AssertionError):  # the current of continuous conduction is negative
            orbits("buck", np.array([[24.0], [1e-4], [1e-4], [high], [0.5]]), 1e-5)


def test_peaks_and_inductor_currents():
    text = deck("buck").replace(
        ".measure pss mean AVG v(out)",
        ".measure pss top MAX i(l1)\n.measure pss bottom MIN i(l1)\n.measure pss swing PP i(l1)",
    )
    found = nsspice.bounds(nsspice.read(text), {"l1": (90e-6, 110e-6)}, ["top", "bottom", "swing"])
    ends = nsspice.sweep(text, {"l1": [90e-6, 110e-6]})
    # each is monotone in L: both ends are attained, to the 2 % that are allowed for remainders
    for name in ("top", "bottom", "swing"):
        low, high = sorted(ends[name].tolist())
        bound = found[name]
        assert bound.low <= low * (1 + 1e-12)
        assert high * (1 - 1e-12) <= bound.high
        assert bound.high - bound.low <= 1.04 * (high - low)


def test_model_parameters_and_edges_with_a_slope():
    text = deck("boost").replace("PULSE(-1 1 0 0 0", "PULSE(-1 1 0 100n 100n")
    found = nsspice.bounds(nsspice.read(text), {"diode(vfwd)": 0.2, "switch(ron)": 0.3}, ["mean"])
    circuit = nsspice.read(text)
    table = nsspice.sweep(
        circuit, {"diode(vfwd)": [0.48, 0.6, 0.72], "switch(ron)": [0.021, 0.03, 0.039]}
    )
    mean = found["mean"]
    assert mean.low <= table["mean"].min()
    assert table["mean"].max() <= mean.high
    assert mean.high - mean.low <= 1.04 * np.ptp(table["mean"])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("AVG v(out)", "RMS v(out)", "not an AVG"),
        ("AVG v(out)", "AVG v(out) from=1u to=2u", "over a period"),
        ("Vin in 0 24", "Vin in 0 SIN(24 1 100k)", "sin source"),
        (".pss", ".step param don list 0.4 0.5\n.pss", "without .step"),
    ],
)
def test_what_has_no_enclosure_is_refused(old, new, said):
    circuit = nsspice.read(deck("buck").replace(old, new))
    with pytest.raises(nsspice.UsageError, match=said) as caught:
        nsspice.bounds(circuit, {"r1": 0.05})
    assert caught.value.diagnostics[0].code == "NS4043"


def test_names_and_tolerances_are_checked():
    circuit = nsspice.read(deck("buck"))
    with pytest.raises(nsspice.UsageError, match=r"no \.measure pss maen"):
        nsspice.bounds(circuit, {"r1": 0.05}, ["maen"])
    with pytest.raises(nsspice.UsageError, match="tolerance of r1"):
        nsspice.bounds(circuit, {"r1": (2.0, 1.0)})
    with pytest.raises(nsspice.UsageError, match="1 to 8"):
        nsspice.bounds(circuit, {})


def test_a_function_without_an_enclosure_is_named():
    circuit = nsspice.read(deck("buck").replace("Vin in 0 24", ".param a=1\nVin in 0 {24*sin(a)}"))
    with pytest.raises(nsspice.UsageError, match="enclosure"):
        nsspice.bounds(circuit, {"a": 0.05})
