"""Signatures of dataclasses on the site: `nsspice.dataclass` makes them as the standard library does.

The generator of the pages (griffe) reads the source and knows the decorator by its full name.
"""

from __future__ import annotations

from typing import Any

import griffe


class OwnDecorator(griffe.Extension):
    """Lets the decorator of this package count as the one that it stands for."""

    def on_alias_instance(self, *, alias: griffe.Alias, **_: Any) -> None:
        if alias.target_path == "nsspice.dataclass.dataclass":
            alias.target_path = "dataclasses.dataclass"
