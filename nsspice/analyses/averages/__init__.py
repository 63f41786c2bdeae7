"""Averages over a window of a run or an orbit: spectra, powers, losses, temperatures.

Read ``window_integrals`` (what can be asked), ``integrals`` (closed forms) and
``recorded_integrals`` (polynomials of steps), then ``spectrum``, ``losses`` and ``heat``.
Imports ``static`` and the rooms before it.
"""
