"""Mutation testing of the engine: a wrong sign or comparison in a kernel must make a test fail."""
