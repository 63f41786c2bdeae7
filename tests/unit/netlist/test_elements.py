"""Element lines: every letter in every form."""

from __future__ import annotations

import pytest

from nsspice.netlist import Element, Expression, NetlistError, parse_text

EXTRA = """
Vx vx 0 1
Lx vx 0 1
Ly vx 0 1
.model dm D
.model sm SW
.model wm CSW
.model qm NPN
.model rm R
.param p=3
"""


def element(line: str) -> Element:
    """Return the element of one line, in a deck with sources and models to refer to."""
    return parse_text(f"title\n{line}{EXTRA}").elements[0]


def code(line: str) -> str:
    """Return the code of the first error of one line."""
    with pytest.raises(NetlistError) as caught:
        parse_text(f"title\n{line}{EXTRA}")
    return caught.value.code


def params(found: Element) -> dict[str, object]:
    return {k: getattr(p.value, "text", p.value) for k, p in found.params.items()}


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("R1 a b 1k", 1e3),
        ("R1 a b {p*2}", 6.0),
        ("R1 a b 'p*2'", 6.0),
        ('R1 a b "p*2"', 6.0),
        ("R1 a b R={p}", 3.0),
        ("R1 a b r = 5", 5.0),
        ("R1 a b R='p+1'", 4.0),
        ("R1 (a b) 1k", 1e3),
        ("R1 a, b, 1k", 1e3),
        ("C1 a b 1u", 1e-6),
        ("C1 a b C=1u", 1e-6),
        ("L1 a b 1m", 1e-3),
        ("  L1\ta b 1m", 1e-3),
        ("R1 a b rm 5", 5.0),
        ("R1 a b 5 rm", 5.0),
        ("R1 a b p", 3.0),
        ("R1 a b r=p", 3.0),
        ("L1 a b P ic=1", 3.0),
    ],
)
def test_passive_values(line: str, value: float) -> None:
    found = element(line)
    assert found.nodes == ("a", "b")
    assert found.value == value
    assert found.quantity == ""


def test_parameters_of_passive_elements() -> None:
    assert params(element("C1 a b 1u ic=5")) == {"ic": 5.0}
    assert params(element("R1 a b 1k tc1=1m tc2={p}")) == {"tc1": 1e-3, "tc2": 3.0}
    assert params(element("R1 a b 1k tc=1m,2u")) == {"tc1": 1e-3, "tc2": 2e-6}
    assert params(element("R1 a b 1k tc=1m")) == {"tc1": 1e-3}
    assert params(element("L1 a b 1m ic = p")) == {"ic": 3.0}


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("R1 a b 1k tol=1 pwr=0.125", 1e3),
        ("C1 a b 1u V=25 Irms=3", 1e-6),
        ("L1 a b 1m Ipk=3 Irms=2", 1e-3),
    ],
)
def test_ratings_of_parts_are_no_law(line: str, value: float) -> None:
    """LTspice writes them beside the value of a part from its catalogue."""
    found = element(line)
    assert found.value == value
    assert found.model is None
    assert params(found) == {}


def test_a_resistor_without_noise() -> None:
    found = element("R1 a b 1k noiseless")
    assert found.value == 1e3
    assert found.model is None
    assert params(found) == {"noisy": 0.0}


def test_resistor_by_expression() -> None:
    found = element("R1 a b V={i**3+p*i}")
    assert isinstance(found.value, Expression)
    assert found.quantity == "v"
    assert found.value.variables() == {"i"}
    assert found.value.evaluate({"i": 2.0}) == 14.0
    assert found.value.derivative("i").evaluate({"i": 2.0}) == 15.0
    found = element("R1 a b R='1+v(a)'")
    assert isinstance(found.value, Expression)
    assert found.quantity == ""


def test_ground_and_case() -> None:
    found = element("R1 GND OUT 1")
    assert found.name == "r1"
    assert found.nodes == ("0", "out")
    assert element("R1 Net-_R1-Pad1_ /out 1").nodes == ("net-_r1-pad1_", "/out")


def test_coupling() -> None:
    found = element("K1 Lx Ly 0.9")
    assert (found.nodes, found.controls, found.value) == ((), ("lx", "ly"), 0.9)
    assert code("K1 Lx Lz 0.9") == "NS1070"
    assert code("K1 Lx 0.9") == "NS1008"


@pytest.mark.parametrize(
    ("line", "dc", "kind", "values"),
    [
        ("V1 a 0 5", 5.0, "", ()),
        ("V1 a 0 ( 9 )", 9.0, "", ()),
        ("V1 a 0 DC 5", 5.0, "", ()),
        ("V1 a 0 DC={p}", 3.0, "", ()),
        ("V1 a 0", None, "", ()),
        ("V1 a 0 p", 3.0, "", ()),
        ("V1 a 0 PULSE(0 p 0 0 0 1u 2u)", None, "pulse", (0, 3, 0, 0, 0, 1e-6, 2e-6)),
        ("V1 a 0 DC", None, "", ()),
        ("V1 a 0 DC pwl 0 0 50u 5V", None, "pwl", (0, 0, 5e-5, 5)),
        ("V1 a 0 DC AC 1 SIN(0 5 50)", None, "sin", (0, 5, 50)),
        ("I1 a 0 AC 1 90", None, "", ()),
        ("V1 a 0 DC 1 AC 1 SIN(0 5 50)", 1.0, "sin", (0, 5, 50)),
        ("V1 a 0 SINE(0,5,50)", None, "sin", (0, 5, 50)),
        ("V1 a 0 sin 0 5 50 dc 2", 2.0, "sin", (0, 5, 50)),
        ("V1 a 0 2 PULSE (0 {p} 0 0 0 1u 2u)", 2.0, "pulse", (0, 3, 0, 0, 0, 1e-6, 2e-6)),
        ("V1 a 0 EXP(0 1 0 1m)", None, "exp", (0, 1, 0, 1e-3)),
        ("V1 a 0 SFFM(0 1 1k 5 100)", None, "sffm", (0, 1, 1e3, 5, 100)),
        ("V1 a 0 AM(1 0 50 1k)", None, "am", (1, 0, 50, 1e3)),
        ("I1 a 0 PWL(0 0, 1u 1m)", None, "pwl", (0, 0, 1e-6, 1e-3)),
    ],
)
def test_sources(line: str, dc: float | None, kind: str, values: tuple[float, ...]) -> None:
    source = element(line).source
    assert source is not None
    assert (source.dc, source.kind, source.values) == (dc, kind, values)


def test_source_options() -> None:
    source = element("V1 a 0 PWL(0 0 1 1) r=0 td=2").source
    assert source is not None
    assert source.options == {"r": 0.0, "td": 2.0}
    assert element("V1 a 0 AC 2").source.ac == (2.0, 0.0)
    assert element("V1 a 0 AC").source.ac == (1.0, 0.0)


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ("V1 a 0 pulze(0 1)", "NS1009"),
        ("V1 a 0 SIN(0)", "NS1008"),
        ("V1 a 0 PWL(0 1 2)", "NS1008"),
        ("V1 a 0 AM(1 2 3 4 0 0 0 0)", "NS1008"),
        ("V1 a 0 SIN(0 1 1) PULSE(0 1)", "NS1009"),
        ("V1 a 0 5 r=3", "NS1014"),
        ("V1 a 0 {v(a)}", "NS1025"),
        ("V1 a 0 PWL file=x.txt", "NS1050"),
        ("V1 a 0 1,5", "NS1013"),
        ("R1 a 0 1,5", "NS1013"),
        ("R1 a 0 10 k", "NS1009"),
        ("R1 a 0 1k 2k", "NS1009"),
        ("R1 a 0 1k tc3=1", "NS1014"),
        ("R1 a 0 1k tc1=1 tc1=2", "NS1014"),
        ("R1 a 0 1k r=1k", "NS1009"),
        ("R1 a 0 q", "NS1060"),
        ("R1 a 0 r=q", "NS1021"),
        ("V1 a 0 q", "NS1021"),
        ("R1 a 0", "NS1008"),
        ("R1 a", "NS1008"),
        ("R1 a 0 {p+}", "NS1020"),
        ("R1 a 0 {q}", "NS1021"),
        ("R1 a 0 {sine(1)}", "NS1022"),
        ("R1 a 0 {1/0}", "NS1024"),
        ("R1 a 0 1e999", "NS1010"),
        ("R1 a 0 (1k", "NS1007"),
        ("R1 a 0 1k)", "NS1007"),
        ("R1 a 0 'p", "NS1007"),
        ("R1 a 0 1k =", "NS1007"),
        ("M1 a b c d mx", "NS1060"),
        ("J1 a b c jx", "NS1060"),
        ("A1 [a] [b] gate", "NS1060"),
        ("T1 a 0 b 0 z0=50", "NS1008"),
        ("N1 a 0 b 0 z0=50", "NS1005"),
        ("?1 a b", "NS1004"),
        ("D1 a 0 dx", "NS1060"),
        ("S1 a 0 b 0", "NS1008"),
        ("W1 a 0 Vz wm", "NS1070"),
        ("E1 a 0 b 0", "NS1008"),
        ("E1 a 0 CUR='1'", "NS1014"),
        ("E1 a 0 TABLE {v(a)} = (0,0) (1)", "NS1008"),
        ("E1 a 0 TABLE {v(a)} = (1,0) (0,1)", "NS1024"),
        ("B1 a 0 v(a)", "NS1008"),
        ("B1 a 0 V=v(zz)", "NS1071"),
        ("B1 a 0 V=i(vz)", "NS1070"),
        ("B1 a 0 V=1 I=2", "NS1009"),
        ("B1 a 0 V=1 W=2", "NS1014"),
        ("B1 a 0 V=limit(v(a),2)", "NS1022"),
        ("B1 a 0 V=idtmod(v(a),1m)", "NS1022"),
        ("X1 a b nothing", "NS1040"),
    ],
)
def test_refused(line: str, wanted: str) -> None:
    assert code(line) == wanted


def test_a_decimal_comma_in_a_waveform_is_a_warning() -> None:
    deck = parse_text("title\nV1 a 0 SIN(0 1,5 50)")
    assert [w.code for w in deck.warnings] == ["NS1013"]
    assert not parse_text("title\nV1 a 0 SIN(0,1,50)").warnings
    assert not parse_text("title\nV1 a 0 PWL(0 0, 1 1, 2 2)").warnings


def test_diodes() -> None:
    found = element("D1 a b")
    assert found.model is None
    found = element("D1 a b dm 2 off ic=0.6")
    assert found.model is not None
    assert found.model.name == "dm"
    assert params(found) == {"area": 2.0, "ic": 0.6}
    assert list(found.flags) == ["off"]
    assert params(element("D1 a b dm V={i*p} Vfwd=0.7")) == {"v": "i*p", "vfwd": 0.7}


def test_transistors() -> None:
    found = element("Q1 c b e qm")
    assert found.nodes == ("c", "b", "e")
    found = element("Q1 c b e s qm 2 off ic=0.7,5")
    assert found.nodes == ("c", "b", "e", "s")
    assert params(found) == {"area": 2.0, "ic": 0.7, "icvce": 5.0}
    assert element("Q1 c b e qm 2").nodes == ("c", "b", "e")


def test_switches() -> None:
    found = element("S1 a b c 0 sm ON")
    assert (found.nodes, found.controls, list(found.flags)) == (("a", "b"), ("c", "0"), ["on"])
    assert len(found.node_spans) == 4
    found = element("W1 a b Vx wm off")
    assert (found.nodes, found.controls, list(found.flags)) == (("a", "b"), ("vx",), ["off"])


def test_linear_controlled_sources() -> None:
    for line in (
        "E1 a 0 c d 10",
        "G1 a 0 c d 10",
        "E1 a 0 POLY(1) c d 0 10",
        "E1 a 0 POLY(1) c d 10",
        "E1 a 0 (c,d) 10",
    ):
        found = element(line)
        assert (found.nodes, found.controls, found.value) == (("a", "0"), ("c", "d"), 10.0)
        assert found.quantity == ""
    for line in ("F1 a 0 Vx 10", "H1 a 0 Vx {10}", "F1 a 0 POLY(1) Vx 0 10"):
        found = element(line)
        assert (found.nodes, found.controls, found.value) == (("a", "0"), ("vx",), 10.0)


@pytest.mark.parametrize(
    ("line", "quantity", "text"),
    [
        ("E1 a 0 VALUE={v(c)*2}", "v", "v(c)*2"),
        ("E1 a 0 VALUE {v(c)*2}", "v", "v(c)*2"),
        ("E1 a 0 VALUE = v(c) * 2", "v", "v(c) * 2"),
        ("E1 a 0 VOL='v(c)*2'", "v", "v(c)*2"),
        ("G1 a 0 CUR='v(c)*2'", "i", "v(c)*2"),
        ("E1 a 0 TABLE {v(c)} = (0,0) (1,2)", "v", "pwl(v(c), 0, 0, 1, 2)"),
        ("E1 a 0 TABLE {v(c)} (0,0) (1,2)", "v", "pwl(v(c), 0, 0, 1, 2)"),
        ("E1 a 0 c 0 TABLE=(0,0,1,2)", "v", "pwl(v(c), 0, 0, 1, 2)"),
        ("G1 a 0 POLY(1) c 0 1 2 3", "i", "1 + 2*v(c) + 3*v(c)*v(c)"),
        ("E1 a 0 POLY(2) c 0 a c 0 1 2 0 5", "v", "v(c) + 2*v(a,c) + 5*v(c)*v(a,c)"),
        ("H1 a 0 POLY(1) Vx 1 2", "v", "1 + 2*i(vx)"),
        ("F1 a 0 POLY(2) Vx Lx 0 1 1", "i", "i(vx) + i(lx)"),
        ("B1 a 0 V=v(c)*2", "v", "v(c)*2"),
        ("B1 a 0 I = V(c) > 0 ? 1 : {p}", "i", "V(c) > 0 ? 1 : {p}"),
        ("B1 a 0 V={v(c,a)+i(vx)*time} tc1=0", "v", "v(c,a)+i(vx)*time"),
    ],
)
def test_expressions_as_values(line: str, quantity: str, text: str) -> None:
    found = parse_text(f"title\n{line}\nRc c 0 1{EXTRA}").elements[0]
    assert isinstance(found.value, Expression)
    assert (found.quantity, found.value.text) == (quantity, text)


def test_expressions_without_signals_are_numbers() -> None:
    found = element("B1 a 0 V={p*2}")
    assert (found.value, found.quantity) == (6.0, "v")
    found = element("E1 a 0 VALUE={p}")
    assert (found.value, found.quantity) == (3.0, "v")


def test_duplicates_name_both_lines() -> None:
    with pytest.raises(NetlistError) as caught:
        parse_text("title\nR1 a 0 1\nC1 a 0 1\nr1 a 0 2")
    (found,) = caught.value.diagnostics
    assert (found.code, found.span.line) == ("NS1006", 4)
    assert "line 2" in found.message


def test_all_errors_at_once_in_order_of_discovery() -> None:
    with pytest.raises(NetlistError) as caught:
        parse_text("title\nR1 a 0\nD1 a 0 zz\n.trann 1\n.save v(a)")
    assert [d.code for d in caught.value.diagnostics] == ["NS1008", "NS1060", "NS1001"]
    assert "did you mean .tran?" in str(caught.value)


def test_an_error_does_not_cause_others() -> None:
    """A node of a line that cannot be read is not missing as well."""
    with pytest.raises(NetlistError) as caught:
        parse_text("title\nR1 a 0\nX1 b 0 none\n.ic v(a)=1 v(b)=2 v(x1.c)=1\n.meas tran m max v(a)")
    assert [d.code for d in caught.value.diagnostics] == ["NS1008", "NS1040"]
