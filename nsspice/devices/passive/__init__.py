"""Resistors, capacitors, inductors and coupled inductors.

``passive`` holds what the three share.  Values that are expressions go to
``devices.expressions``.  Imports ``expressions`` and the base of the devices.
"""
