"""What one block of a circuit hands to another while it is solved."""

from __future__ import annotations

from .._core import Polynomial

__all__ = ["Polynomial"]
