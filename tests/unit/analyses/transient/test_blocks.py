"""Runs in which blocks are solved one after the other."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.analyses.request import method
from nsspice.analyses.request.request import Request
from nsspice.analyses.studies.batch import jobs_of, run_job
from nsspice.analyses.studies.explanation import explained
from nsspice.problems.descriptor import Waveform

#: a chopper into an RC filter, whose buffered voltage drives a law that is smooth by a trace
CHOPPER = """chopper
V1 in 0 PULSE({low} 10 0 0 0 0.3m 0.7m)
S1 in b g 0 SW
.model SW SW(Ron=10m Vt=0.5)
VG g 0 PULSE(0 1 0 0 0 40u 100u)
D2 0 b DI
.model DI D(Ron=10m Vfwd=0.4)
L1 b out 0.2m
C1 out 0 20u
R1 out 0 5
RB b 0 1k
B3 0 f I={{({law})*1m}}
RF f 0 1k
CF f 0 10n
.tran 7u 2m{uic}
"""
TRACE = " + 1e-30*tanh(v(b))"


def run(law: str, low: float = 0.0, uic: str = "", more: str = "", **options: object):
    text = CHOPPER.format(law=law, low=low, uic=uic) + more
    return nsspice.tran(nsspice.read(text), **options)


@pytest.mark.parametrize("uic", ["", " uic"])
@pytest.mark.parametrize("low", [0.0, 4.0])
@pytest.mark.parametrize("law", ["v(out)/4", "i(L1) - v(b)/8", "v(in)/4"])
def test_a_driven_block_follows_the_closed_form(law: str, low: float, uic: str) -> None:
    exact = run(law, low, uic)
    assert [island.method for island in exact.islands] == ["modewise"]
    blocks = run(law + TRACE, low, uic, reltol=1e-9)
    assert [island.method for island in blocks.islands] == ["modewise", "sdirk"]
    assert "driven by island 1" in blocks.islands[1].note
    for name in ("v(out)", "i(l1)"):
        assert np.abs(blocks[name] - exact[name]).max() <= 1e-13 * np.abs(exact[name]).max()
    # each of 60 jumps of the sources may leave the tolerance of a step, and is forgotten in 10 us
    assert np.abs(blocks["v(f)"] - exact["v(f)"]).max() <= 1e-7


def test_a_static_block_is_exact_at_the_rows() -> None:
    text = CHOPPER.format(law="v(out)*v(b)", low=0.0, uic="").replace("CF f 0 10n\n", "")
    blocks = nsspice.tran(nsspice.read(text))
    assert [island.method for island in blocks.islands] == ["modewise", "point by point"]
    expected = blocks["v(out)"] * blocks["v(b)"]
    # what is handed on is accurate to 1e-13 of its largest value, and has two factors
    assert np.abs(blocks["v(f)"] - expected).max() <= 4e-13 * np.abs(expected).max()


def test_all_points_of_all_blocks_stand_in_one_table() -> None:
    blocks = run("v(b)/4" + TRACE, all_points=True, reltol=1e-8)
    exact = run("v(b)/4", all_points=True)
    t = blocks.time
    assert (np.diff(t) >= 0.0).all()
    jumps = np.flatnonzero(np.diff(t) == 0.0)
    assert jumps.size >= 40  # at each edge of the gate
    assert np.abs(blocks["v(b)"][jumps + 1] - blocks["v(b)"][jumps]).max() > 5.0
    # the blocks have points of their own between the rows, where others are interpolated
    rows = np.arange(1, 285) * 7e-6
    values = [np.interp(rows, s.time, s["v(f)"]) for s in (blocks, exact)]
    assert np.abs(values[0] - values[1]).max() <= 1e-6


def test_measures_see_between_the_rows_of_a_driven_block() -> None:
    measures = (
        ".measure tran most max v(f)\n.measure tran mean avg v(f) from=1m to=2m\n"
        ".measure tran both max p(RF)\n"
    )
    exact, blocks = (
        nsspice.run(CHOPPER.format(law=law, low=0.0, uic="") + measures)[0]
        for law in ("v(out)/4", "v(out)/4" + TRACE)
    )
    for name, value in exact.measures.items():
        assert blocks.measures[name] == pytest.approx(value, rel=1e-5), name  # reltol


def test_initial_voltages_of_the_driving_block_stay_there() -> None:
    more = ".ic v(out)=3\n"
    exact, blocks = run("v(out)/4", more=more), run("v(out)/4" + TRACE, more=more, reltol=1e-9)
    assert blocks["v(out)"][0] == pytest.approx(3.0, rel=1e-12)
    assert np.abs(blocks["v(f)"] - exact["v(f)"]).max() <= 1e-7
    assert {warning.code for warning in blocks.warnings} <= {"NS5004"}  # no NS3054


def test_other_signals_are_found_by_running_again() -> None:
    blocks = run("v(out)/4" + TRACE, signals=["v(f)"])
    assert blocks.columns == ["v(f)"]
    later = blocks["v(out)"]
    assert np.abs(later - run("v(out)/4")["v(out)"]).max() <= 1e-12


def test_a_method_that_is_asked_for_takes_the_whole() -> None:
    assert [i.method for i in run("tanh(v(out))", method="sdirk").islands] == ["sdirk"]
    assert [i.method for i in run("tanh(v(out))", step=1e-6).islands] == ["moreau"]


def test_a_driving_block_that_is_too_large_stays_with_the_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(method, "AUTO_LIMIT", 8)
    assert len(run("tanh(v(out))").islands) == 1
    monkeypatch.setattr(method, "AUTO_LIMIT", 40)
    assert len(run("tanh(v(out))").islands) == 2


def test_signals_that_may_have_impulses_are_not_handed_on() -> None:
    # the switch cuts the inductor off, whose voltage charges the capacitor of the filter at once
    text = CHOPPER.format(law="i(L1) - v(b)/8" + TRACE, low=0.0, uic="").replace("RB b 0 1k\n", "")
    exact = nsspice.tran(nsspice.read(text.replace(TRACE, "")))
    whole = nsspice.tran(nsspice.read(text), reltol=1e-9)
    assert [island.method for island in whole.islands] == ["sdirk"]
    assert np.abs(whole["v(f)"] - exact["v(f)"]).max() <= 1e-7
    held = text.replace("v(b)/8", "v(out)/8").replace("tanh(v(b))", "tanh(v(out))")
    assert len(nsspice.tran(nsspice.read(held)).islands) == 2


def test_explain_tells_the_blocks() -> None:
    circuit = nsspice.read(CHOPPER.format(law="tanh(v(out))", low=0.0, uic=""))
    driving, driven = explained(circuit).islands
    assert "mode-wise" in driving.told.method
    assert "sdirk" in driven.told.method
    assert "driven by island 1 through v(out)" in driven.told.method
    assert driven.names == ("b3", "rf", "cf", "input.v(out)")


def test_events_and_certificates_of_all_blocks_are_in_one_result() -> None:
    blocks = run("tanh(v(out))")
    assert {e.element for e in blocks.events} == {"s1", "d2"}
    assert blocks.certificate is not None
    assert blocks.certificate.passed
    assert blocks.certificate.energy is not None


def test_waveforms_of_other_blocks_are_told_apart() -> None:
    from nsspice.solvers.polynomial import Polynomial

    one, other = Polynomial(), Polynomial()
    assert Waveform("polynomial", (), handed=one) != Waveform("polynomial", (), handed=other)


def powered(text: str, *loads: str) -> nsspice.Solution:
    circuit = nsspice.read(text)
    (job,) = jobs_of(circuit.deck)
    return run_job(circuit, job, Request(power=True, loads=loads))


def test_powers_and_spectra_of_the_driving_block_are_those_of_it_alone() -> None:
    text = CHOPPER.format(law="tanh(v(out))", low=0.0, uic="") + ".four 10k v(out) i(L1)\n"
    alone = "".join(
        line for line in text.splitlines(True) if not line.startswith(("B3", "RF", "CF"))
    )
    blocks, exact = powered(text), powered(alone)
    assert [s.signal for s in blocks.spectra] == [s.signal for s in exact.spectra]
    assert exact.spectra
    for mine, theirs in zip(blocks.spectra, exact.spectra, strict=True):
        # a sensor changes no digit of the converter but by rounding
        assert mine.coefficients == pytest.approx(theirs.coefficients, rel=1e-9, abs=1e-12)
    mine, theirs = ({r.element: r.power for r in s.powers.rows} for s in (blocks, exact))
    assert {e: mine[e] for e in theirs} == pytest.approx(theirs, rel=1e-9, abs=1e-12)


def test_a_load_in_a_driven_block_has_its_power_from_steps() -> None:
    """The block is a source behind a resistor: what it gives, both take."""
    text = CHOPPER.format(law="tanh(v(out))", low=0.0, uic="")
    found = powered(text, "rf")
    power = {row.element: row.power for row in found.powers.rows}
    assert power["rf"] > 0.0
    assert power["b3"] + power["rf"] + power["cf"] == pytest.approx(0.0, abs=1e-9 * power["rf"])
    assert found.powers.useful == power["rf"]
