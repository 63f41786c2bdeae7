"""Gates whose comparisons hold laws of their own: products, roots, limits, sources of differences.

The control of such a switch is one unknown, which is zero where the switch turns and shows none of
the terms that cancel in it.  Measured by what is left there, every control has missed its
threshold: switches turned back at the instant at which they had been located, turned half a
picosecond (on the edge of the saw two nanoseconds) late, and the certificate refused the run.  The
laws here are equal to a linear one where they are used, and the reference is the exact engine with
that one.
"""

import numpy as np
import pytest

import nsspice

DECK = """a capacitor that a switch charges, compared with a saw
Vin in 0 24
S1 in a g 0 swi
R1 a o 100
Ro o 0 100
Co o 0 47u IC=12
Vs s 0 PULSE(0 1 0 9.98u 10n 10n 10u)
{law}
.model swi SW(VT=0.5)
.tran 5u 0.1m uic
"""

LINEAR = "Bg g 0 V=if(v(o)/60 > v(s), 1, 0)"

LAWS = {
    "a limit": "Bg g 0 V=if(limit(v(o)/60, 0, 0.95) > v(s), 1, 0)",
    "a step": "Bg g 0 V=u(limit(v(o)/60, 0, 0.95) - v(s))",
    "a root": "Bg g 0 V=if(sqrt(v(o)*v(o))/60 > v(s), 1, 0)",
    "squares": "Bg g 0 V=if(v(o)*v(o)/3600 > v(s)*v(s), 1, 0)",
    "the least and the most": "Bg g 0 V=if(min(v(o)/60, 0.95) > max(0, v(s)), 1, 0)",
    "a product that vanishes": "Bg g 0 V=if((v(o)/60 - v(s))*(3 + v(o)/30) > 0, 1, 0)",
    "a steep law": "Bg g 0 V=if(tanh(100*(v(o)/60 - v(s))) > 0, 1, 0)",
    "a node with a law": "Bx x 0 V=limit(v(o)/60, 0, 0.95) - v(s)\nBg g 0 V=u(v(x))",
    "a node with a linear law": "Bx x 0 V=v(o)/60 - v(s)\nBg g 0 V=u(v(x))",
}

#: slope of the saw in volts that are compared [V/s], and the range of what is compared with it [V]
SLOPE, RANGE = 1.0 / 9.98e-6, 12.0 / 60.0
RELTOL = 1e-8


def events(solution: nsspice.Solution) -> np.ndarray:
    return np.array([e.time for e in solution.events if e.element.startswith("bg")])


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    solution = nsspice.tran(nsspice.read(DECK.format(law=LINEAR)), method="modewise")
    assert solution.certificate is not None
    assert solution.certificate.passed
    return events(solution)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_gates_turn_where_their_controls_vanish(law: str, reference: np.ndarray) -> None:
    deck = nsspice.read(DECK.format(law=law))
    solution = nsspice.tran(deck, method="sdirk", reltol=RELTOL)
    assert solution.certificate is not None
    assert solution.certificate.passed
    found = events(solution)
    if "u(" in law:  # two comparisons, so that it is one half at zero
        assert np.abs(found[::2] - found[1::2]).max() == 0.0
        found = found[::2]
    assert found.shape == reference.shape
    # the capacitor is known to the tolerance, in each of ten periods anew
    assert np.abs(found - reference).max() <= 10.0 * RELTOL * RANGE / SLOPE


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_no_gate_is_looked_for_twice(law: str) -> None:
    """At the default tolerance none of them was certified, in 3.5 times as many steps as now."""
    deck = nsspice.read(DECK.format(law=law))
    solution = nsspice.tran(deck, method="sdirk")
    linear = nsspice.tran(nsspice.read(DECK.format(law=LINEAR)), method="sdirk")
    assert solution.certificate is not None
    assert solution.certificate.passed
    times = 2 if "u(" in law else 1  # a step is two comparisons
    assert len(events(solution)) == times * len(events(linear))
