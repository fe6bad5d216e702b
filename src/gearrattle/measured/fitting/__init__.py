"""``fit`` for every kind of data: modes and responses (``identification``), or a recorded motion (here).

A recorded motion is compared as ``validate`` compares it, and the differences are made least: residuals from
``validation``, search and judgement from ``identification``.
"""
