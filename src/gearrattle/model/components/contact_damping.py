"""Contact damping: linear in the rate, or clipped so that the contact force never pulls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from gearrattle.model.table import Breach
from gearrattle.model.value_kinds import Choice

ContactDamping = Annotated[Literal["kelvin-voigt", "clipped"], Choice(("kelvin-voigt", "clipped"))]


def clipping_rules(gaps: Sequence[float | None], carrying: Sequence[float | None], remedy: str) -> Iterator[Breach]:
    """Yield a breach if contact damping is clipped without a free gap.

    All gaps must be larger than zero, and stiffness and damping inside them (``carrying``) must be zero. None stands
    for a value that its field has refused.
    """
    if 0.0 in gaps or any(carrying):
        yield Breach(("contact_damping",), "clipped", "clipped contact damping needs a gap free of torque", remedy)
