"""Derivatives of measures by parameters, by one pass backwards through a run of the exact engine.

Read ``differentiated`` (what is done), ``functional`` (measures to first order), ``traced`` and
``carried`` (how equations depend on all parameters), ``variation`` (on one, by differences),
``drivers`` (parameters as sources).  Imports ``steady`` and the rooms before it.
"""
