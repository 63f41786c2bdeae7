"""Saturating controllers in closed loops: the exact engine against steps on another form.

The oracle evaluates the expressions on a tape, as smooth laws with kinks, and follows the loop by
steps with error control; the exact engine has pairs and switches instead.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.random_controllers import controller_deck

import nsspice
from nsspice.devices.expressions import behavioural

#: `sdirk` meets its tolerance of 1e-10 per step within this part of the range, over 4 s of a loop
#: whose slowest part forgets in about 1 s
ERROR = 1e-8


def check(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    text = controller_deck(seed)
    exact = nsspice.tran(nsspice.read(text))
    assert exact.islands[0].method == "modewise"
    with monkeypatch.context() as patch:
        patch.setattr(behavioural, "piecewise", lambda node, name: None)
        circuit = nsspice.read(text)
        assert any(device.smooth for device in circuit.devices)
        steps = nsspice.tran(circuit, method="sdirk")
    for name in ("v(p0)", "v(p1)", "v(int)"):
        scale = max(1.0, float(np.abs(exact[name]).max()))
        assert np.abs(exact[name] - steps[name]).max() <= ERROR * scale, name


@pytest.mark.parametrize("seed", range(12))
def test_pairs_and_tapes_agree(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    check(seed, monkeypatch)


@pytest.mark.soak
def test_pairs_and_tapes_agree_often(monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(1000, 1300):
        check(seed, monkeypatch)
