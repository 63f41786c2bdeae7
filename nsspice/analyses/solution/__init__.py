"""Results: named waveforms, their certificate, events, impulses and statistics.

Read ``solution`` first; ``recording`` holds what a run kept between its rows, ``computed_signals``
evaluates signals that were not recorded, ``refusal`` says what a failed certificate means.
Imports ``certificate``, ``request``, ``signals``.
"""
