"""Source values of runs against the waveforms of the deck, and what notices a wrong one."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import pytest

import nsspice
from nsspice.analyses.certificate.island_check import Examiner
from nsspice.analyses.request.cards import Tran
from nsspice.analyses.request.settings import Settings
from nsspice.analyses.transient.island_runner import IslandRunner

#: one source of each kind that stands in a deck, at the same load
DECK = "".join(
    f"V{k} a{k} 0 {text}\nR{k} a{k} b 1k\n"
    for k, text in enumerate(
        [
            "3",
            "SIN(1 2 3k 5u 200 30)",
            "PULSE(0 5 4u 10u 20u 0.1m 0.3m)",
            "PULSE(0 5 3u 0 0 0.1m 0.3m)",
            "PWL(0 0 0.2m 3 0.2m 1 0.5m 4)",
            "EXP(0 4 2u 50u 0.4m 80u)",
        ]
    )
)
LINEAR = f"linear\n{DECK}C1 b 0 10n IC=0\n"
SMOOTH = f"""smooth
{DECK}I1 0 b SFFM(0 1m 5k 2 1k)
I2 0 b AM(1m 1 1k 20k 0)
C1 b 0 10n IC=0
D1 b 0 J
.model J D(IS=1e-14)
"""
RUNS = [(LINEAR, "modewise"), (LINEAR, "moreau"), (LINEAR, "sdirk"), (SMOOTH, "moreau"),
        (SMOOTH, "sdirk")]  # fmt: skip


def recorded(text: str, method: str):
    """Return the assembled island of a whole run, and what the run has recorded."""
    circuit = nsspice.read(text)
    analysis = Tran(stop=1e-3, row_step=1e-5, uic=True)
    settings = Settings(method, 1.0)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    intervals = None if method == "moreau" else runner.stepper.take_intervals()
    return runner.mna, runner.stepper.take_records(), intervals


def examined(mna, records, intervals) -> Examiner:
    examiner = Examiner(mna, timed=True)
    examiner.take(records)
    if intervals is not None:
        examiner.take_intervals(intervals)
    return examiner


@pytest.mark.parametrize(("text", "method"), RUNS)
def test_every_engine_is_driven_by_the_waveforms(text, method):
    examiner = examined(*recorded(text, method))
    assert examiner.certificate(1, 0).laws < 1e-8
    assert examiner.auditor.result()["sources"] < 1e-12


@pytest.mark.parametrize(("text", "method"), RUNS)
def test_a_wrong_source_is_named(text, method):
    """One source of the deck is not that of the engine."""
    mna, records, intervals = recorded(text, method)
    for wrong, waveform in enumerate(mna.system.waveforms):
        waveforms = list(mna.system.waveforms)
        waveforms[wrong] = replace(waveform, scale=waveform.scale * (1.0 + 1e-6))
        other = copy(mna)
        other.system = replace(mna.system, waveforms=tuple(waveforms))
        found = examined(other, records, intervals).certificate(1, 0)
        assert not found.passed
        assert found.laws > 1e-8
        assert found.worst == (f"v{wrong}" if wrong < 6 else "the source at node b")
