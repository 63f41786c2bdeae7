"""Switches and thyristors: elements whose state is set by a control.

Read ``switch`` (thresholds and hysteresis), then ``thyristor`` with its card and its latching kind.
Imports ``diodes``, ``heat`` and the base of the devices.
"""
