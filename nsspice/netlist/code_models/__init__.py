"""XSPICE's code models and LTspice's A devices as subcircuits of other elements.

Read ``block`` (ports, memories, delays), ``catalogue`` (all models by name), then the file of a
kind.  Imports ``elements``.
"""
