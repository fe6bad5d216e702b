"""Comparisons of motions whose every difference is put there by hand."""
