"""The core as compiled for browsers computes what it computes here.

What a run asks of the core is recorded, with its arrays, and made once more in a Python that has no
numpy: here, to see that the record is complete, and in Pyodide under Node.  Both compute in IEEE
arithmetic, and the buck's sources need no function of C's library, so that every number is the
same.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from browsing.recording import Recorder

import nsspice
from nsspice import _core

ROOT = Path(__file__).parents[2]
HELPERS = ROOT / "tests" / "browsing"
BUILT = ROOT / "build" / "playground"
needs_build = pytest.mark.skipif(
    not (BUILT / "runtime.json").exists() or shutil.which("node") is None,
    reason="needs node, and the core for browsers: make playground",
)


def recorded(method: str, path: Path) -> list[dict[str, object]]:
    """Record twenty periods of a buck converter, of which 1001 rows are written."""
    deck = ROOT / "netlists" / "converters" / "buck.net"
    # modules that a run imports name types of the core: they must find those, not the recorder
    nsspice.tran(nsspice.read(deck), stop=2e-6, uic=True, method=method)
    circuit = nsspice.read(deck)
    recorder = Recorder()
    with pytest.MonkeyPatch.context() as patch:
        recorder.put(patch)
        solution = nsspice.tran(circuit, stop=2e-4, uic=True, method=method)
    assert solution.certificate is not None
    assert solution.certificate.passed
    path.write_text(json.dumps(recorder.calls), "utf-8")
    return recorder.calls


def replayed(path: Path, core: Path) -> dict[str, float]:
    """Replay a record in a Python without numpy, and return differences by their calls."""
    search = os.pathsep.join([str(core), str(HELPERS)])
    done = subprocess.run(
        [sys.executable, "-S", str(HELPERS / "replay.py"), str(path)],
        capture_output=True, text=True, check=True, env={**os.environ, "PYTHONPATH": search},
    )  # fmt: skip
    (found,) = json.loads(done.stdout)
    assert found["calls"] == len(json.loads(path.read_text("utf-8")))
    return dict(found["worst"])


@pytest.fixture
def native(tmp_path: Path) -> Path:
    """Return a folder with the core of this machine alone."""
    folder = tmp_path / "core"
    folder.mkdir()
    origin = Path(str(_core.__file__))
    shutil.copy(origin, folder / origin.name)
    return folder


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_a_record_holds_all_that_the_core_is_told(
    method: str, tmp_path: Path, native: Path
) -> None:
    path = tmp_path / "record.json"
    calls = recorded(method, path)
    assert set(replayed(path, native).values()) == {0.0}
    # one digit of one row is seen
    (rows,) = (c["after"][0] for c in calls if c["name"] == "advance")  # type: ignore[index]
    values = rows["array"][2]
    place = max(range(len(values)), key=lambda k: abs(values[k]))
    values[place] *= 1.0 + 1e-12
    path.write_text(json.dumps(calls), "utf-8")
    worst = replayed(path, native)
    assert worst.pop("advance") == pytest.approx(1e-12, rel=1e-3)
    assert set(worst.values()) == {0.0}


@needs_build
def test_a_converter_is_the_same_in_pyodide(tmp_path: Path) -> None:
    paths = {method: tmp_path / f"{method}.json" for method in ("modewise", "sdirk")}
    counts = [len(recorded(method, path)) for method, path in paths.items()]
    (wheel,) = BUILT.glob("nsspice-*.whl")
    shutil.unpack_archive(wheel, tmp_path / "wheel", "zip")
    core = tmp_path / "wheel" / "nsspice" / "_core.abi3.so"
    done = subprocess.run(
        ["node", HELPERS / "replay.mjs", BUILT / "pyodide", core, HELPERS, *paths.values()],
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    for found, count in zip(json.loads(done.stdout), counts, strict=True):
        assert (found["bits"], found["calls"]) == (32, count)
        assert set(found["worst"].values()) == {0.0}
