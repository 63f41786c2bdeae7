"""A run whose certificate fails is refused by Python as by the command line, which exits with 3."""

from __future__ import annotations

import pickle
import warnings
from pathlib import Path

import pytest
from click.testing import CliRunner

import nsspice
from nsspice.cli.app import app

#: nothing limits the growth: its energies pass the range of numbers
UNSTABLE = """feedback of the wrong sign
R1 out p 15.9k
C1 p 0 10n IC=1n
E1 out 0 p 0 3
.tran 1m 100m uic
.meas tran first find v(out) at=1m
"""


@pytest.fixture
def failed() -> nsspice.CertificateError:
    with pytest.raises(nsspice.CertificateError) as caught:
        nsspice.read(UNSTABLE).run()
    return caught.value


def test_a_run_raises_with_its_solution_attached(failed: nsspice.CertificateError) -> None:
    assert isinstance(failed, nsspice.NsspiceError)
    assert (failed.code, failed.exit_code) == ("NS3003", 3)
    assert failed.solution.certificate is not None
    assert not failed.solution.certificate.passed
    assert failed.solution.failure == failed.diagnostics[0]
    # 3 exp(t / tau) times 1 nV, tau = R C / 2
    assert failed.solution.measures["first"] == pytest.approx(3e-9 * 2.7182818**12.5786, rel=1e-4)


def test_the_error_travels_between_processes(failed: nsspice.CertificateError) -> None:
    other = pickle.loads(pickle.dumps(failed))
    assert type(other) is nsspice.CertificateError
    assert str(other) == str(failed)
    assert other.solution.summary() == failed.solution.summary()
    assert other.solution["v(out)"].tolist() == failed.solution["v(out)"].tolist()
    # both sides of jumps and points between rows go with it
    assert other.solution.with_jumps().axis.size == failed.solution.with_jumps().axis.size


def test_a_warning_where_it_is_asked_for() -> None:
    with pytest.warns(nsspice.CertificateWarning, match="NS3003"):
        solution = nsspice.read(UNSTABLE).run(on_failure="warn")[0]
    assert [w.code for w in solution.warnings] == ["NS3003"]
    with pytest.warns(nsspice.CertificateWarning, match="NS3003"):
        nsspice.tran(nsspice.read(UNSTABLE), on_failure="warn")


def test_it_may_be_left_to_the_certificate() -> None:
    solution = nsspice.tran(nsspice.read(UNSTABLE), on_failure="ignore")
    assert solution.failure is not None
    assert not solution.warnings


def test_another_word_is_refused() -> None:
    with pytest.raises(nsspice.UsageError, match=r"NS4005.*on_failure cannot be 'stop'"):
        nsspice.tran(nsspice.read(UNSTABLE), on_failure="stop")


def test_all_steps_are_run_before_one_is_refused() -> None:
    deck = UNSTABLE + ".param k=0\n.step param k list 3 0.5\n"
    with pytest.raises(nsspice.CertificateError) as caught:
        nsspice.read(deck.replace("E1 out 0 p 0 3", "E1 out 0 p 0 {k}")).run()
    error = caught.value
    assert error.solution.parameters == {"k": 3.0}
    assert [s.parameters["k"] for s in error.solutions] == [3.0, 0.5]
    assert [s.failure is None for s in error.solutions] == [False, True]


def test_what_the_command_refuses_python_refuses(tmp_path: Path, monkeypatch) -> None:
    deck = Path(__file__).with_name("failed_certificate.net")
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["run", str(deck)])
    assert done.exit_code in (0, 3)
    assert Path("failed_certificate.csv").exists()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solution = nsspice.read(deck).run(on_failure="warn")[0]
    assert [str(w.category.__name__) for w in caught] == ["CertificateWarning"] * (
        done.exit_code == 3
    )
    assert (solution.failure is not None) == (done.exit_code == 3)
    assert solution.failure is None or solution.failure.message in done.output
    printed = done.output.splitlines()
    # all lines but the first, which holds the time that the run took
    assert all(line in printed for line in solution.summary(False).splitlines()[1:])


def test_estimates_of_the_error_are_there_in_python() -> None:
    circuit = nsspice.read("RC\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.tran 0.1m 5m uic\n")
    solution = circuit.run(tol=1e-6)[0]
    assert solution.error is not None
    assert solution.error.reached
    halved = circuit.run(refine=True)[0].error
    assert halved is not None
    assert halved.order == pytest.approx(1.0, abs=0.2)
    with pytest.raises(nsspice.UsageError, match="cannot be used together"):
        circuit.run(tol=1e-6, refine=True)
