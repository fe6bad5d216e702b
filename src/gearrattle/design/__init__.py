"""Design decisions: how far a value must change until the driveline is quiet, and which change is the best.

Every answer rests on exact runs: ``threshold`` looks for the value at which a driveline becomes quiet, ``remedies`` for
the cheapest change that makes it quiet.
"""
