"""Runs in time: engines between restarts, impacts, contacts that last, the schemes of the thesis.

Read ``trajectory`` first: it calls the others.  Imports ``equations`` and ``terms``.
"""
