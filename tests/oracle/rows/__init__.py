"""A judge of runs that sees the text of a flat deck and the rows that were written, nothing else.

It knows no engine, mode, step or certificate, and shares no code with the package: a wrong run that
its own certificate passes is found here.  ``judge.violations`` is the entrance.
"""
