"""Expansion: subcircuits unfolded, parameters and node names put in.

Read ``body`` (the lines of a deck or subcircuit), ``scope`` (the names in sight), ``expand``.
Imports ``elements``, ``expressions``, ``text``.
"""
