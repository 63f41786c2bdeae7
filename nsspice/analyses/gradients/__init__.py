"""Derivatives of measures by parameters, by one pass backwards through a run of the exact engine.

Read ``differentiated`` (what is done), ``functional`` (measures to first order), ``variation``
(how equations depend on a parameter), ``drivers`` (parameters as sources).  Imports ``steady`` and
the rooms before it.
"""
