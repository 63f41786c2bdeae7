"""Runs of one circuit again and again: what is kept between them never shows."""

from __future__ import annotations

import gc
import pickle
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import nsspice
from nsspice.analyses.certificate import regularity
from nsspice.solvers.compiled import compiled
from nsspice.solvers.intervals import Intervals
from nsspice.solvers.moreau import Records

RECTIFIER = """rectifier
V1 a 0 SIN(0 10 50)
D1 a b X
R1 b 0 100
C1 b 0 100u IC=0
L1 b c 1m IC=0
R2 c 0 50
.model X D({diode})
.tran 0.1m 20m uic
"""
IDEAL, SMOOTH = RECTIFIER.format(diode="Vfwd=0.7"), RECTIFIER.format(diode="IS=1e-14 TT=1n")
STATIC = """clamp
V1 a 0 SIN(0 10 50)
R1 a b 1k
D1 b 0 X
D2 0 b Z
.model X D(IS=1e-14)
.model Z D(Vfwd=0.7)
.tran 0.1m 20m
"""
# resistors and capacitors alone: modes are derived from one another, on a way of each run's own
DOUBLER = """doubler
V1 a 0 SIN(0 10 50)
R1 a b 100
C1 b c 10u IC=0
D1 0 c X
D2 c d X
C2 d 0 10u IC=0
R2 d 0 10k
.model X D(Ron=0.1 Roff=1G)
.tran 0.1m 20m uic
"""
DECKS = {"exact": IDEAL, "derived": DOUBLER, "controlled": SMOOTH, "static": STATIC}


def numbers(solution):
    """Return all that a run has computed but its time."""
    rows = np.column_stack([solution.axis, *solution.signals.values()])
    stats = {k: v for k, v in solution.stats.items() if k != "wall_time"}
    events = [(e.time, e.element, e.change) for e in solution.events]
    return rows.tobytes(), stats, events, solution.certificate.to_dict()


@pytest.mark.parametrize("text", DECKS.values(), ids=DECKS)
def test_a_run_is_that_of_a_circuit_that_never_ran(text):
    changes = [
        {},
        {"values": {"r1": 220.0}},
        {},
        {"values": {"v1": 3.0}},
        {"temperature": 80.0},
        {"stop": 7e-3, "row_step": 1e-4, "uic": True},
        {},
    ]
    circuit = nsspice.read(text)
    repeated = [numbers(nsspice.tran(circuit, **change)) for change in changes]
    fresh = [numbers(nsspice.tran(nsspice.read(text), **change)) for change in changes]
    assert repeated == fresh
    assert len({found[0] for found in fresh}) >= 4  # the changes are seen


def test_the_values_of_a_step_are_those_of_decks_of_their_own():
    stepped = nsspice.read(IDEAL + ".step r1 list 50 100 50\n").run()
    alone = [nsspice.read(IDEAL.replace("0 100\n", f"0 {r}\n")).run()[0] for r in (50, 100, 50)]
    assert [numbers(s) for s in stepped] == [numbers(s) for s in alone]


@pytest.mark.parametrize("text", DECKS.values(), ids=DECKS)
def test_threads_share_a_circuit(text):
    circuit = nsspice.read(text)
    loads = [100.0, 220.0, 470.0, 1000.0] * 3
    with ThreadPoolExecutor(4) as pool:
        at_once = pool.map(lambda r: numbers(nsspice.tran(circuit, values={"r1": r})), loads)
    apart = [numbers(nsspice.tran(nsspice.read(text), values={"r1": r})) for r in loads]
    assert list(at_once) == apart


def test_a_system_is_read_once_and_forgotten_with_it():
    island = nsspice.read(IDEAL).islands[0]
    system = island.assemble(27.0).system
    assert compiled(system) is compiled(system)
    other = island.assemble(27.0, {"r1": 1.0}).system
    assert compiled(other) is not compiled(system)


def test_the_verdict_on_a_static_island_is_found_when_somebody_asks(monkeypatch):
    judged = []
    judge = regularity.strong_regularity

    def counted(*args, **kwargs):
        judged.append(1)
        return judge(*args, **kwargs)

    monkeypatch.setattr(regularity, "strong_regularity", counted)
    solution = nsspice.tran(nsspice.read(STATIC))
    assert not judged
    (island,) = solution.islands
    assert island.regularity.kind == "unique"
    assert island.regularity.points > 50
    assert len(judged) == 1


def test_a_solution_does_not_keep_large_systems_or_those_that_were_judged():
    ladder = "".join(f"R{k} n{k} n{k + 1} 1k\nD{k} n{k + 1} 0 Z\n" for k in range(80))
    large = f"ladder\nV1 n0 0 SIN(0 10 50)\n{ladder}.model Z D(Vfwd=0.7)\n.tran 1m 20m\n"
    for text, rows, kept in (STATIC, 1e-4, True), (large, 1e-3, False):
        circuit = nsspice.read(text)
        solution = nsspice.tran(circuit)
        system = weakref.ref(circuit.islands[0].assemble(tstep=rows, tstop=20e-3).system)
        del circuit
        gc.collect()
        assert (system() is not None) == kept
        assert solution.islands[0].regularity.kind in ("unique", "not known")
        gc.collect()
        assert system() is None


@pytest.mark.parametrize("text", DECKS.values(), ids=DECKS)
def test_solutions_can_be_sent_to_other_processes(text):
    solution = nsspice.tran(nsspice.read(text))
    sent = pickle.loads(pickle.dumps(solution))
    assert numbers(sent) == numbers(solution)
    verdicts = [str(s.islands[0].regularity) for s in (sent, solution)]
    assert verdicts[0] == verdicts[1]
    assert numbers(sent.with_jumps())[0] == numbers(solution.with_jumps())[0]


@pytest.mark.parametrize(("text", "method"), [(IDEAL, "modewise"), (SMOOTH, "sdirk")])
def test_what_an_engine_leaves_opens_as_arrays(text, method, monkeypatch):
    from nsspice.analyses.certificate.island_check import Examiner

    seen = []
    for name, kind in ("take", Records), ("take_intervals", Intervals):
        check = getattr(Examiner, name)

        def kept(self, left, check=check, kind=kind):
            seen.append(left)
            check(self, kind.of(left))  # the checks find the same in arrays

        monkeypatch.setattr(Examiner, name, kept)
    circuit = nsspice.read(text)
    by_arrays = nsspice.tran(circuit, method=method)
    monkeypatch.undo()
    assert numbers(nsspice.tran(circuit, method=method)) == numbers(by_arrays)
    intervals = Intervals.of(seen[0])
    k, s, n = intervals.z.shape
    system = circuit.islands[0].assemble(tstep=1e-4, tstop=20e-3).system
    assert n == system.n
    assert k > 0
    assert intervals.lam.shape == (k, s, system.m)
    assert intervals.time.shape == intervals.weight.shape == (k, s)
    with pytest.raises(AttributeError):
        _ = seen[0].colour


@pytest.mark.parametrize("text", DECKS.values(), ids=DECKS)
def test_a_run_does_not_depend_on_the_clock(text, monkeypatch):
    """How long the core may stay away is no reason for other digits."""
    found = []
    for budget in (1e-9, 1e9):
        monkeypatch.setattr(nsspice.analyses.transient.island_runner, "BUDGET", budget)
        # many rows in each segment
        found.append(numbers(nsspice.tran(nsspice.read(text), 20e-3, 2e-6, uic=True)))
    assert found[0][:3] == found[1][:3]
