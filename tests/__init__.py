"""Tests of gearrattle."""
