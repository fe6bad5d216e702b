"""Design decisions by exact runs.

``threshold`` returns the value at which a driveline becomes quiet, ``remedies`` the cheapest changes to make it quiet.
"""
