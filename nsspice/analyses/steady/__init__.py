"""Periodic steady states and small signals: ``.pss``, ``.ac``, ``.loop``, ``.noise``, ``.sens``.

Read ``steady_state`` (the orbit) and ``linearised`` (the equations about an operating point) first;
``small_signal`` and ``orbit_response`` answer ``.ac`` about either.  Imports ``transient`` and the
rooms before it.
"""
