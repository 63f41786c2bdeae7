"""Resistors, capacitors, inductors and coupled inductors.

``passive`` holds what the three share.  A value that is an expression is handed to
``devices.expressions``.  Imports ``expressions`` and the base of the devices.
"""
