"""Tests of this folder look at points and certificates of runs themselves."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _runs_return(runs_return: None) -> None:
    """Runs return whatever their certificate says."""
