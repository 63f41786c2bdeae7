"""The certificate: how well the points of a run satisfy the equations that the deck states.

Read ``certificate`` first, then ``island_check``, which feeds what an engine recorded to the
checks: energy, expressions, comparisons, pieces, jumps.  ``regularity`` and ``uniqueness`` say
whether a solution is the only one, ``failure`` names elements.  Imports ``request``, ``signals``.
"""
