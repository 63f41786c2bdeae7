"""Waveforms as files and pictures, results as text and JSON.

Read ``csv`` and ``files`` (how files are written), ``plot`` (pictures), ``summary`` (what a run
prints), ``report`` (the HTML page).  Imports ``analyses`` and everything below it.
"""
