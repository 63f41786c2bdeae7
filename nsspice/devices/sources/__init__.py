"""Independent and linear controlled sources.

``waveform`` completes SPICE's argument lists (SIN, PULSE, PWL, EXP ...); ``vsource`` and
``isource`` use it.  Imports ``expressions`` and the base of the devices.
"""
