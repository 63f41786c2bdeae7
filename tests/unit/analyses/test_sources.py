"""Source values of the certificate against closed forms, and what notices a wrong one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import nsspice
from nsspice.analyses.cards import Tran
from nsspice.analyses.island_runner import IslandRunner
from nsspice.analyses.settings import Settings
from nsspice.analyses.sources import SourceCheck, waveform_values
from nsspice.problems import Waveform

NEVER = math.inf
#: waveforms, instants, values
CASES = [
    (Waveform("dc", (3.0,), scale=2.0), [0.0, 1.0], [6.0, 6.0]),
    (Waveform("sin", (1.0, 2.0, 50.0, 0.0, 0.0, 90.0)), [0.0, 0.01, 0.005], [3.0, -1.0, 1.0]),
    (Waveform("sin", (0.0, 2.0, 0.25, 1.0, 3.0, 0.0)), [0.5, 2.0], [0.0, 2.0 * math.exp(-3.0)]),
    (Waveform("pulse", (1.0, 5.0, 2.0, 1.0, 2.0, 3.0, 10.0, 2.0)),
     [1.9, 2.5, 4.0, 7.0, 9.0, 12.25, 17.0, 24.0], [1.0, 3.0, 5.0, 3.0, 1.0, 2.0, 3.0, 1.0]),
    (Waveform("pulse", (0.0, 1.0, 0.0, 0.0, 0.0, 1.0, NEVER, NEVER)), [0.0, 1.0], [1.0, 0.0]),
    # cut by its period
    (Waveform("pulse", (0.0, 1.0, 0.0, 2.0, 1.0, 9.0, 4.0, NEVER)), [3.0, 5.0], [1.0, 0.5]),
    (Waveform("pwl", (1.0, 2.0, 3.0, 6.0, 3.0, 0.0, 5.0, 4.0)),
     [0.0, 2.0, 3.0, 4.0, 9.0], [2.0, 4.0, 0.0, 2.0, 4.0]),
    (Waveform("pwl", (0.0, 0.0, 1.0, 2.0, 2.0, 0.0), repeat=1.0), [0.5, 1.5, 2.5], [1.0, 1.0, 1.0]),
    (Waveform("exp", (1.0, 3.0, 1.0, 2.0, 5.0, 4.0)), [0.0, 3.0, 9.0],
     [1.0, 3.0 - 2.0 * math.exp(-1.0), 1.0 + 2.0 * (math.exp(-1.0) - math.exp(-4.0))]),
    (Waveform("sffm", (1.0, 2.0, 10.0, 3.0, 1.0)), [0.25],
     [1.0 + 2.0 * math.sin(5 * math.pi + 3.0)]),
    (Waveform("am", (2.0, 1.0, 0.25, 1.25, 1.0)), [0.5, 2.0], [0.0, 4.0]),
]  # fmt: skip


@pytest.mark.parametrize(("waveform", "t", "expected"), CASES)
def test_values_are_those_of_closed_forms(waveform, t, expected):
    found = waveform_values(waveform, np.array(t))
    assert found == pytest.approx(np.array(expected), abs=1e-12)


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


def finished(text: str, method: str, wrong: int | None = None) -> IslandRunner:
    """Return the runner of a whole run; one source of the deck is not that of the engine."""
    circuit = nsspice.read(text)
    analysis = Tran(stop=1e-3, row_step=1e-5, uic=True)
    settings = Settings(method, 1.0)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    if wrong is not None:
        waveforms = list(runner.mna.system.waveforms)
        waveforms[wrong] = replace(waveforms[wrong], scale=1.0 + 1e-6)
        runner.examiner._sources = SourceCheck(waveforms)
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    return runner


@pytest.mark.parametrize(("text", "method"), RUNS)
def test_every_engine_is_driven_by_the_waveforms(text, method):
    runner = finished(text, method)
    assert runner.certificate().passed
    assert runner.examiner._sources.error < 1e-12


@pytest.mark.parametrize(("text", "method"), RUNS)
def test_a_wrong_source_is_named(text, method):
    count = len(nsspice.read(text).islands[0].assemble(27.0).system.waveforms)
    for wrong in range(count):
        found = finished(text, method, wrong).certificate()
        assert not found.passed
        assert found.laws > 1e-8
        assert found.worst == (f"v{wrong}" if wrong < 6 else "the source at node b")
