"""Charges and fluxes given by an expression: against what a constant drive stores in them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle.node_voltages import in_node_voltages

import nsspice
from nsspice.circuit import Circuit, MnaSystem, build
from nsspice.circuit.explain import explain
from nsspice.devices.expressions.antiderivative import antiderivative
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text
from nsspice.netlist.expressions.expression import Expression
from nsspice.netlist.expressions.node import var


def circuit_of(text: str) -> Circuit:
    return build(parse_text(f"title\n{text}\n"))


def assembled(text: str) -> MnaSystem:
    return in_node_voltages(circuit_of(text).islands[0].assemble())


def run(text: str, cards: str, signals: list[str]) -> nsspice.Solution:
    return nsspice.read(f"t\n{text}\n{cards}\n").run(signals=signals)[0]


def _product(v):
    return 1e-9 * (2 * v + 0.3 * v**2 - v**3 / 3 - 0.075 * v**4)


def _graded(v):
    return 1e-9 * 0.7 / 0.6 * ((1 + v / 0.7) ** 0.6 - 1)


def _step(v):
    return 1e-9 * (v + 0.5 * (np.log(np.cosh(2 * v - 1)) - np.log(np.cosh(1.0))))


def _table(v):
    fine = np.linspace(0.0, 3.0, 3001)  # the corners 0.4 and 0.8 are among the points
    values = np.interp(fine, [0.0, 0.4, 0.8], [1e-9, 2e-9, 0.5e-9])
    whole = np.append(0.0, np.cumsum(0.5e-3 * (values[1:] + values[:-1])))
    k = np.clip((v / 1e-3).astype(int), 0, fine.size - 2)
    part = v - fine[k]
    return whole[k] + part * (values[k] + 0.5 * part * (values[k + 1] - values[k]) / 1e-3)


@pytest.mark.parametrize(
    ("line", "charge"),
    [
        ("C1 b 0 Q=1n*x*(1+0.3*x) ic=0", lambda v: 1e-9 * v * (1 + 0.3 * v)),
        ("C1 b 0 Q={1n*x + 2n*tanh(v(b))} m=2", lambda v: 2e-9 * v + 4e-9 * np.tanh(v)),
        ("C1 0 b Q=1n*(x + 0.1*x^3) ic=0", lambda v: 1e-9 * (v + 0.1 * v**3)),
        ("C1 b 0 {1n/(1+v(b)/0.7)**0.4} ic=0", _graded),
        ("C1 0 b C='1n*(1+0.3*v(b))*(2-v(b)**2)' ic=0", _product),
        ("C1 b 0 C={1n+1n*tanh(2*v(b)-1)} ic=0", _step),
        ("C1 b 0 C={table(v(b),0,1n,0.4,2n,0.8,0.5n)} ic=0", _table),
        ("C1 b 0 Q='x*if(x<1, 1n, 3n) - if(x<1, 0, 2n)'", lambda v: 1e-9 * np.fmax(v, 3 * v - 2)),
    ],
)
def test_a_constant_current_charges_along_the_expression(line: str, charge):
    # 1 mA for t stores 1 mA t, however long the steps are: the rate of the charge is what is
    # integrated.  What is left is Newton's tolerance, reltol of each step, and the step of 2e-6 of
    # the run in which initial values are resolved.
    solution = run(
        f"I1 0 b 1m\n{line}", ".tran 0.1u 2u uic\n.options reltol=1e-8", ["v(b)", "i(c1)"]
    )
    sign = -1.0 if line.startswith("C1 0 b") else 1.0
    v, stored = solution["v(b)"], 1e-3 * solution.axis
    assert charge(v) == pytest.approx(stored, abs=3e-6 * stored.max())
    assert v.max() > 0.3
    assert solution["i(c1)"][1:] == pytest.approx(sign * 1e-3, rel=1e-6)


def test_a_constant_voltage_drives_a_saturating_inductor():
    # 1 V for t is a flux of 1 V t
    text = "V1 a 0 1\nL1 a 0 Flux=2u*tanh(x/3) + 0.1u*x ic=0.5 m=2"
    solution = run(text, ".tran 0.1u 1u uic\n.options reltol=1e-8", ["i(l1)"])

    def flux(i):
        return 2e-6 * np.tanh(i / 2 / 3) + 0.1e-6 * i / 2

    start = flux(np.array(1.0))  # two of them with 0.5 A each
    expected = start + solution.axis
    assert flux(solution["i(l1)"]) == pytest.approx(expected, abs=1e-7 * expected.max())
    assert solution["i(l1)"][-1] > 1.0


def test_a_multiple_of_x_is_a_plain_element():
    mna = assembled("C1 a b Q=2n*x m=3\nR1 a b 1\nR2 b 0 1\nL1 a 0 Flux=3m*x+1 ic=2")
    assert mna.system.smooth is None
    assert [(s.name, s.value) for s in mna.capacitors] == [("c1", pytest.approx(6e-9))]
    assert [(s.name, s.value, s.ic) for s in mna.inductors] == [("l1", 3e-3, 2.0)]
    text = "C1 b a Q={{{}}}\nR1 a b 1\nR2 b 0 1"
    for expression, farad in (("2n*v(b,a)", 2e-9), ("v(b)*2n-2n*v(a)", 2e-9), ("2n*v(a,b)", None)):
        if farad is None:
            with pytest.raises(NetlistError, match="capacitance -2e-09 F"):
                circuit_of(text.format(expression))
        else:
            assert assembled(text.format(expression)).capacitors[0].value == farad
    # charges that another voltage brings are no capacitance of this element
    assert assembled(text.format("2n*v(b)")).system.smooth is not None


@pytest.mark.parametrize(
    "text",
    [
        "2", "1 + 0.3*v(a)", "(1+v(a))*(2-v(a)^2)", "2/(1+v(a)/0.7)**0.4", "exp(2*v(a)-1)",
        "3/sqrt(1+v(a))", "tanh(v(a)/3)", "1/(1+2*v(a))", "atan(v(a))", "(1+v(a))^-2",
        "sqrt(2+v(a))", "ln(2+v(a))", "abs(v(a)-0.3)", "u(v(a)-0.2)", "uramp(v(a))", "-v(a)*5",
        "sin(v(a))", "cos(2*v(a))", "sinh(v(a))", "cosh(v(a))", "square(1+v(a))",
        "table(v(a),0,1,1,3,2,0)", "5*(1+tanh(2*v(a)))/2", "if(v(a)>0.3, 3, 1)",
        "2*if(v(a)<=-0.2, 1+v(a), 2)", "if(1-v(a)>0.1, 2, 3*v(a))",
    ],
)  # fmt: skip
def test_an_antiderivative_has_the_derivative(text: str):
    expression = Expression.parse(text)
    integral = antiderivative(expression.node, var("v(a)"))
    assert integral is not None
    slope = Expression(integral).derivative("v(a)")
    for x in (-0.4, 0.1, 0.55, 1.3, 2.7):
        # the derivative is exact; what is left are sums of rounded terms
        at = {"v(a)": x}
        assert slope.evaluate(at) == pytest.approx(expression.evaluate(at), rel=1e-13, abs=1e-13)


@pytest.mark.parametrize("text", ["sin(v(a)^2)", "v(a)*exp(v(a))", "(1+tanh(v(a)))^2", "sgn(v(a))"])
def test_antiderivatives_that_are_not_known(text: str):
    assert antiderivative(Expression.parse(text).node, var("v(a)")) is None


def test_initial_values():
    text = "C1 a 0 Q={1n*v(a)^2} {}\nR1 a 0 1\nL1 a b Flux=1m*x^3 {}\nR2 b 0 1"
    given = assembled(text.replace("{}", "ic=3", 1).replace("{}", "ic=2"))
    assert given.initial_charges()[[0, 2]] == pytest.approx([9e-9, 8e-3])
    assert assembled(text.replace("{}", "")).initial_charges({"a": 2.0})[0] == pytest.approx(4e-9)


def test_currents_may_be_read_by_others():
    text = "I1 0 a 1m\nC1 a 0 Q=1n*tanh(x)+1n*x ic=0\nB1 b 0 V={2*i(C1)^2}\nR1 b 0 1\n"
    text += "F1 0 c C1 3\nR2 c 0 1"
    solution = run(text, ".tran 0.1u 1u uic", ["v(b)", "v(c)"])
    assert solution["v(b)"][1:] == pytest.approx(2e-6, rel=1e-6)
    assert solution["v(c)"][1:] == pytest.approx(3e-3, rel=1e-6)


def test_at_dc_a_charge_is_open_and_a_flux_a_short():
    text = "V1 a 0 1\nR1 a b 1k\nC1 b 0 Q=1n*x^3\nL1 b c Flux=1m*x^3\nR2 c 0 1k"
    (solution,) = nsspice.read(f"t\n{text}\n.op\n").run(signals=["v(b)", "v(c)"])
    assert [float(solution[n][0]) for n in ("v(b)", "v(c)")] == pytest.approx([0.5, 0.5])


def test_in_a_subcircuit_x_is_the_voltage_across():
    text = "X1 a b s\n.subckt s p q\nC1 p q Q={1n*x*x}\n.ends\nR1 a b 1\nR2 b 0 1"
    assert assembled(text).initial_charges({"a": 3.0, "b": 1.0}) == pytest.approx([4e-9, -4e-9])
    # a parameter of that name does not hide it
    assert math.isclose(assembled(f".param x=7\n{text}").initial_charges({"a": 3.0})[0], 9e-9)


@pytest.mark.parametrize(
    ("line", "code", "word"),
    [
        ("C1 a 0 Q=", "NS1020", "empty"),
        ("C1 a 0 Q=x V=2", "NS1014", "unknown parameter v"),
        ("L1 a 0 Flux=x Rser=1", "NS1014", "write Lname n+ n- Flux=expression"),
        ("C1 a 0 Q=x^2 m=0", "NS2005", "m of c1 must be positive"),
        ("C1 a 0 Q=y*x", "NS1021", "y"),
        ("L1 a 0 L={i(r1)}", "NS2009", "inductance of l1 depends on i(r1)"),
        ("L1 a 0 L={v(a)>1 ? 1m : 2m}", "NS2009", "write Flux={L*x}"),
        ("L1 a 0 L={sin(i(l1)^2)}", "NS2009", "write the flux: Flux="),
        ("C1 a 0 C={sin(v(b))*v(a)}", "NS2009", "capacitance of c1 depends on v(b)"),
        ("C1 a 0 C={v(b)>1 ? 1u : 2u}", "NS2009", "write Q={C*x}"),
        ("C1 a 0 C={exp(v(a)^2)}", "NS2009", "write the charge: Q="),
        ("C1 a 0 C={1/v(a)}", "NS2009", "write the charge: Q="),
    ],
)
def test_wrong_ones(line: str, code: str, word: str):
    with pytest.raises(NetlistError) as caught:
        circuit_of(f"{line}\nR1 a b 1\nR2 b 0 1")
    assert caught.value.code == code
    assert word in str(caught.value)


def test_explain_shows_the_expression():
    text = explain(circuit_of("C1 a 0 Q=1n*x*x ic=1\nR1 a 0 1\nL1 a 0 Flux=tanh(x)")).text()
    assert "charge {1n*x*x}, initial value (ic=1)" in text
    assert "flux {tanh(x)}" in text


def test_the_impulse_of_a_step_is_the_charge():
    # 2 V at once: 1 nF x (1 + 0.1 x^2) holds 2.8 nA s, which the source gives and the resistor not
    text = "V1 a 0 PULSE(0 2 1u 0 0 1 2)\nC1 a 0 Q=1n*x*(1+0.1*x*x)\nR1 a 0 1k"
    deck = nsspice.read(f"t\n{text}\n.tran 0.1u 3u\n")
    # the source fixes v(a): nothing would have to be simulated for it
    solution = deck.run(signals=["v(a)"], everything=True)[0]
    (impulse,) = solution.impulses
    assert (impulse.element, impulse.time) == ("v1", 1e-6)
    assert impulse.value == pytest.approx(-2.8e-9, rel=1e-9)


def test_a_capacitance_of_two_values_has_a_charge_with_a_kink():
    """One current source: the charge grows evenly, the voltage by 1/C on either side of 1 V."""
    deck = "steps\nI1 0 a 1m\nC1 a 0 C={v(a)>1 ? 3u : 1u} IC=0\nR1 a 0 1g\n.tran 10u 4m uic\n"
    run = nsspice.tran(nsspice.read(deck), reltol=1e-8)
    exact = np.where(run.time < 1e-3, 1e3 * run.time, 1.0 + (run.time - 1e-3) / 3e-3)
    assert np.abs(run["v(a)"] - exact).max() < 1e-5
