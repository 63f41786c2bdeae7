"""Currents of a size that no circuit carries: a run that shows some says so."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...errors import Diagnostic

#: More than this current for each volt, and for less than one, passes less than a microohm: a joint
#: of busbars has more.
_MOST = 1e6


def huge_currents(names: Sequence[str], sizes: npt.NDArray[np.float64]) -> Diagnostic | None:
    """Return a warning if the largest current is huge relative to the largest voltage.

    Parameters
    ----------
    names : sequence of str
        Signals.
    sizes : ndarray, shape (k,)
        The largest magnitude of each in a run [V], [A].

    Examples
    --------
    >>> found = huge_currents(["v(a)", "i(v1)"], np.array([5.0, 2e8]))
    >>> found.code, found.message
    ('NS5006', 'i(v1) reaches 2e+08 A in a circuit of 5 V')
    >>> huge_currents(["v(a)", "i(v1)"], np.array([5.0, 2e4])) is None
    True
    """
    found = [(float(size), name) for name, size in zip(names, sizes, strict=False)]
    of_kind = {kind: [f for f in found if f[1].startswith(kind)] for kind in ("v(", "i(")}
    volts = max(of_kind["v("], default=(0.0, ""))[0]
    amperes, name = max(of_kind["i("], default=(0.0, ""))
    if not amperes > _MOST * max(volts, 1.0):
        return None
    return Diagnostic(
        "NS5006",
        f"{name} reaches {amperes:.3g} A in a circuit of {volts:.3g} V",
        None,
        "a loop of sources, capacitors and closed switches lacks the resistance of the real "
        "circuit, or the deck contradicts itself",
        severity="warning",
    )
