"""From equations with names to arrays, and static problems as arrays.

Read ``conditions`` and ``assembly``, then ``static``; ``newton`` takes single steps with data from
outside.  Imports ``terms``.
"""
