"""Controllers that are FMUs: one of FMI 3 that a deck was exported to, one of FMI 2 in C."""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import nsspice
from nsspice import Controller
from nsspice.cli.app import app
from nsspice.errors import UsageError
from nsspice.output.fmu import write_fmu

fmpy = pytest.importorskip("fmpy")

PERIOD, TAU = 1e-4, 3e-4
PLANT = """an RC that is driven by what a unit answers
Vu u 0 1
R1 u x 1k
C1 x 0 1u IC=0
.tran 100u 3m uic
"""
FILTER = """a filter as a unit
.param r=100
Vin in 0 0
R1 in y {r}
C1 y 0 1u IC=0
.tran 100u 1m uic
"""
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="law" guid="{1}">
<CoSimulation modelIdentifier="law" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<ScalarVariable name="x" valueReference="0" causality="input" variability="continuous">
<Real start="0"/></ScalarVariable>
<ScalarVariable name="u" valueReference="1" causality="output" variability="continuous">
<Real/></ScalarVariable>
<ScalarVariable name="gain" valueReference="2" causality="parameter" variability="fixed">
<Real start="1"/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure>
</fmiModelDescription>
"""
#: an integrator of gain (1 - x), by Euler's explicit method
IN_C = """
#include <stdlib.h>
typedef struct { double v[3]; } law;
typedef unsigned int ref;
#define OTHER(name) int name(void) { return 0; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *a, int b, const char *c, const char *d, void *e, int f, int g)
{ law *l = calloc(1, sizeof(law)); l->v[2] = 1.0; return l; }
void fmi2FreeInstance(void *l) { free(l); }
int fmi2SetReal(law *l, const ref *r, size_t n, const double *v)
{ for (size_t k = 0; k < n; k++) l->v[r[k]] = v[k]; return 0; }
int fmi2GetReal(law *l, const ref *r, size_t n, double *v)
{ for (size_t k = 0; k < n; k++) v[k] = l->v[r[k]]; return 0; }
int fmi2DoStep(law *l, double t, double h, int same)
{ l->v[1] += h * l->v[2] * (1.0 - l->v[0]); return 0; }
int fmi2SetupExperiment(void *l, int a, double b, double c, int d, double e) { return 0; }
OTHER(fmi2SetDebugLogging) OTHER(fmi2EnterInitializationMode) OTHER(fmi2ExitInitializationMode)
OTHER(fmi2Terminate) OTHER(fmi2Reset) OTHER(fmi2GetInteger) OTHER(fmi2GetBoolean)
OTHER(fmi2GetString) OTHER(fmi2SetInteger) OTHER(fmi2SetBoolean) OTHER(fmi2SetString)
OTHER(fmi2GetFMUstate) OTHER(fmi2SetFMUstate) OTHER(fmi2FreeFMUstate)
OTHER(fmi2SerializedFMUstateSize) OTHER(fmi2SerializeFMUstate) OTHER(fmi2DeSerializeFMUstate)
OTHER(fmi2GetDirectionalDerivative) OTHER(fmi2SetRealInputDerivatives)
OTHER(fmi2GetRealOutputDerivatives) OTHER(fmi2CancelStep) OTHER(fmi2GetStatus)
OTHER(fmi2GetRealStatus) OTHER(fmi2GetIntegerStatus) OTHER(fmi2GetBooleanStatus)
OTHER(fmi2GetStringStatus)
"""


@pytest.fixture(scope="module")
def law(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an FMU of FMI 2, compiled here."""
    compiler = shutil.which("cc")
    if compiler is None or sys.platform != "linux":
        pytest.skip("needs a C compiler on Linux")
    folder = tmp_path_factory.mktemp("unit")
    (folder / "law.c").write_text(IN_C)
    command = [compiler, "-shared", "-fPIC", "-w", "-o", "law.so", "law.c"]
    subprocess.run(command, cwd=folder, check=True)
    with zipfile.ZipFile(folder / "law.fmu", "w") as unit:
        unit.writestr("modelDescription.xml", DESCRIPTION)
        unit.write(folder / "law.so", "binaries/linux64/law.so")
    return folder / "law.fmu"


def test_a_unit_of_fmi_2_acts_at_the_end_of_its_steps(law: Path) -> None:
    controller = Controller.from_fmu(law, PERIOD, ["v(x)"], ["vu"], {"gain": 500.0})
    circuit = nsspice.read(PLANT)
    x, u, expected = 0.0, 0.0, []
    for _ in range(31):
        expected.append(x)
        x, u = u + (x - u) * math.exp(-PERIOD / 1e-3), u + PERIOD * 500.0 * (1.0 - x)
    for _ in range(2):  # each run begins anew
        solution = nsspice.tran(circuit, controllers=[controller])
        assert solution.certificate.passed
        assert np.abs(solution["v(x)"] - expected).max() <= 1e-13  # 30 sums of numbers below 1


def test_a_deck_controls_another_one(tmp_path: Path) -> None:
    pytest.importorskip("pythonfmu3")
    unit = tmp_path / "filter.fmu"
    write_fmu(nsspice.read(FILTER), unit, ["vin"], ["v(y)"])
    controller = Controller.from_fmu(unit, PERIOD, ["v(x)"], ["vu"], {"r": TAU / 1e-6})
    solution = nsspice.tran(nsspice.read(PLANT), controllers=[controller])
    x = y = read = 0.0
    expected = []
    for k in range(31):
        expected.append(x)
        if k:
            y = read + (y - read) * math.exp(-PERIOD / TAU)
        read = x
        x = y + (x - y) * math.exp(-PERIOD / 1e-3)
    assert np.abs(solution["v(x)"] - expected).max() <= 1e-13  # nothing here but the start is 0


def test_the_command_line_takes_a_unit(law: Path, tmp_path: Path) -> None:
    deck, out = tmp_path / "plant.net", tmp_path / "plant.csv"
    deck.write_text(PLANT)
    told = f"{law} period=100u reads=v(x) writes=vu gain=500"
    command = ["run", str(deck), "-o", str(out), "--controller", told]
    assert CliRunner().invoke(app, command).exit_code == 0
    assert 0.05 < np.loadtxt(out, delimiter=",", skiprows=1)[-1, 2] < 1.0
    assert CliRunner().invoke(app, [*command, "--confined", "--force"]).exit_code == 2


def test_what_is_refused(law: Path, tmp_path: Path) -> None:
    (tmp_path / "none.fmu").write_text("nothing")
    for path, reads, values in (
        (tmp_path / "none.fmu", ["v(x)"], {}),
        (law, [], {}),
        (law, ["v(x)"], {"gian": 1.0}),
    ):
        with pytest.raises(UsageError):
            Controller.from_fmu(path, PERIOD, reads, ["vu"], values)
    controller = Controller.from_fmu(law, PERIOD, ["v(x)"], ["vu"])
    with pytest.raises(UsageError, match="does not say"):
        nsspice.pss(nsspice.read(PLANT), controllers=[controller])
