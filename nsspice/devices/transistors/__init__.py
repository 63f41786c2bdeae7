"""Bipolar transistors, JFETs and IGBTs.

Read ``transistor`` first: it chooses between SPICE's smooth law (``bipolar``) and Ebers-Moll with
any diode law (``ebers_moll``).  Imports ``mosfets``, ``diodes`` and the base of the devices.
"""
