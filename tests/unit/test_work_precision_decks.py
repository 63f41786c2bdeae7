"""The decks of the work-precision page as other programs take them: one command writes the page."""

import sys
from pathlib import Path

import pytest

import nsspice

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tools"))

import work_precision as page  # noqa: E402
from peers.describe import CannotError, elements  # noqa: E402

TAKEN = [
    "thesis/ex424_bridge_oscillator",
    "converters/buck",
    "converters/boost",
    "converters/lc_bridge_charger",
    "rectifiers/half_wave_inductive",
    "rectifiers/full_bridge_capacitor",
    "rectifiers/cockcroft_walton_4",
]


def read(name: str) -> nsspice.Circuit:
    return nsspice.read(ROOT / "netlists" / f"{name}.net")


@pytest.mark.parametrize("name", TAKEN)
def test_ideal_decks_are_described(name: str) -> None:
    """A name that had changed ended the command at the second deck."""
    circuit = read(name)
    found = elements(circuit)
    assert {e["kind"] for e in found} <= set("rclvds")
    # but for sources that are the laws of switches
    names = {e["name"] for e in found}
    assert {d.name for d in circuit.devices} - names <= {"vg", "vclk", "vctl", "vgate"}


@pytest.mark.parametrize("name", [*page.NETLISTS, *page.OWN])
def test_what_has_no_counterpart_is_named(name: str) -> None:
    circuit = nsspice.read(page.OWN[name]) if name in page.OWN else read(name)
    try:
        elements(circuit)
        refusal = ""
    except CannotError as error:
        refusal = str(error)
    assert bool(refusal) != (name in TAKEN or name in ("dcm_rectifier", "three_phase_bridge"))
    assert not refusal or any(device.name in refusal for device in circuit.devices)


def test_the_gate_of_a_buck() -> None:
    found = [e for e in elements(read("converters/buck")) if e["kind"] in "vs"]
    (source,) = [e for e in found if e["kind"] == "v"]
    (gate,) = [e for e in found if e["kind"] == "s"]
    assert (source["dc"], source["amplitude"]) == (24.0, 0.0)
    assert gate["period"] == pytest.approx(10e-6)
    assert 0.0 < gate["duty"] < 1.0
