"""What to compute: analysis cards, settings, signals to record, parameter values, where rows go.

Read ``cards`` and ``settings`` first, then ``load`` (from text to circuit) and ``method`` (which
engine an island gets, with ``cost_hints`` for what that costs).  ``recorder`` maps signals to
recorded columns, ``row_sinks`` takes the rows.  Imports ``signals``.
"""
