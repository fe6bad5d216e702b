"""What a march returns when it hands control back: the values of ``outcome.Outcome``, for compiled code."""

DONE = 0
"""All samples are stored."""
SLICE_SPENT = 1
"""The steps of the slice are taken: call again."""
NEEDS_REGION = 2
"""A corner leads into a region that is not built yet: build it and call again."""
LOG_FULL = 3
"""No further crossing fits into the log: enlarge it and call again."""
CHATTER = 4
"""Crossings follow one another at one instant."""
NON_FINITE = 5
"""A state is infinite or NaN."""
NOTES_FULL = 6
"""There is no room for another note of samples: compute the noted samples and call again."""
NO_CONVERGENCE = 7
"""No step is short enough for the tolerance."""
NO_PROGRESS = 8
"""The first crossing in a window cannot be located, although all states are finite."""
