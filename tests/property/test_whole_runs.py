"""Whole runs of random decks: an answer with a certificate or a refusal with a name, never else."""

from __future__ import annotations

import numpy as np
import pytest
from decks.circuit_strategies import Network, Part, hard_circuits, networks
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

import nsspice
from nsspice.analyses.certificate.written_rows import WrittenRows
from nsspice.devices.stamper import Conditions

FIXED = settings(
    max_examples=40,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
H = 1e-5


@settings(FIXED, max_examples=60, phases=[Phase.explicit, Phase.generate])
@given(hard_circuits)
def test_a_run_is_certified_or_refused(random):
    refusal = None
    try:
        circuit = nsspice.read(random.text)
        run = nsspice.tran(circuit, 12 * random.step, random.step, step=random.step, uic=True)
    except nsspice.NsspiceError as error:
        refusal = error
    if refusal is not None:
        assert refusal.exit_code in (2, 3)
        assert refusal.code in ("NS3001", "NS2021", "NS2023"), random.text
        return
    assert all(np.all(np.isfinite(y)) for y in run.signals.values()), random.text
    assert run.certificate is not None
    if not run.certificate.passed:
        # steps may begin with a row right after a jump that breaks the law of a diode
        assert max(run.certificate.laws, run.certificate.jumps) < 1e-8, random.text
        assert worst_behind_the_first_row(circuit, run) < 1e-8, f"{run.certificate}\n{random.text}"


def worst_behind_the_first_row(circuit: nsspice.Circuit, run: nsspice.Solution) -> float:
    """Return the largest error of laws and characteristics of all rows but the first."""
    table = np.column_stack([run.time, *(run[name] for name in run.columns)])
    judge = WrittenRows(circuit, run.columns, Conditions())
    judge.take(table[1:])
    return max(found.error for found in judge.worst())


def linear(network: Network) -> Network:
    """Return the network with a resistor for each diode: one mode, for good."""
    parts = tuple(Part("R", p.a, p.b, 47.0) if p.letter == "D" else p for p in network.parts)
    return Network(parts, network.numbers)


def scaled(network: Network, sources: float, initial: float) -> Network:
    parts = [
        Part(p.letter, p.a, p.b, p.value * (sources if p.letter == "V" else 1.0),
             p.initial * initial)
        for p in network.parts
    ]  # fmt: skip
    return Network(tuple(parts), network.numbers)


@FIXED
@given(networks(), st.sampled_from((2.0, -0.5)))
def test_superposition_in_a_fixed_mode(network, factor):
    """The answer to the source plus that to the initial values is the answer to both."""
    network = linear(network)
    runs = [
        nsspice.tran(nsspice.read(scaled(network, *part).text()), 8 * H, H, step=H, uic=True)
        for part in ((1.0, 0.0), (0.0, 1.0), (1.0, factor))
    ]
    source, initial, both = (r.table()[1][1:, 1:] for r in runs)
    size = max(float(np.abs(t).max(initial=0.0)) for t in (source, initial, both))
    gap = np.abs(source + factor * initial - both).max(initial=0.0)
    assert gap <= 1e-9 * max(size, 1e-9)


@pytest.mark.parametrize("kind", ["bridge", "multiplier"])
def test_two_runs_are_identical_bit_by_bit(kind):
    from decks.random_circuits import generate

    random = generate(kind, 31)
    tables = []
    for _ in range(2):
        run = nsspice.tran(nsspice.read(random.text), 40 * random.step, random.step, uic=True)
        tables.append((run.table()[1].tobytes(), run.certificate))
    assert tables[0] == tables[1]
