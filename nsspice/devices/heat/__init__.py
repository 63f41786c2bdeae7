"""Energies of switchings and the way of their heat, as model cards give them.

``energy_table`` interpolates vendors' tables, ``thermal_network`` is Foster's or Cauer's form.
Imports the base of the devices alone.
"""
