"""The report: opened in a browser, zoomed by its address and read."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.output.report import write_report
from nsspice.output.report.waveforms import thinned

NETLISTS = Path(__file__).parents[3] / "netlists"
MAC = "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome"


def browser() -> str:
    """Return the browser; `make browser` installs one."""
    names = ("chromium", "chromium-browser", "google-chrome", "chrome", MAC)
    found = next((path for name in names if (path := shutil.which(name))), None)
    assert found, "this test needs a browser: apt install chromium"
    return found


def opened(page: Path, window: str = "") -> str:
    """Return what the page has become after its script has run."""
    done = subprocess.run(
        [browser(), "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=5000",
         "--window-size=1200,900", "--dump-dom", page.as_uri() + window],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    return done.stdout


@pytest.fixture(scope="module")
def buck(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "buck.html"
    circuit = nsspice.read(NETLISTS / "converters" / "buck.net")
    write_report(circuit, circuit.run(), path)
    return path


def test_a_report_is_opened_zoomed_and_read(buck: Path) -> None:
    dom = opened(buck, "#4.9e-3,4.95e-3")
    assert "Certificate holds" in dom
    assert re.search(r'role="status"[^>]*>4.9 ms to 4.95 ms<', dom)
    (drawn,) = re.findall(r"<output hidden[^>]*>(.*?)</output>", dom)
    voltage, current = json.loads(drawn)
    # five periods of 10 us are seen, with one point more at each side
    assert voltage[0][0] == pytest.approx(4.9e-3, abs=1e-6)
    assert voltage[0][1] == pytest.approx(4.95e-3, abs=1e-6)
    # ripple of the current: (Vin - V) D T / L = 0.6 A at V = 12 V; the swing has nearly decayed
    assert current[1][1] - current[1][0] == pytest.approx(0.6, rel=0.15)
    assert "v_avg" in dom
    assert dom.count("<canvas") >= 4  # two panels, and a strip for the switch and for the diode


def test_a_report_stands_alone(buck: Path) -> None:
    text = buck.read_text("utf-8")
    assert not re.search(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", text)
    data = text.partition('id="data"')[2].partition("</script>")[0]
    assert len(text) - len(data) < 500_000
    assert json.loads(data.partition(">")[2])["runs"][0]["verdict"]["state"] == "holds"


def test_what_a_deck_says_cannot_become_part_of_the_page(tmp_path: Path) -> None:
    circuit = nsspice.read("</script><b>x</b>\nV1 a 0 1\nR1 a 0 1\n.op\n")
    write_report(circuit, circuit.run(), tmp_path / "x.html")
    assert "<b>x</b>" not in (tmp_path / "x.html").read_text("utf-8")
    dom = opened(tmp_path / "x.html")
    assert "Operating point" in dom
    assert "&lt;b&gt;x" in dom


def test_steps_are_tabs_with_a_table_of_all_measures(tmp_path: Path) -> None:
    circuit = nsspice.read(
        "steps\n.param r=1k\nV1 a 0 1\nR1 a b {r}\nC1 b 0 1u IC=0\n.step param r list 1k 2k\n"
        ".tran 0.1m 1m uic\n.measure tran v FIND v(b) AT=1m\n"
    )
    write_report(circuit, circuit.run(), tmp_path / "x.html")
    dom = opened(tmp_path / "x.html")
    assert dom.count('role="tab"') == 2
    assert "Measures of all runs" in dom
    assert f"{1 - np.exp(-0.5):.6f}"[:8] in dom


def test_thinning_keeps_every_extreme() -> None:
    rng = np.random.default_rng(1)
    y = rng.standard_normal((3, 100_003))
    x = np.arange(100_003.0)
    u, v = thinned(x, y, 4000)
    assert u.size <= 4000
    assert np.all(np.diff(u) >= 0)
    assert np.array_equal(v.max(axis=1), y.max(axis=1))
    assert np.array_equal(v.min(axis=1), y.min(axis=1))
    size = -(-2 * 100_003 // 4000)
    for k in (0, 7, u.size // 2 - 1):  # extremes of each cell
        cell = y[:, k * size : (k + 1) * size]
        assert np.array_equal(v[:, 2 * k : 2 * k + 2].max(axis=1), cell.max(axis=1))
