"""Edges of current sources into coils, beside capacitors without a connection to ground.

Impulsive steps of femtoseconds turn fluxes into gigavolts.  In the rounding of the charge that a
floating capacitor has at such a potential amperes are lost, among them the current that keeps a
diode conducting.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

START, EDGE, COIL = 0.224, 0.388, 3.837e-6

#: the diode may only carry the sum of both currents, nothing before the edge, positive after it
DECK = f"""a coil and a current source feed a diode through a capacitor
D1 m 0 {{model}}
C1 m n 44n IC={{voltage}}
I1 0 n PULSE({START} {EDGE} 3u 0 0 0.5u 9u)
L1 0 n {COIL} IC=-{START}
.model ideal D(ideal)
.model drop D(Vfwd=0.7)
.tran 0.1u 3.2u uic
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
@pytest.mark.parametrize("model", ["ideal", "drop"])
@pytest.mark.parametrize("voltage", [3.8, -3.8, 0.0])
def test_a_coil_keeps_the_flux_that_a_diode_lets_it_keep(
    voltage: float, model: str, method: str
) -> None:
    """The new current passes the diode, which the old flux of the coil allows: nothing jumps."""
    text = DECK.format(model=model, voltage=voltage)
    run = nsspice.tran(nsspice.read(text), method=method)
    assert run.certificate is not None
    assert run.certificate.passed
    edge = int(np.argmin(np.abs(run.time - 3e-6)))
    before, after = run["i(l1)"][edge - 1 : edge + 1]
    # the projection in the norm of the energy onto i(l1) >= -I1 leaves what fulfils it; NO_JUMP of
    # the core is 1e-9, and the row before shows that nothing moves through the blocking diode
    assert before == pytest.approx(-START, rel=1e-9)
    assert after == pytest.approx(-START, rel=1e-9)
    assert [jump for jump in run.jumps if jump.time > 1e-6] == []
    assert run["i(d1)"][edge] == pytest.approx(EDGE - START, rel=1e-9)


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_coil_loses_what_a_diode_does_not_let_it_keep(method: str) -> None:
    """A lower current of the source would turn the diode round: the coil keeps that much."""
    text = DECK.format(model="ideal", voltage=3.8).replace(str(EDGE), "0.1")
    run = nsspice.tran(nsspice.read(text), method=method)
    assert run.certificate is not None
    assert run.certificate.passed
    edge = int(np.argmin(np.abs(run.time - 3e-6)))
    assert run["i(l1)"][edge] == pytest.approx(-0.1, rel=1e-9)
    (jump,) = (jump for jump in run.jumps if jump.time > 1e-6)
    # of both energies, less what the source gives: (I - i)^2 L / 2
    lost = 0.5 * COIL * (START - 0.1) ** 2
    assert jump.lost == pytest.approx(lost, rel=1e-6)
