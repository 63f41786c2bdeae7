"""Diodes: set-valued characteristics and SPICE's smooth junction.

Read ``characteristic`` (a law as a curve in the (i, v) plane), ``diode_branch`` (that law between
two nodes), then ``diode``.  The smooth kind is ``junction`` with its card.  Imports ``heat`` and
the base of the devices.
"""
