"""The certificate: how well the points of a run satisfy the equations that the deck states.

Read ``certificate`` first, then ``island_check``, which passes the records of an engine to the
checks: energy, expressions, comparisons, pieces, jumps.  ``regularity`` and ``uniqueness`` decide
whether a solution is unique, ``failure`` names elements.  Imports ``request``, ``signals``.
"""
