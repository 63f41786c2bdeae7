"""Time and memory of large circuits: islands, bridges on one grid, 20,000 diodes, a mesh."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: kind, size, steps, step [s]
CASES = [
    ("separate_bridges", 1000, 200, 1e-4),
    ("separate_bridges", 1000, 2000, 1e-4),
    ("separate_bridges", 5000, 50, 1e-4),
    ("bridges_on_a_grid", 32, 200, 1e-4),
    ("bridges_on_a_grid", 71, 100, 1e-4),
    ("mesh", 100, 100, 5e-6),
]
CHILD = """
import json, resource, sys, time
sys.path.insert(0, sys.argv[1])
import nsspice
from decks import large
kind, size, steps, h = sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), float(sys.argv[5])
signal = "v(n0_5)" if kind == "mesh" else "v(p0,m0)"
begin = time.perf_counter()
circuit = nsspice.read(getattr(large, kind)(size))
read = time.perf_counter()
run = nsspice.tran(circuit, steps * h, h, step=h, uic=True, signals=[signal])
end = time.perf_counter()
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps([read - begin, end - read, memory, run.certificate.passed]))
"""


@pytest.mark.parametrize(("kind", "size", "steps", "h"), CASES)
def test_scale(kind, size, steps, h):
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(ROOT / "tests"), kind, str(size), str(steps), str(h)],
        capture_output=True,
        text=True,
        check=True,
    )
    read, spent, memory, passed = json.loads(done.stdout)
    print(
        f"\n{kind}({size}): read {read:.2f} s, {steps} steps {spent:.2f} s, "
        f"{1e3 * spent / steps:.2f} ms a step, {memory:.0f} MB"
    )
    assert passed
