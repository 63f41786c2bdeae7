"""Element lines: from items to templates that wait for parameters and node names.

Read ``elements`` (which reader takes which letter), ``terminals`` (what all lines share), then the
reader of a letter.  Imports ``expressions`` and ``text``.
"""
