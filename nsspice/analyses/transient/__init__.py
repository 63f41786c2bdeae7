"""Transients: every island through time by its engine, output points side by side.

Read ``transient`` first, then ``advance`` (the loop over blocks of output points) and
``island_runner`` (one island, one engine).  ``measure``, ``integrals``, ``spectrum``, ``losses``
and ``heat`` evaluate a finished run.  Imports ``static`` and the rooms before it.
"""
