"""``.control`` blocks: ngspice's programs, unrolled into runs before anything is computed.

Read ``commands`` (lines to statements), ``variables`` (what names stand for), ``plan``
(the walk).  Imports all other rooms of the netlist.
"""
