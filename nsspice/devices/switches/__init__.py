"""Switches and thyristors: elements whose state a control decides.

Read ``switch`` (thresholds and hysteresis), then ``thyristor`` with its card and its latching kind.
Imports ``diodes``, ``heat`` and the base of the devices.
"""
