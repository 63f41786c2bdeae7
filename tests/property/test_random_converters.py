"""Random converters with parasitic elements: both engines are certified, and agree.

``-m soak`` takes many more.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.random_converters import converter

import nsspice
from nsspice.analyses.studies.refinement import stored_quantities

RELTOL = 1e-6
#: coils shorted by ideal switches; what a resistor ties together stores; isolated secondaries; from
#: rest behind three phases; a resonant converter before a Cuk; coils cut off in series with a
#: capacitor; laws of groups that are not monotone as they stand; picofarads that switches discharge
FOUND = (35, 36, 112, 138, 151, 168, 171, 205, 259, 306, 386, 10_039, 10_180, 10_270, 30_011)
FOUND += (30_036,)
#: windings shorted on both sides share their flux in many ways; operating points at rest
FOUND += (10_151, 10_186, 10_244, 10_298, 510_229)
#: both windings begin without a current; a step within rounding of the edge it begins at
FOUND += (10_092, 10_234, 510_065)


def agree(seed: int) -> None:
    """Steps with error control meet the exact engine, of which nothing but rounding is known."""
    text = converter(seed)
    circuit = nsspice.read(text)
    names = stored_quantities(circuit)
    exact = nsspice.tran(circuit, method="modewise", signals=names)
    run = nsspice.tran(circuit, method="sdirk", reltol=RELTOL, signals=names)
    assert exact.certificate.passed, text
    assert run.certificate.passed, text
    largest = {
        kind: max((np.abs(exact[n]).max() for n in names if n[0] == kind), default=0.0)
        for kind in "vi"
    }
    shared: set[str] = set()
    if "undetermined" in (exact.certificate.uniqueness, run.certificate.uniqueness):
        couplings = [e for e in circuit.deck.elements if e.letter == "k" and e.value == 1.0]
        shared = {f"i({coil})" for k in couplings for coil in k.controls}
    for name in (n for n in names if n not in shared):
        # beside edges a row lies on one side or the other: the mean counts
        distance = np.abs(run[name] - exact[name])[1:].mean()
        assert distance <= 1e-3 * largest[name[0]], (name, text)


@pytest.mark.parametrize("seed", [*range(0, 30, 2), *FOUND])
def test_two_engines_agree(seed):
    agree(seed)


def test_inductors_in_series_at_rest_but_for_rounding():
    """Behind a diode that never conducts 1e-20 V and A are left, next to 5 V and 5 A."""
    run = nsspice.tran(nsspice.read(converter(510_144)), method="sdirk", reltol=RELTOL)
    assert run.certificate.passed


@pytest.mark.soak
@pytest.mark.parametrize("first", range(10_000, 10_400, 20))
def test_soak(first):
    for seed in range(first, first + 20):
        agree(seed)


@pytest.mark.parametrize("seed", [10, 11, 12, 14, 15, 57, 96])
def test_smooth_ones_are_certified(seed):
    text = converter(seed, smooth=True)
    assert nsspice.tran(nsspice.read(text), reltol=1e-4).certificate.passed, text
