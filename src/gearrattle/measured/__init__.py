"""Measured files: what they hold, recordings read from them by a mapping, and inputs of a model made of them."""
