"""DC solutions: the operating point, sweeps, and the first state of a transient.

Read ``statics`` first, then ``dc_points`` (many points as one run of the solver) and ``initial``
(``.ic``, ``uic`` and the DC start).  Imports ``solution`` and the rooms before it.
"""
