"""Return codes of kernels: how a computation ended.

Kernels cannot raise exceptions; the caller turns the code into a message.
"""

from __future__ import annotations

from enum import IntEnum


class Outcome(IntEnum):
    """The return code of a kernel."""

    DONE = 0
    SLICE_SPENT = 1
    NEEDS_REGION = 2
    LOG_FULL = 3
    CHATTER = 4
    NON_FINITE = 5
    NOTES_FULL = 6
    NO_CONVERGENCE = 7
    NO_PROGRESS = 8
    AUDIT_TOO_LONG = 9
    TOO_MANY_REGIONS = 10

    @property
    def advice(self) -> str:
        """What the user should try; empty if nothing went wrong."""
        return _ADVICE.get(self, "")


_ADVICE = {
    Outcome.CHATTER: "add damping or stiffness to the element named, or check its clearance against its deflection",
    Outcome.NON_FINITE: "a smaller step, or algorithm = 'exact', which has no step to choose",
    Outcome.NO_PROGRESS: "less stiffness or damping in the element named, more inertia beside it, or one inertia in "
    "place of the two that it joins",
    Outcome.AUDIT_TOO_LONG: "less stiffness or damping in the element named, or audit = False, which leaves it out",
    Outcome.TOO_MANY_REGIONS: "fewer inertias (gearrattle reduce), or fewer clearances",
    Outcome.NO_CONVERGENCE: "a larger tolerance, or algorithm = 'exact', which needs none",
}
