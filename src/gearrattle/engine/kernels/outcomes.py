"""What a march returns when it hands control back: the numbers of ``outcome.Outcome``, for compiled code."""

DONE = 0
"""All samples are stored."""
SLICE_SPENT = 1
"""As many steps are taken as were asked for: call again."""
NEEDS_REGION = 2
"""A corner leads into a region that is not built yet: build it and call again."""
LOG_FULL = 3
"""No further crossing fits into the log: enlarge it and call again."""
CHATTER = 4
"""Crossings follow each other without any time between them."""
NON_FINITE = 5
"""A state is infinite or no number."""
NOTES_FULL = 6
"""No further note of samples fits: work out those noted and call again."""
NO_CONVERGENCE = 7
"""No step is short enough for the tolerance."""
NO_PROGRESS = 8
"""The first crossing in a window cannot be told, though all is finite."""
