"""Contact damping: linear in the rate, or clipped so that contact never pulls.

Takes raw tables; gives breaches.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from gearrattle.model.quantity import Choice
from gearrattle.model.table import Breach

ContactDamping = Annotated[Literal["kelvin-voigt", "clipped"], Choice(("kelvin-voigt", "clipped"))]


def clipping_rules(free: object, remedy: str) -> Iterator[Breach]:
    """Yield a breach of clipped contact damping where there is no free gap."""
    if not free:
        yield Breach(("contact_damping",), "clipped", "clipped contact damping needs a gap free of torque", remedy)
