"""Switching energies and thermal networks, as given on model cards.

``energy_table`` interpolates vendors' tables, ``thermal_network`` is Foster's or Cauer's form.
Imports only the base of the devices.
"""
