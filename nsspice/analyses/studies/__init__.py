"""Many runs: everything a deck asks for, step by step, refined, varied or differentiated.

Read ``batch`` first (all analyses of a deck for all values of ``.step``); ``refinement`` runs to a
tolerance, ``variation`` spreads parameters, ``measured_slopes`` differentiates measures.  Imports
all other rooms.
"""
