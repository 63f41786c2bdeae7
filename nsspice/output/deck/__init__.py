"""Decks written again, from what was understood of them.

``words`` writes numbers and expressions, ``element_lines`` one line each, ``deck_text`` a whole
deck; ``conversion`` reads the result again and compares.
Imports ``circuit`` and ``netlist``.
"""
