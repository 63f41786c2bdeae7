"""Many runs: everything a deck asks for, step by step, refined, varied or differentiated.

Read ``batch`` first (all analyses of a deck for all values of ``.step``); ``refinement`` runs to a
tolerance, ``measured_slopes`` differentiates measures, ``explanation`` says what is run.  Imports
all other rooms.
"""
