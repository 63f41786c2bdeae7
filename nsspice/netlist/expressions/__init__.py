"""Expressions: trees, their values and their exact derivatives.

Read ``node`` (the tree), ``expression_parser`` (text to tree), ``evaluate`` and ``derivative``.
``functions`` lists what may be called.  Imports ``text``.
"""
