"""Text: files, logical lines, numbers, and lines as items.

Read ``lines`` (continuations and comments), ``files`` (``.include``, ``.lib``), then ``statement``
(one line as words, calls and ``key=value`` pairs; ``shapes`` and ``grammar`` parse each sequence of
token kinds once).  Imports only the findings of the netlist.
"""
