"""What a model consists of: variables, expressions, set-valued terms, closed convex sets, errors.

Read ``variables``, ``expression``, ``sets`` and ``setvalued`` in this order.  Imports no other
room.
"""
