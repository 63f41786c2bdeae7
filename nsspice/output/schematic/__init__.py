"""Schematics: a deck's elements placed in columns and rows, and drawn as SVG.

``parts`` reads the deck, ``levels`` decides what is above what, ``placement`` finds columns and
rows, ``symbols`` and ``drawing`` draw; each uses only those before it.
Imports ``circuit`` and ``netlist``.
"""

from __future__ import annotations

from .drawing import schematic

__all__ = ["schematic"]
