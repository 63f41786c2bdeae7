import json

from nsspice.circuit import build
from nsspice.circuit.explain import explain
from nsspice.netlist import parse_text

TEXT = """rectifier and filter
V1 a 0 SIN(0 10 50)
D1 a b dm
D2 a b dm
R1 b 0 1k
C1 b 0 1u IC=2
V2 c 0 5
R2 c 0 1k
V3 d 0 5
R3 d 0 1k
.model dm d(vfwd=0.7 roff=1meg)
.tran 1u 1m
"""


def test_text_names_class_reason_and_effects():
    text = explain(build(parse_text(TEXT))).text()
    assert "3 islands" in text
    assert "class     DLCP, dynamic linear" in text
    assert "c1 stores energy" in text
    assert "diode d1, d2: conduction, forward drop (vfwd=0.7 V), leakage (roff=1e+06 Ohm)" in text
    assert "capacitor c1: capacitance 1e-06 F, initial voltage (ic=2 V)" in text
    assert "and 1 island like it: 3" in text


def test_matrices():
    text = explain(build(parse_text(TEXT)), matrices=True).text()
    assert "x = (v[c1])" in text
    assert "u = (i[d1], i[d2])" in text
    assert "y  = C x + D u + G s + c" in text


def test_reason_why_there_is_no_dlcp_form():
    deck = "t\nV1 a 0 1\nR1 a b 1\nD1 b 0\nE1 c 0 b 0 2\nC1 c 0 1u\nF1 0 x E1 1\nC2 x 0 1u\n"
    shown = explain(build(parse_text(deck)), matrices=True)
    assert "no DLCP form" in shown.text()
    assert shown.islands[0].form is None


def test_json():
    shown = explain(build(parse_text(TEXT + "R9 q 0 1\n")), matrices=True).to_dict()
    again = json.loads(json.dumps(shown))
    assert again["islands"][0]["class"] == "DLCP"
    assert again["islands"][0]["unknowns"] == ["v(a)", "v(b)", "i(v1)"]
    assert again["islands"][0]["dlcp"]["states"] == ["v[c1]"]
    assert again["warnings"][0]["code"] == "NS2050"
