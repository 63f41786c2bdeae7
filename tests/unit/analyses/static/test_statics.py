"""Operating points and sweeps against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.analyses.request.cards import Dc
from nsspice.errors import InfeasibleError, NetlistError, Span, UsageError
from nsspice.netlist.deck import Sweep

CLAMP = """clamp
V1 in 0 DC 3 SIN(1 1 50)
R1 in out 1k
D1 out lim
V2 lim 0 1
"""


def test_operating_point_takes_the_dc_value():
    op = nsspice.op(nsspice.read(CLAMP))
    assert op["v(out)"].tolist() == pytest.approx([1.0])
    assert op["i(d1)"].tolist() == pytest.approx([2e-3])
    assert op.axis_name == ""
    assert op.certificate.passed


def test_operating_point_without_a_dc_value_takes_the_start_of_the_waveform():
    op = nsspice.op(nsspice.read(CLAMP.replace("DC 3 ", "")))
    assert op["v(in)"].tolist() == [1.0]


def test_capacitors_are_open_and_inductors_short():
    circuit = nsspice.read("lc\nV1 a 0 1\nL1 a b 1m\nR1 b 0 2\nC1 b 0 1u\n")
    op = nsspice.op(circuit, signals=["i(l1)", "i(c1)"])
    assert op["i(l1)"][0] == pytest.approx(0.5)
    assert op["i(c1)"][0] == 0.0


def test_sweep_of_a_source():
    values = np.linspace(-2.0, 4.0, 61)
    sol = nsspice.dc(nsspice.read(CLAMP), "V1", values)
    assert sol.axis_name == "v1"
    assert sol.axis.tolist() == values.tolist()
    assert sol["v(out)"] == pytest.approx(np.minimum(values, 1.0), abs=1e-12)


def test_sweep_of_a_source_that_equals_another():
    """Equal waveforms share a column of the system; the swept one must not take the other along."""
    sol = nsspice.dc(nsspice.read(CLAMP.replace("DC 3", "DC 1")), "v1", [1.0, 5.0])
    assert sol["v(lim)"].tolist() == [1.0, 1.0]


def test_sweep_of_a_current_source():
    circuit = nsspice.read("i\nI1 0 a 0\nR1 a 0 2\n")
    assert nsspice.dc(circuit, "i1", [0.0, 1.0, -2.0])["v(a)"].tolist() == [0.0, 2.0, -4.0]


def test_sweep_of_a_resistor_and_of_the_temperature():
    circuit = nsspice.read("r\nV1 a 0 1\nR1 a b 1k tc1=0.01\nR2 b 0 1k\n")
    sol = nsspice.dc(circuit, "R1", [1e3, 3e3, 0.0])
    assert sol["v(b)"] == pytest.approx([0.5, 0.25, 1.0])
    sol = nsspice.dc(circuit, "temp", [27.0, 127.0])
    assert sol.axis_name == "temp"
    assert sol["v(b)"] == pytest.approx([0.5, 1 / 3])


def test_nested_sweeps():
    circuit = nsspice.read(CLAMP + ".dc V1 0 4 1 V2 1 2 1\n")
    (sol,) = circuit.run()
    assert sol.axis.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0] * 2
    assert sol.columns[0] == "v2"
    assert sol["v2"].tolist() == [1.0] * 5 + [2.0] * 5
    assert sol["v(out)"] == pytest.approx(np.minimum(sol.axis, sol["v2"]))


def test_nested_sweeps_of_a_source_and_a_resistor():
    span = Span("", 0, 0)
    sweeps = (
        Sweep("v1", "element", (1.0, 2.0), span),
        Sweep("r1", "element", (1e3, 3e3), span),
    )
    circuit = nsspice.read("divider\nV1 a 0 1\nR1 a b 1k\nR2 b 0 1k\n")
    sol = nsspice.dc(circuit, analysis=Dc(sweeps))
    assert sol["v(b)"] == pytest.approx([0.5, 1.0, 0.25, 0.5])


def test_islands_that_the_sweep_does_not_touch_stay_constant():
    circuit = nsspice.read("two\nV1 a 0 1\nR1 a 0 1\nV2 b 0 5\nR2 b c 1\nR3 c 0 1\n")
    sol = nsspice.dc(circuit, "v1", [1.0, 2.0])
    assert sol["v(c)"].tolist() == [2.5, 2.5]


@pytest.mark.parametrize(
    ("name", "values", "error", "words"),
    [
        ("v9", [1.0], NetlistError, "v9"),
        ("d1", [1.0], UsageError, "cannot be swept"),
        ("v1", [], UsageError, "no values"),
    ],
)
def test_impossible_sweeps(name, values, error, words):
    with pytest.raises(error, match=words):
        nsspice.dc(nsspice.read(CLAMP), name, values)


def test_a_contradiction_names_the_swept_value_and_keeps_the_points_before():
    circuit = nsspice.read("bad\nV1 a 0 0\nD1 a 0\n")
    with pytest.raises(InfeasibleError, match="v1 = 1") as caught:
        nsspice.dc(circuit, "v1", [-2.0, -1.0, 0.0, 1.0, 2.0])
    partial = caught.value.partial
    assert isinstance(partial, nsspice.Solution)
    assert partial["v(a)"].tolist() == [-2.0, -1.0, 0.0]


def test_hysteresis_depends_on_the_direction_of_the_sweep():
    circuit = nsspice.read(
        "relay\nVc c 0 0\nV1 a 0 1\nR1 a b 1k\nS1 b 0 c 0 sw\n.model sw SW(VT=1 VH=0.5)\n"
    )
    up = np.linspace(0.0, 2.0, 21)
    sol = nsspice.dc(circuit, "vc", np.concatenate([up, up[::-1]]))
    closed = sol["v(b)"] < 0.5
    assert up[np.argmax(closed[:21])] == pytest.approx(1.5, abs=0.11)
    assert up[::-1][np.argmin(closed[21:])] == pytest.approx(0.5, abs=0.11)
