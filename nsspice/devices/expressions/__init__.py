"""Laws given by expressions: ``B``, ``VALUE=``, ``TABLE``, ``Q=`` and ``Flux=``.

Read ``behavioural`` first.  ``piecewise`` turns limiters and tables into complementarity pairs,
``comparators`` turns comparisons into switches, ``stored`` keeps charge or flux.  Imports
``diodes`` and the base of the devices.
"""
