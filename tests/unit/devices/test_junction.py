"""The smooth diode: currents and capacitances against ngspice 39.3, effects one by one.

The figures were printed by ngspice with ``numdgt=9``, ``reltol=1e-9`` and ``gmin=1e-30``.  Its
constants k and q are older by 3.4e-7 of k/q: at 40 thermal voltages 1.4e-5 of the current.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle.newton import Static
from oracle.tapes import run

from nsspice.circuit import MnaSystem, build
from nsspice.circuit.explain import explain
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text

VT = 1.380649e-23 * 300.15 / 1.602176634e-19


def assembled(text: str, **conditions: object) -> MnaSystem:
    circuit = build(parse_text(f"title\n{text}\n"))
    assert len(circuit.islands) == 1
    return circuit.islands[0].assemble(**conditions)


def current(card: str, v: float, line: str = "", **conditions: object) -> float:
    """Return the current of a diode at a voltage."""
    mna = assembled(f"V1 a 0 {v!r}\nD1 a 0 dm {line}\n.model dm {card}", **conditions)
    static = Static(mna.system)
    u = [w.values[0] for w in mna.system.waveforms]
    guess = np.zeros(static.n)
    guess[0] = v
    (x,) = static.solutions(u, guesses=[guess])
    return static.output(mna.functional("i(d1)"), x, u)


@pytest.mark.parametrize(
    ("card", "celsius", "v", "expected"),
    [
        ("d(is=1e-12 n=1.7 xti=4 eg=1.05)", 27, 0.2, 9.34923336e-11),
        ("d(is=1e-12 n=1.7 xti=4 eg=1.05)", 27, 0.8, 7.97234883e-05),
        ("d(is=1e-12 n=1.7 xti=4 eg=1.05)", 80, 0.2, 2.46796937e-09),
        ("d(is=1e-12 n=1.7 xti=4 eg=1.05)", 80, 0.8, 2.74367136e-04),
        ("d(is=2e-13 n=1.2 rs=3 bv=6 ibv=2m)", 27, -6.4, -9.354953299e-02),
        ("d(is=2e-13 n=1.2 rs=3 bv=6 ibv=2m)", 27, -6.0, -1.697378943e-03),
        ("d(is=2e-13 n=1.2 rs=3 bv=6 ibv=2m)", 27, -5.8, -3.179933379e-06),
        ("d(is=2e-13 n=1.2 rs=3 bv=6 ibv=2m)", 27, 1.2, 1.19461859e-01),
        ("d(is=2e-13 n=1.2 rs=3 bv=6 ibv=2m)", 80, -6.0, -1.734398303e-03),
        ("d(is=2e-13 n=1.2 rs=3 bv=6 ibv=2m)", 80, 0.6, 8.21632516e-04),
        ("d(is=1e-14 isr=1n nr=2 vj=.8 m=.4)", 27, 0.1, 5.61136955e-09),
        ("d(is=1e-14 isr=1n nr=2 vj=.8 m=.4)", 27, 0.45, 4.68982620e-06),
        ("d(is=1e-14 isr=1n nr=2 vj=.8 m=.4)", 27, 0.8, 2.72633570e-01),
    ],
)
def test_currents_of_ngspice(card: str, celsius: float, v: float, expected: float):
    # breakdown: both programs stop their calibration at about 1e-3 of IBV
    tolerance = 5e-4 if v < -1 else 2e-5
    assert current(card, v, temperature=float(celsius)) == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize(
    ("celsius", "v", "farad"),
    [
        (27, -3.0, 2.055031663e-12),
        (27, -1.0, 2.804914573e-12),
        (27, 0.0, 4.000000002e-12),
        (27, 0.3, 5.003725684e-12),
        (27, 0.5, 6.663338136e-12),
        (27, 0.65, 1.656956064e-10),
        (80, -3.0, 2.081486824e-12),
        (80, 0.3, 5.677824236e-12),
        (80, 0.5, 3.006992498e-11),
        (80, 0.65, 3.175946614e-09),
    ],
)
def test_capacitances_of_ngspice(celsius: float, v: float, farad: float):
    text = "V1 a 0 0\nD1 a 0 dm\n.model dm d(is=1e-14 cjo=4p vj=.7 m=.4 fc=.5 tt=5n)"
    mna = assembled(text, temperature=float(celsius))
    smooth = mna.system.smooth
    assert smooth is not None
    slopes = run(smooth.tape, [v, 0.0])[1]
    capacitance = smooth.Q.dense() @ slopes
    assert capacitance[0, 0] == pytest.approx(farad, rel=2e-5)


def test_the_plain_junction_is_shockleys():
    for v in (-1.0, -0.05, 0.0, 0.3, 0.7):
        expected = 1e-14 * math.expm1(v / VT)
        assert current("d", v) == pytest.approx(expected, rel=1e-12)
        # area and m multiply, the emission coefficient divides
        assert current("d(is=2e-14 n=2)", v, "3 m=2") == pytest.approx(
            12e-14 * math.expm1(v / (2 * VT)), rel=1e-12
        )


def test_high_injection_is_that_of_pspice():
    # ngspice divides by 1 + sqrt(i/IKF) instead; the models that give IKF are PSpice's
    plain = 1e-14 * math.expm1(0.8 / VT)
    assert current("d(ikf=5m)", 0.8) == pytest.approx(plain / math.sqrt(1 + plain / 5e-3))


def test_only_what_the_card_gives_is_simulated():
    plain = assembled("V1 a 0 1\nD1 a 0 dm\n.model dm d")
    assert plain.unknowns == ["v(a)", "i(v1)"]
    assert plain.system.smooth is not None
    assert plain.system.smooth.Q.data.size == 0
    ohmic = assembled("V1 a 0 1\nD1 a 0 dm 2\n.model dm d(rs=4 cjo=1p)")
    assert ohmic.unknowns == ["v(a)", "i(v1)", "v(d1#internal,a)"]
    assert ohmic.functional("i(d1)").z == ((2, -0.5),)
    # nothing holds the node inside
    ohmic = assembled("V1 a 0 1\nD1 a 0 dm 2\n.model dm d(rs=4)")
    assert ohmic.unknowns == ["v(a)", "i(v1)", "v(d1#internal,a)", "i(d1#internal)"]
    assert ohmic.functional("i(d1)").z == ((3, 1.0),)
    assert assembled("V1 a 0 1\nD1 a 0 dm\n.model dm d(rs=0 cjo=0 tt=0)").unknowns == plain.unknowns


def test_breakdown_passes_through_its_point_and_the_origin():
    card = "d(is=1e-14 bv=5 ibv=1m)"
    assert current(card, -5.0) == pytest.approx(-1e-3, rel=1e-9)
    assert abs(current(card, 0.0)) < 1e-25
    steep = "d(is=1e-14 bv=5 ibv=1m nbv=0.1)"
    assert current(steep, -5.0) == pytest.approx(-1e-3, rel=1e-9)
    assert current(steep, -5.1) < -1e9


def test_a_smooth_drop_in_series_with_a_set_valued_curve():
    # 4.2.1 as one diode: p in asinh(i) + Sgn_{-1,1}(i)
    text = "V1 a 0 {v}\nD1 a 0 dm V={{asinh(i)}}\n.model dm d(Vfwd=1 Vrev=1)"
    for v, expected in ((3.0, math.sinh(2.0)), (0.5, 0.0), (-2.5, math.sinh(-1.5))):
        mna = assembled(text.format(v=v))
        static = Static(mna.system)
        (x,) = static.solutions([v])
        assert static.output(mna.functional("i(d1)"), x) == pytest.approx(expected, abs=1e-13)
    assert mna.pairs == ["d1.fwd", "d1.rev"]
    assert mna.unknowns == ["v(a)", "i(v1)", "i(d1)", "v(d1#drop)"]


def test_a_drop_on_the_model_card_and_parallel_diodes():
    text = "I1 0 a 6\nD1 a 0 dm 2\n.model dm d(Vfwd=1 Ron=1 V={i^2})"
    mna = assembled(text)
    static = Static(mna.system)
    guess = np.array([13.0, 6.0, 4.0, 6.0])
    (x,) = static.solutions([6.0], guesses=[guess])
    assert x[0] == pytest.approx(1 + 3 + 9)  # each of two carries 3 A


def test_initial_charges():
    text = "V1 a 0 1\nR1 a b 1\nD1 b 0 dm 2 {}\nR2 b 0 1\n.model dm d(cjo=1p vj=1 m=.5 rs=1)"
    mna = assembled(text.format("ic=-3"))
    inner = mna.unknowns.index("v(d1#internal,b)")
    # Q = 2 VJ CJ0 (1 - sqrt(1 - v/VJ)) for M = 1/2
    assert mna.initial_charges()[inner] == pytest.approx(2 * 2e-12 * (1 - 2.0))
    mna = assembled(text.format(""))
    assert mna.initial_charges({"b": -8.0})[inner] == pytest.approx(2 * 2e-12 * (1 - 3.0))
    assert mna.initial_charges()[inner] == 0.0


def test_parameters_that_are_not_simulated_are_named():
    with pytest.raises(NetlistError) as caught:
        assembled("V1 a 0 1\nD1 a 0 dm\n.model dm d(jtun=1p ikr=1u iz=3 level=2)")
    assert sorted(d.code for d in caught.value.diagnostics) == ["NS2003", *["NS2008"] * 3]
    text = "t\nV1 a 0 1\nD1 a 0 dm\n.model dm d(iave=1 kf=1n mfg=acme ibv=3)\n"
    warnings = build(parse_text(text)).warnings
    assert [w.code for w in warnings] == ["NS2052", "NS2052"]
    assert "iave, kf, mfg" in warnings[0].message


def test_explain_lists_the_effects_with_their_parameters():
    text = "t\nV1 a 0 1\nD1 a 0 dm 2\n.model dm d(is=1e-12 n=1.5 rs=2 cjo=3p tt=1n bv=50)\n"
    circuit = build(parse_text(text))
    shown = explain(circuit).text()
    assert "DNCP" in shown
    for part in (
        "exponential junction (is=2e-12 A)",
        "emission coefficient (n=1.5)",
        "ohmic resistance (rs=1 Ohm)",
        "junction charge (cjo=6e-12 F)",
        "diffusion charge (tt=1e-09 s)",
        "SPICE breakdown (bv=50 V)",
    ):
        assert part in shown
    assert circuit.default_signals() == ["v(a)", "i(v1)", "i(d1)"]


@pytest.mark.parametrize(
    ("card", "line", "code"),
    [
        ("d(level=1)", "", ""),
        ("d(level=3)", "", ""),  # ngspice: as level 1, with area= from w= and l=
        ("d(level=2)", "", "NS2008"),  # tunnelling in HSPICE
        ("d(level=3)", "w=1u l=2u", "NS2008"),
    ],
)
def test_levels(card: str, line: str, code: str):
    text = f"V1 a 0 0.6\nD1 a 0 dm {line}\n.model dm {card}"
    if code:
        with pytest.raises(NetlistError) as caught:
            assembled(text)
        assert [d.code for d in caught.value.diagnostics] == [code]
    else:
        assert current(card, 0.6) == current("d", 0.6)


@pytest.mark.parametrize(
    ("card", "v", "at_27", "at_80"),
    [
        ("d(is=2e-13 n=1.2 rs=3 trs1=4m trs2=5u)", 1.2, 1.194618587e-01, 1.147564982e-01),
        ("d(is=2e-13 n=1.2 bv=6 ibv=2m tcv=2m)", -6.1, -5.014980252e-02, -5.634703209e-01),
        ("d(is=2e-13 n=1.2 bv=6 ibv=2m tcv=2m)", -5.8, -3.180910913e-06, -1.524536623e-04),
        ("d(is=2e-13 n=1.2 bv=6 ibv=2m tcv=2m tlev=1)", -5.6, -5.059097221e-09, -1.281281654),
    ],
)
def test_temperature_coefficients_of_ngspice(card: str, v: float, at_27: float, at_80: float):
    assert current(card, v, temperature=27.0) == pytest.approx(at_27, rel=5e-5)
    assert current(card, v, temperature=80.0) == pytest.approx(at_80, rel=2e-5)


@pytest.mark.parametrize(
    ("card", "v", "at_27", "at_80"),
    [
        ("d(is=1e-20 cjo=4p vj=.7 m=.4 tm1=1m tm2=2u)", -3.0, 2.055031663e-12, 2.003035032e-12),
        ("d(is=1e-14 tt=5n ttt1=2m ttt2=3u)", 0.6, 0.0, 0.0),
        (
            "d(is=1e-20 cjo=4p vj=.7 m=.4 tlevc=1 cta=1m tpb=2m)",
            0.2,
            4.576265423e-12,
            4.963687729e-12,
        ),
        (
            "d(is=1e-20 cjo=4p vj=.7 m=.4 tlevc=1 cta=1m tpb=2m)",
            0.6,
            6.786040684e-12,
            7.825785500e-12,
        ),
    ],
)
def test_charges_follow_their_coefficients(card: str, v: float, at_27: float, at_80: float):
    for celsius, farad in ((27.0, at_27), (80.0, at_80)):
        mna = assembled(f"V1 a 0 0\nD1 a 0 dm\n.model dm {card}", temperature=celsius)
        smooth = mna.system.smooth
        assert smooth is not None
        values, slopes = run(smooth.tape, [v, 0.0])
        capacitance = (smooth.Q.dense() @ slopes)[0, 0]
        if farad:
            assert capacitance == pytest.approx(farad, rel=1e-9)
        else:  # the diffusion charge is TT times the current
            transit = 5e-9 * (1 + 2e-3 * (celsius - 27) + 3e-6 * (celsius - 27) ** 2)
            charge = (smooth.Q.dense() @ values)[0]
            assert charge == pytest.approx(transit * (smooth.F.dense() @ values)[0], rel=1e-12)


def test_breakdown_follows_the_coefficients_of_pspice():
    # BV (1 + TBV1 dT + TBV2 dT^2) is where the current is IBV
    card = "d(is=1e-14 xti=0 eg=0.1 bv=5 ibv=1m tbv1=-1m tbv2=4u)"
    at = 5 * (1 - 1e-3 * 50 + 4e-6 * 2500)
    assert current(card, -at, temperature=77.0) == pytest.approx(-1e-3, rel=1e-9)
    # IKF (1 + TIKF dT)
    knee = 5e-3 * (1 + 2e-2 * 50)
    plain = current("d", 0.7, temperature=77.0)
    risen = current("d(ikf=5m tikf=20m)", 0.7, temperature=77.0)
    assert risen == pytest.approx(plain / math.sqrt(1 + plain / knee), rel=1e-12)


def test_the_soft_knee_of_pspice():
    # a 1N750: IBVL exp(-(v + BV) / (NBVL Vt)) beside the breakdown, less its value at 0 V
    card = "d(is=1e-30 bv=8.1 ibv=20m nbv=1.7 ibvl=2m nbvl=15)"
    for v in (-8.1, -7.5, -6.0):
        low = 2e-3 * (math.exp(-(v + 8.1) / (15 * VT)) - math.exp(-8.1 / (15 * VT)))
        steep = 20e-3 * math.exp(-(v + 8.1) / (1.7 * VT))
        assert current(card, v) == pytest.approx(-low - steep, rel=1e-9)
    # at 8.1 V IBV is reached without it
    assert current(card, 0.0) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("word", ["tlev=2", "tlevc=3", "jtun=1n", "lm=1u", "vp=.5"])
def test_other_parameters_of_ngspice_are_named(word: str):
    with pytest.raises(NetlistError) as caught:
        assembled(f"V1 a 0 1\nD1 a 0 dm\n.model dm d({word})")
    assert [d.code for d in caught.value.diagnostics] == ["NS2008"]
    assert word.split("=")[0] in caught.value.diagnostics[0].message
