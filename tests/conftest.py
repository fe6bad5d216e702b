"""Every run of the tests tries the same examples: a failure is found again, a green run means the same each time."""

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")
