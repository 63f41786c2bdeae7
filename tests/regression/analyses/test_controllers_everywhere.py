"""One digital control law four times: in Python, in C, as a function of z, and as a recursion."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import nsspice
from nsspice import Controller
from nsspice.cli.app import app
from nsspice.errors import NsspiceError, UsageError

#: duty = 0.3 + (0.02 z - 0.018)/(z - 1) (12 - v(out)), a period late
BUCK = """digitally controlled buck
.param rload=5
Vin in 0 24
{law}
Vtri tri 0 PULSE(0 1 0 10u 0 0 10u)
Bg g 0 V={{v(d)>v(tri)}}
S1 in sw g 0 ideal
D1 0 sw
L1 sw out 100u IC=2.4
C1 out 0 100u IC=11
R1 out 0 {{rload}}
.model ideal SW(VT=0.5)
.tran 10u 3m uic
.measure tran last find v(d) at=2.995m
"""
HELD = BUCK.format(law="Vduty d 0 0.3")
CLOCKED = BUCK.format(
    law="Eduty d 0 ZTRANS {12 - v(out)} = {(0.02*z - 0.018)/(z - 1)} period={1/100k} "
    "delay=10u ic=0.3 min=0 max=0.95"
)
SOURCE = r"""
#include <nsspice/controller.h>
#include <string.h>
struct memory { double left; };
size_t state_size(void) { return sizeof(struct memory); }
void start(void *state) { struct memory m = {0.3}; memcpy(state, &m, sizeof m); }
void step(const double *in, double *out, void *state) {
    struct memory *m = state;
    double error = 12.0 - in[0], duty = 0.02 * error + m->left;
    duty = duty < 0.0 ? 0.0 : duty > 0.95 ? 0.95 : duty;
    m->left = duty - 0.018 * error;
    out[0] = duty;
}
"""
PERIOD = 10e-6


class Law:
    """The same recursion in Python."""

    def __init__(self) -> None:
        self.state = [0.3]

    def __call__(self, time, values):
        (left,) = self.state
        error = 12.0 - values[0]
        duty = min(max(0.02 * error + left, 0.0), 0.95)
        self.state = [duty - 0.018 * error]
        return duty


def in_python() -> Controller:
    return Controller(PERIOD, ["v(out)"], ["vduty"], Law(), delay=PERIOD)


@pytest.fixture(scope="module")
def library(tmp_path_factory) -> Path:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("there is no C compiler")
    folder = tmp_path_factory.mktemp("controller")
    include = CliRunner().invoke(app, ["--include"]).output.strip()
    (folder / "law.c").write_text(SOURCE)
    command = [compiler, "-shared", "-fPIC", "-O2", "-ffp-contract=off", "-I", include]
    subprocess.run([*command, "-o", folder / "law.so", folder / "law.c"], check=True)
    return folder / "law.so"


def test_python_c_and_functions_of_z_agree(library: Path) -> None:
    held = nsspice.read(HELD)
    python = nsspice.tran(held, controllers=[in_python()])
    in_c = Controller.from_library(library, PERIOD, ["v(out)"], ["vduty"], delay=PERIOD)
    c = nsspice.tran(held, controllers=[in_c])
    clocked = nsspice.tran(nsspice.read(CLOCKED))
    assert python.certificate.passed
    assert c.certificate.passed
    assert clocked.certificate.passed
    for name in ("v(out)", "v(d)", "i(l1)"):
        assert np.abs(python[name] - c[name]).max() == 0.0
        # the function of z adds in another order: an amplification of rounding by the loop
        assert np.abs(python[name] - clocked[name]).max() <= 1e-12


def test_steady_states_agree(library: Path) -> None:
    in_c = Controller.from_library(library, PERIOD, ["v(out)"], ["vduty"], delay=PERIOD)
    orbits = [
        nsspice.pss(nsspice.read(HELD), controllers=[in_python()]),
        nsspice.pss(nsspice.read(HELD), controllers=[in_c]),
        nsspice.pss(nsspice.read(CLOCKED)),
    ]
    for orbit in orbits:
        assert orbit["v(out)"][0] == pytest.approx(12.0, abs=1e-10)
        assert orbit["v(d)"][-2] == pytest.approx(orbits[0]["v(d)"][-2], abs=1e-10)


def test_sweeps_begin_each_run_anew(library: Path) -> None:
    loads = [4.0, 5.0, 6.0, 5.0]
    tables = [
        nsspice.sweep(nsspice.read(HELD), {"rload": loads}, controllers=[in_python()], workers=1),
        nsspice.sweep(nsspice.read(CLOCKED), {"rload": loads}, workers=1),
    ]
    for table in tables:
        assert table["last"][1] == table["last"][3]
        assert len(set(table["last"][:3])) == 3
    assert tables[0]["last"] == pytest.approx(tables[1]["last"], abs=1e-12)
    single = nsspice.run(HELD.replace("=5\n", "=6\n"), controllers=[in_python()])
    assert single[0].measures["last"] == tables[0]["last"][2]


def test_the_command_line_takes_a_library(library: Path, tmp_path: Path) -> None:
    deck, out = tmp_path / "buck.net", tmp_path / "buck.csv"
    deck.write_text(HELD)
    told = f"{library} period=10u reads=v(out) writes=vduty delay=10u"
    command = ["run", str(deck), "-o", str(out), "--signals", "v(d)", "--controller", told]
    assert CliRunner().invoke(app, command).exit_code == 0
    rows = np.loadtxt(out, delimiter=",", skiprows=1)
    python = nsspice.tran(nsspice.read(HELD), controllers=[in_python()])
    # what is recorded decides about the last digits, which the loop amplifies
    assert np.abs(rows[:, 1] - python["v(d)"]).max() <= 1e-12
    assert CliRunner().invoke(app, [*command, "--confined", "--force"]).exit_code == 2
    for wrong in ("", f"{library}", f"{library} period=fast", f"{library} period=1u twice=2"):
        command[-1] = wrong
        assert CliRunner().invoke(app, [*command, "--force"]).exit_code == 2, wrong


def test_libraries_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(UsageError):
        Controller.from_library(tmp_path / "missing.so", 1.0, [], [])
    with pytest.raises(UsageError):
        Controller.from_library(np._core.multiarray.__file__, 1.0, [], [])


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ("ZTRANS {v(out)} = {exp(z)} period=1u", "NS1002"),
        ("ZTRANS {v(out)} = {z*z/(z-1)} period=1u", "NS1025"),
        ("ZTRANS {v(out)} = {1/(z-1)}", "NS1008"),
        ("ZTRANS {v(out)} = {1/(z-1)} period=0", "NS1025"),
        ("ZTRANS {v(out)} = {1/(z-1)} period=v(out)", "NS1010"),
        ("ZTRANS {v(out)} = {1/(z-1)} period=1u often=2", "NS1014"),
        ("ZTRANS {v(out)} = {1/0} period=1u", "NS1024"),
        ("ZTRANS {v(out)}", "NS1080"),
    ],
)
def test_functions_of_z_that_cannot_be_read(wrong: str, code: str) -> None:
    with pytest.raises(NsspiceError) as error:
        nsspice.read(BUCK.format(law=f"Eduty d 0 {wrong}"))
    assert error.value.code == code


def test_analyses_that_know_no_clock_refuse() -> None:
    circuit = nsspice.read(CLOCKED)
    for analysis in (
        lambda: nsspice.ac(circuit, [1e3]),
        lambda: nsspice.start(circuit),
        lambda: nsspice.gradient(circuit),
        lambda: nsspice.bounds(circuit, {"r1": 0.1}),
    ):
        with pytest.raises(UsageError):
            analysis()


def test_a_filter_of_second_order_in_a_subcircuit() -> None:
    deck = """moving average of three samples, twice
V1 a 0 PWL(0 0 10m 10)
X1 a b average
X2 b c average
Rc c 0 1
.subckt average in out params: t=1m
G1 0 out ZTRANS {v(in)} = {(z*z + z + 1)/(3*z*z)} period={t}
R1 out 0 1
.ends
.tran 1m 10m
"""
    solution = nsspice.tran(nsspice.read(deck))  # nothing is sampled at its end
    ramp = np.arange(10.0)
    kernel = np.ones(3) / 3.0
    # the second filter samples just before the first one moves, and R1 with Rc halves its output
    first = np.convolve(ramp, kernel)[:10]
    second = np.convolve(np.concatenate([[0.0], first[:-1]]), kernel)[:10]
    assert solution["v(b)"][:10] == pytest.approx(first, abs=1e-12)
    assert solution["v(c)"][:10] == pytest.approx(0.5 * second, abs=1e-12)
