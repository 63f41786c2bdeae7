"""Sensitivities of averages against differences of two orbits, and against closed forms."""

from __future__ import annotations

import pytest
from decks.steady import DISCONTINUOUS, LLC

import nsspice

LOSSY = """Boost with losses and a comparator that sees the output
Vin in 0 12
L1 in x 50u
RL x sw 50m
S1 sw 0 c saw SH
D1 sw out DX
C1 out e 22u
RE e 0 30m
R1 out 0 20
Rf out n 90k
Rn n 0 10k
Cn n 0 1n
Vref ref 0 2.6
E1 c 0 ref n 0.5
Vsaw saw 0 PULSE(0 1 0 10u 0 0 10u)
.model SH SW(VT=0 RON=20m)
.model DX D(Ron=15m Vfwd=0.5)
"""


def average(network: nsspice.Circuit, signal: str, **values: float) -> float:
    sol = nsspice.pss(network, values=values, row_step=None)
    return float(sol.integrals.coefficients([signal], [0])[signal][0].real)


@pytest.mark.parametrize(
    ("text", "signals"),
    [
        (LOSSY, ["v(out)", "i(l1)", "i(r1)", "v(n)", "v(sw)"]),
        (DISCONTINUOUS, ["v(out)", "i(l1)", "i(c1)"]),
        (LLC.replace("K1 Lm Ls 1", "K1 Lm Ls 0.98") + "Rs x 0 1\nLx x 0 1m\n", ["v(o)"]),
    ],
    ids=["closed loop", "discontinuous", "llc"],
)
def test_sensitivities_are_the_limit_of_differences(text: str, signals: list[str]) -> None:
    network = nsspice.read(text)
    found = nsspice.sens(network, signals)
    compared = 0
    orbit = nsspice.pss(network).integrals
    scales = {signal: orbit.rms(signal) for signal in signals}
    for s in found:
        if not s.value:
            continue
        h = 1e-4 * s.value
        up, down = (average(network, s.signal, **{s.element: s.value + d}) for d in (h, -h))
        difference = (up - down) / (2 * h)
        # the second order of 1e-4 in h, and the rounding of averages over h
        size = max(abs(s.relative), scales[s.signal])
        assert abs(difference * s.value - s.relative) < 1e-6 * size, (s.element, s.signal)
        compared += 1
    assert compared >= 4
    assert {s.signal for s in found} == set(signals)


def test_a_source_of_a_linear_circuit() -> None:
    text = "rc\nV1 a 0 PULSE(0 1 0 0 0 3u 10u)\nI1 0 b 2m\nR1 a b 1k\nC1 b 0 10n\nR2 b 0 3k\n"
    found = {s.element: s for s in nsspice.sens(nsspice.read(text), ["v(b)"])}
    assert found["v1"].derivative == pytest.approx(0.75, rel=1e-12)
    assert found["i1"].derivative == pytest.approx(750.0, rel=1e-12)
    assert found["c1"].derivative == pytest.approx(0.0, abs=1e-3)  # of 1e8 V/F
    assert found["v1"].average == pytest.approx(0.75 * 0.3 + 1.5, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "arguments", "code"),
    [
        ("c\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n", {"elements": ["r9"]}, "NS4005"),
        ("c\nV1 a 0 5\nR1 a b 1k\nC1 b 0 1u\n.pss trigger=v(b)\n", {}, "NS4021"),
    ],
)
def test_errors(text: str, arguments: dict[str, list[str]], code: str) -> None:
    with pytest.raises(nsspice.NsspiceError) as caught:
        nsspice.sens(nsspice.read(text), ["v(b)"], **arguments)
    assert caught.value.diagnostics[0].code == code
