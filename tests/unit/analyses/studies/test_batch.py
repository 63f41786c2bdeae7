"""Everything a deck asks for: several analyses, steps, measures."""

from __future__ import annotations

import math

import pytest

import nsspice
from nsspice.analyses import jobs_of
from nsspice.errors import UsageError

DIVIDER = """divider
.param r=1k
V1 a 0 2
R1 a b {r}
R2 b 0 1k
"""


def test_labels():
    circuit = nsspice.read(DIVIDER + ".op\n.tran 1u 1m\n.tran 1u 2m\n.step param r list 1 2\n")
    assert [job.label for job in jobs_of(circuit.deck)] == [
        "op.step1",
        "op.step2",
        "tran.step1",
        "tran.step2",
        "tran2.step1",
        "tran2.step2",
    ]


def test_steps_of_a_parameter_an_element_and_the_temperature():
    cards = ".op\n.step param r list 1k 3k\n.step V1 2 4 2\n.step temp list 27 127\n"
    solutions = nsspice.read(DIVIDER.replace("R2 b 0 1k", "R2 b 0 1k tc1=0.01") + cards).run()
    assert len(solutions) == 8
    assert [s.parameters for s in solutions[:3]] == [
        {"r": 1e3, "v1": 2.0, "temp": 27.0},
        {"r": 3e3, "v1": 2.0, "temp": 27.0},
        {"r": 1e3, "v1": 4.0, "temp": 27.0},
    ]
    for s in solutions:
        p = s.parameters
        lower = 1e3 * (1 + 0.01 * (p["temp"] - 27))
        assert s["v(b)"][0] == pytest.approx(p["v1"] * lower / (p["r"] + lower))


def test_steps_keep_the_parameters_of_the_caller():
    text = DIVIDER.replace(".param r=1k", ".param r=1k q=1k").replace("R2 b 0 1k", "R2 b 0 {q}")
    circuit = nsspice.read(text + ".op\n.step param r list 1k 3k\n", params={"q": 3e3})
    assert [s["v(b)"][0] for s in circuit.run()] == pytest.approx([1.5, 1.0])


def test_steps_of_a_deck_from_a_file(tmp_path):
    (tmp_path / "load.inc").write_text("R2 b 0 1k\n")
    path = tmp_path / "d.net"
    path.write_text(
        DIVIDER.replace("R2 b 0 1k", ".include load.inc") + ".op\n.step param r list 1k 3k\n"
    )
    assert [s["v(b)"][0] for s in nsspice.read(path).run()] == pytest.approx([1.0, 0.5])


def test_measures_need_no_saved_signals():
    circuit = nsspice.read(
        "rc\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u IC=0\n.save v(a)\n.tran 1u 3m uic\n"
        ".measure tran t50 WHEN v(b)=0.5\n.measure tran imax MAX i(r1)\n"
        ".measure tran ratio PARAM='t50*1000'\n.measure tran energy INTEG v(b)*i(c1)\n"
        ".measure dc unused MAX v(b)\n"
    )
    (sol,) = circuit.run()
    assert sol.columns == ["v(a)"]
    assert list(sol.measures) == ["t50", "imax", "ratio", "energy"]
    # rows are exact and h = 1 us apart; a chord errs by h^2 v''/8, which v' turns into h^2/8 / 1 ms
    assert sol.measures["t50"] == pytest.approx(1e-3 * math.log(2), abs=1.3e-10)
    assert sol.measures["imax"] == pytest.approx(1e-3, rel=1e-12)
    assert sol.measures["ratio"] == pytest.approx(sol.measures["t50"] * 1e3, rel=1e-12)
    # a trapezoid errs by h^2/12 times the change of the power's slope, from 1 W/s to -0.045 W/s
    energy = 0.5e-6 * (1 - math.exp(-3)) ** 2
    assert sol.measures["energy"] == pytest.approx(energy, abs=1e-12 / 12 * 1.05)


def test_measures_of_a_sweep():
    circuit = nsspice.read(
        DIVIDER + ".dc V1 0 4 0.5\n.measure dc top MAX v(b)\n.measure dc at1 WHEN v(b)=1\n"
    )
    (sol,) = circuit.run()
    assert sol.measures == pytest.approx({"top": 2.0, "at1": 2.0})


def test_progress_covers_all_jobs():
    shares: list[float] = []
    nsspice.read(DIVIDER + ".tran 1u 10u\n.tran 1u 20u\n").run(progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert 0.5 in shares


def test_no_analysis():
    with pytest.raises(UsageError, match="asks for no analysis"):
        nsspice.read(DIVIDER).run()
