"""MOSFETs: as switches with a body diode, and SPICE's smooth levels 1 to 3 and VDMOS.

Read ``mosfet`` first: it chooses the kind from the model card.  Each smooth kind has a card, a law
on a tape and a device.  Imports ``switches``, ``diodes`` and the base of the devices.
"""
