"""Records of what analyses find: plain data that solutions hold and analyses fill in.

``jumps`` and ``periodic`` come from every run with state jumps or a period; ``loss_table``,
``loop_report``, ``spectrum``, ``sensitivity`` and ``error_estimate`` on request.
Imports no other room of the analyses.
"""
