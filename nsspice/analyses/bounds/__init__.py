"""Proved bounds of measures over tolerances.

Read ``search`` (the box and its parts), ``enclosure`` (one part), ``orbit`` and ``extremes`` (what
is proved), ``mode`` and ``flow`` (equations and motion), ``arrays``, ``carried`` and ``sources``
(how numbers of the deck depend on parameters).  Imports ``studies`` and the rooms before it.
"""
