"""Criteria: every number against a closed form, and the verdict's rule."""
