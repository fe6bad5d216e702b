"""Identification: derivatives, recovery, errors, what the data leave open."""
