"""The certificate of a followed path: its linearised problems are what is solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from .certificate import Certificate

#: laws that are off by such a part of their terms are those of another point
_ASTRAY = 0.1


def of_linearised(certificate: Certificate, statistics: Mapping[str, Any]) -> Certificate:
    """Return the certificate of a followed path: its linearised problems are what is solved.

    How far the laws themselves are off at the points is an error of the method, of order four, and
    is in the statistics; a method that has lost its path, at a fold, has no such error.
    """
    off = float(statistics["grid_residual"])
    if not off <= _ASTRAY:
        return replace(certificate, laws=off)
    return replace(
        certificate,
        laws=float(statistics["residual_rows"]),
        complementarity=float(statistics["residual_complementarity"]),
        worst="",
    )
