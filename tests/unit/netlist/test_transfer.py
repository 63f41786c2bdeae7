"""Transfer functions of s: responses against closed forms and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from nsspice import read
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text
from nsspice.netlist.expansion.transfer import NoRational, rational
from nsspice.netlist.expressions.node import add, call, mul, num, power, var

STEP = "t\nV1 in 0 PULSE(0 1 0 0 0 1 2)\n.param wz=1k\n"


@pytest.mark.parametrize(
    ("function", "top", "bottom"),
    [
        ("1/(1 + 1m*s)", [1.0], [1e-3, 1.0]),
        ("(1 + s/wz)/(1 + 1e-4*s + 1e-8*s*s)", [1e-3, 1.0], [1e-8, 1e-4, 1.0]),
        ("s/(s + 1000)", [1.0, 0.0], [1.0, 1000.0]),
        ("1/s - 2/(s+100)", [-1.0, 100.0], [1.0, 100.0, 0.0]),
        ("3", [3.0], [1.0]),
        ("1/((1 + s/100)*(1 + s/1meg)^2)", [1.0],
         np.polymul([1e-2, 1.0], np.polymul([1e-6, 1.0], [1e-6, 1.0]))),
    ],
)  # fmt: skip
@pytest.mark.parametrize("form", ["LAPLACE {{v(in)}} = {{{}}}", "in 0 Laplace={}"])
def test_step_responses(function: str, top: list[float], bottom: list[float], form: str) -> None:
    line = form.format(function if "{{" in form else function.replace(" ", ""))
    (run,) = read(f"{STEP}E1 a 0 {line}\nG1 0 b {line}\nR1 b 0 1\n.tran 0.1m 5m uic\n").run()
    x = run.axis[1:]
    if len(bottom) == 1:
        exact = np.full(x.size, 3.0)
    else:
        exact = signal.step((top, bottom), T=np.concatenate([[0.0], x]))[1][1:]
    # scipy's own matrix exponential has an error of about 1e-12 where poles differ by 1e4
    assert run["v(a)"][1:] == pytest.approx(exact, abs=1e-10)
    assert run["v(b)"][1:] == pytest.approx(run["v(a)"][1:], abs=1e-12)


def test_frequency_response() -> None:
    text = "t\nV1 in 0 AC 1\nR0 in 0 1\nE1 a 0 LAPLACE {v(in)} {(1+s/2k)/(s*(1+s/1meg)*(1+s/3g))}\n"
    (run,) = read(f"{text}.ac dec 3 1 1g\n").run()
    s = 2j * np.pi * run.axis
    exact = (1 + s / 2e3) / (s * (1 + s / 1e6) * (1 + s / 3e9))
    # the poles are coefficients: their rounding in units of the largest ratio, 3e9, times 1e-16
    assert np.abs(run["v(a)"] / exact - 1).max() < 1e-6


def test_parts_in_a_subcircuit() -> None:
    text = (
        "t\nV1 in 0 1\nX1 in out f w=10\n.subckt f p q w=1\nE1 q 0 LAPLACE {v(p)} {1/(1+s/w)}\n"
        ".ends\n"
    )
    deck = parse_text(text)
    assert [e.name for e in deck.elements] == ["v1", "x1.e1", "x1.e1.x1.c", "x1.e1.x1.b"]
    assert read(text + ".op\n").run()[0]["v(out)"][0] == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize(
    ("function", "code"),
    [
        ("exp(-s*1m)", "NS1002"),
        ("1/(1+sqrt(s))", "NS1002"),
        ("s", "NS1025"),
        ("1/(1+s*v(in))", "NS1002"),
        ("1/(1+s)^17", "NS1002"),
        ("1/((1+s)^9*(2+s)^9)", "NS1023"),
        ("1/(0*s)", "NS1024"),
        ("1/(1+s*tau)", "NS1021"),
    ],
)
def test_what_is_refused(function: str, code: str) -> None:
    with pytest.raises(NetlistError) as caught:
        read(f"{STEP}R1 in 0 1\nE1 a 0 LAPLACE {{v(in)}} = {{{function}}}\n")
    assert [d.code for d in caught.value.diagnostics] == [code]


def test_quotients_by_hand() -> None:
    s = var("s")
    assert rational(mul((power(add((num(1.0), s)), num(-2.0)), power(s, num(3.0))))) == (
        [0, 0, 0, 1],
        [1, 2, 1],
    )
    with pytest.raises(NoRational):
        rational(call("sin", s))


@pytest.mark.parametrize("start", ["", "uic"])
def test_derivatives_and_integrals(start: str) -> None:
    text = (
        "t\nV1 a 0 SIN(1 2 1k)\nB1 d 0 V=ddt(v(a))*1m\nB2 i 0 V=idt(v(a), 0.5)\n"
        "E3 s 0 VALUE={2*SDT(V(a)-1)+v(d)}\nX1 a q inner\n.subckt inner p q\n"
        "G1 0 q VALUE={ddt(idt(v(p)))}\nR1 q 0 1\n.ends\n"
    )
    (run,) = read(f"{text}.tran 10u 2m {start}\n").run()
    t, w = run.axis, 2e3 * np.pi
    assert run["v(d)"] == pytest.approx(2e-3 * w * np.cos(w * t), abs=1e-12)
    assert run["v(i)"] == pytest.approx(0.5 + t + 2 / w * (1 - np.cos(w * t)), abs=1e-14)
    assert run["v(s)"] - run["v(d)"] == pytest.approx(4 / w * (1 - np.cos(w * t)), abs=1e-13)
    assert run["v(q)"] == pytest.approx(run["v(a)"], abs=1e-12)


@pytest.mark.parametrize(
    ("law", "code"),
    [("ddt()", "NS1022"), ("ddt(v(a), 1)", "NS1022"), ("idt(v(a), v(a))", "NS1025"),
     ("idt(v(a), 1, 2)", "NS1022"), ("ddt(v(nowhere))", "NS1071")],
)  # fmt: skip
def test_wrong_derivatives(law: str, code: str) -> None:
    with pytest.raises(NetlistError) as caught:
        read(f"t\nV1 a 0 1\nB1 b 0 V={law}\n")
    assert caught.value.diagnostics[0].code == code
