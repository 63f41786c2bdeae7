"""Transients: every island through time by its engine, output points side by side.

Read ``transient`` first, then ``advance`` (the loop over blocks of output points) and
``island_runner`` (one island, one engine).  ``measure`` evaluates a finished run.  Imports
``averages`` and the rooms before it.
"""
