"""Random decks of everyday kind: every run is certified, or refused by name before it begins."""

from __future__ import annotations

import numpy as np
import pytest
from decks import everyday_circuits

import nsspice
from nsspice.errors import InfeasibleError, StepError, TopologyError

SEEDS = 200
#: a loop with gain grows beyond the range of numbers within the run: no energy is one
GROWS = 1e100


@pytest.mark.parametrize("first", range(0, SEEDS, 20))
def test_ideal_laws_mode_by_mode(first: int) -> None:
    refused = 0
    for seed in range(first, first + 20):
        text = everyday_circuits.ideal(seed)
        try:
            run = nsspice.tran(nsspice.read(text), method="modewise")
        except (InfeasibleError, TopologyError):
            refused += 1
            continue
        except StepError as error:
            if "exceeds the range of numbers" not in str(error):
                raise
            continue
        assert run.certificate.passed or _largest(run) > GROWS, text
    assert refused <= 2


@pytest.mark.parametrize("first", range(0, 60, 20))
def test_smooth_laws_by_the_default_method(first: int) -> None:
    for seed in range(first, first + 20):
        text = everyday_circuits.smooth(seed)
        assert nsspice.tran(nsspice.read(text)).certificate.passed, text


@pytest.mark.parametrize("first", range(0, 40, 20))
def test_two_engines_agree(first: int) -> None:
    """Steps with error control meet the exact engine within some hundred times their tolerance."""
    for seed in range(first, first + 20):
        text = everyday_circuits.ideal(seed)
        exact = nsspice.tran(nsspice.read(text), method="modewise")
        run = nsspice.tran(nsspice.read(text), method="sdirk", reltol=1e-7)
        largest = {kind: _largest(exact, kind) for kind in "vi"}
        for name, values in exact.signals.items():
            if name.startswith("i(l") or name == "v(n1)":
                # beside edges rows lie on one side or the other: the mean counts
                distance = np.abs(run[name] - values).mean()
                assert distance <= 1e-4 * largest[name[0]], (text, name)


def _largest(run: nsspice.Solution, kind: str = "") -> float:
    signals = run.signals.items()
    return max(float(np.abs(values).max()) for name, values in signals if name.startswith(kind))
