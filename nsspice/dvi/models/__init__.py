"""The problems that a user writes down: VI, GE, NCP, LCP, MLCP, and DVI, DMVI, DNCP, DLCP.

Read ``vi`` (static) and ``dvi`` (in time); ``tracking`` follows solutions along the time,
``verdicts`` says what is known beforehand.  Imports ``runs``, ``equations`` and ``terms``.
"""
