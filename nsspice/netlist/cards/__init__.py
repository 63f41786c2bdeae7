"""Dot lines: one reader for each family of cards.

Read ``control`` (which reader takes which card), ``context`` (what the readers share), then one
file per family of cards.  Imports all other rooms of the netlist.
"""
