"""ngspice runs the same circuits: closed forms, failures and what is missing told by name."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import nsspice
from nsspice.analyses.request.cards import Dc, Op
from nsspice.compare import ngspice
from nsspice.compare.ngspice import NgspiceError, Options, batch, process
from nsspice.errors import UsageError

RC = """title with the word error in it
V1 in 0 1
R1 in out 1k
C1 out 0 1u IC=0
.tran 0.1m 1m uic
"""
RECTIFIER = """half wave
V1 in 0 SIN(0 10 50)
D1 in out
R1 out 0 1k
.tran 0.1m 20m
"""


@pytest.mark.parametrize("runner", ["library", "program"])
def test_an_rc_circuit_follows_its_closed_form(runner):
    run = ngspice.run(nsspice.read(RC), runner=runner)
    exact = 1.0 - np.exp(-run.time / 1e-3)
    assert run.time[-1] == pytest.approx(1e-3, rel=1e-9)
    # gear of second order with steps of 1/10000 of the run, tolerance 1e-6
    assert np.max(np.abs(run["v(out)"] - exact)) < 2e-6
    assert np.allclose(run["v(in,out)"], run["v(in)"] - run["v(out)"])
    assert run.translation.exact
    assert run.seconds > 0.0
    assert run.points > 10_000
    assert run.version.startswith("ngspice")


@pytest.mark.parametrize("junction", ["auto", "sidiode", 0.01, 0.001])
def test_an_ideal_diode_is_replaced_and_listed(junction):
    run = ngspice.run(nsspice.read(RECTIFIER), junction=junction)
    (substitute,) = run.translation.substitutes
    assert substitute.elements == ("d1",)
    assert substitute.law == "ideal diode"
    assert ("sidiode" in substitute.used) is isinstance(junction, str)
    ideal = np.maximum(10.0 * np.sin(2.0 * np.pi * 50.0 * run.time), 0.0)
    # the drop of a junction at 10 mA is N 25.9 mV ln(10 mA / 1 pA) = 0.6 V N
    drop = 1e-6 if isinstance(junction, str) else 0.65 * junction
    assert np.max(np.abs(run["v(out)"] - ideal)) < drop + 2e-5
    # 1 Ohm and 10 mA: the current comes from a meter in series
    assert np.allclose(run["i(d1)"] * 1e3, run["v(out)"], atol=1e-8)


def test_operating_points_and_sweeps():
    text = "divider\nV1 a 0 2\nR1 a b 1k\nR2 b 0 1k\n.dc V1 -1 1 0.5\n.op\n"
    circuit = nsspice.read(text)
    assert ngspice.run(circuit, Op())["v(b)"] == pytest.approx([1.0], abs=1e-9)
    sweep = Dc.from_card(circuit.deck.analyses[0])
    expected = np.linspace(-0.5, 0.5, 5)
    assert ngspice.run(circuit, sweep)["v(b)"] == pytest.approx(expected, abs=1e-9)


def test_the_sharpest_substitute_that_works_is_taken():
    circuit = nsspice.read(
        """inductor, ideal switch and ideal diode
Vin in 0 DC 24
S1 in sw g 0 SWITCH
D1 0 sw
L1 sw out 100u IC=0
C1 out 0 100u IC=0
Rload out 0 5
Vgate g 0 PULSE(0 1 0 0 0 5u 10u)
.model SWITCH SW(VT=0.5 VH=0)
.tran 0.5u 100u uic
"""
    )
    run = ngspice.run(circuit)
    assert [e.reason for e in run.attempts] == ["timestep too small"] * len(run.attempts)
    assert run.attempts
    ron = run.translation.options.ron
    assert ron is not None
    assert ron > 1e-6
    laws = {s.law for s in run.translation.substitutes}
    assert laws == {"ideal diode", "ideal switch", "ideal edge"}


def test_timestep_too_small_is_told_as_such():
    bad = nsspice.read(
        "equal sources\nV1 a 0 DC 5\nV2 a 0 DC 5\nR1 a 0 1k\n.tran 1u 1m\n"
    )  # a singular matrix for ngspice, no problem here
    with pytest.raises(NgspiceError) as failed:
        ngspice.run(bad)
    assert failed.value.code == "NS5010"
    assert failed.value.reason in ("timestep too small", "singular matrix", "no operating point")
    assert failed.value.exit_code == 1


def test_a_run_that_takes_too_long_is_stopped():
    circuit = nsspice.read(RC)
    with pytest.raises(NgspiceError, match=r"longer than 0\.001 s") as failed:
        ngspice.run(circuit, timeout=1e-3)
    assert failed.value.code == "NS5011"


def test_a_missing_library_is_told_with_the_way_to_install_it(monkeypatch):
    monkeypatch.setenv("NGSPICE_LIBRARY_PATH", "/no/such/library.so")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(UsageError) as missing:
        ngspice.run(nsspice.read(RC))
    (finding,) = missing.value.diagnostics
    assert finding.code == "NS4013"
    assert "ngspice library is not installed" in finding.message
    assert "pip install 'nsspice[ngspice]'" in finding.hint


def test_a_missing_package_is_told(monkeypatch, tmp_path):
    folder = tmp_path / "PySpice"
    folder.mkdir()
    (folder / "__init__.py").write_text("raise ImportError('not here')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(batch, "is_installed", lambda: False)
    with pytest.raises(UsageError, match="PySpice is not installed"):
        ngspice.run(nsspice.read(RC))


def test_without_pyspice_the_program_is_run(monkeypatch, tmp_path):
    folder = tmp_path / "PySpice"
    folder.mkdir()
    (folder / "__init__.py").write_text("raise ImportError('not here')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert ngspice.run(nsspice.read(RC)).runner == "ngspice -b"


def test_a_child_that_dies_is_a_failure(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    raw = process.execute("title\n.end\n", "library", 10.0)
    assert any("ended with code" in line for line in raw.log)


@pytest.mark.parametrize(
    ("field", "value"),
    [("junction", "sharp"), ("junction", 0.0), ("ron", -1.0), ("method", "euler"), ("runner", "x")],
)
def test_impossible_options(field, value):
    with pytest.raises(UsageError, match=field):
        Options(**{field: value})


def test_pyspice_is_never_imported_here():
    ngspice.run(nsspice.read(RC))
    assert "PySpice" not in sys.modules
