"""Signals: waveforms as functions of time, their names, integrals, extremes and crossings.

Read ``curve`` (piecewise-linear rows) and ``signal_function`` (polynomials as an engine knows them)
first; ``signal_statistics`` computes from either.  ``events`` holds the changes of set-valued
elements.  Imports no other room of the analyses.
"""
