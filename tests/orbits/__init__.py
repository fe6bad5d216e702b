"""Tests of periodic motions and their branches."""
