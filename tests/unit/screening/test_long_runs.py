"""Runs that take long: effects are compared in the beginning, and the end is confirmed."""

from __future__ import annotations

import math

import pytest

import nsspice
from nsspice.screening import effects, search
from nsspice.screening.bench import pool_of
from nsspice.screening.candidates import candidates
from nsspice.screening.comparison_basis import beginning, prepared
from nsspice.screening.trial import attempt

#: a peak detector whose leak takes a thousandth of the charge in 2 ms and 2 % of it in 40 ms,
#: and a junction beside its diode, which forces steps
DETECTOR = """peak detector
V1 a 0 SIN(0 10 1k)
D1 a b DI
D2 b a DJ
C1 b 0 1u
Cs b 0 1p
V2 c 0 PWL(0 0 0.1m 5 0.5m 5 0.6m 0)
R2 c d 100
D3 d e DI
C3 e 0 1u IC=0
Rleak e 0 2meg
R1 b 0 100k
.model DI D(ideal)
.model DJ D(IS=1e-15 BV=100)
.tran 50u 40m uic
.measure tran held FIND v(e) AT=39.5m
.measure tran mean AVG v(b) FROM=20m TO=40m
.save v(b) v(e)
.end
"""


@pytest.fixture
def impatient(monkeypatch) -> None:
    monkeypatch.setattr(search, "_PATIENCE", 1e-3)


def test_what_the_beginning_allows_the_end_may_refuse(impatient) -> None:
    circuit = nsspice.read(DETECTOR)
    edits = [e for e in candidates(circuit) if e.owner in ("rleak", "cs")]
    trials = search._Search(prepared(circuit), edits, 1e-2, pool_of(1), lambda *_: None, 1)
    trials.full.begin()
    trials.cut()
    trials.run([frozenset([e]) for e in edits])
    (beginning_without,) = trials.run([frozenset(edits)])
    assert trials.admissible(beginning_without)
    # 39.5 ms of 2 s: two percent of what is held
    assert [e.owner for e in trials.confirmed(frozenset(edits))] == ["cs"]


def test_what_is_recommended_has_been_run_to_its_end(impatient) -> None:
    report = effects(nsspice.read(DETECTOR), 1e-2, workers=1)
    assert report.compared == pytest.approx(2e-3)
    assert set(report.reference) == {"held", "mean"}
    assert report.change <= 1e-2
    assert "compared up to 2 ms" in report.text()
    assert report.to_dict()["compared_up_to"] == pytest.approx(2e-3)


def test_short_runs_are_compared_as_they_are() -> None:
    report = effects(nsspice.read(DETECTOR), 1e-2, workers=1)
    assert report.compared == math.inf
    assert report.to_dict()["compared_up_to"] is None


def test_the_beginning_measures_what_the_deck_measures() -> None:
    circuit = nsspice.read(DETECTOR)
    deck, stop = beginning(circuit, 0.1)
    assert stop == pytest.approx(4e-3)
    names = [m.name for m in deck.measures]
    assert names == [f"{s} v({n})" for n in "eb" for s in ("avg", "max", "min")]
    assert all(m.start == pytest.approx(2e-3) for m in deck.measures)
    assert beginning(circuit, 0.9) is None


def test_a_run_is_given_up_when_it_takes_too_long() -> None:
    circuit = nsspice.read(DETECTOR)
    edits = candidates(circuit)
    trial = attempt(prepared(circuit), frozenset(edits[:1]), 0.0)
    assert trial.slow
    assert not trial.values
