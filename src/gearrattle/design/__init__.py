"""Decisions of design: how far a value must change until the driveline is quiet, and which change is the best.

Every answer is one of exact runs: ``threshold`` looks for the place where a driveline becomes quiet.
"""
