"""Comparison with expected numbers, reference waveforms and other programs.

Read ``expectation`` (the file), ``checks`` (each kind of check), ``expect`` (a deck against its
file); ``ngspice`` runs the same deck there, ``cost`` measures what accuracy costs.  Imports
``output``, ``analyses`` and everything below them.
"""
