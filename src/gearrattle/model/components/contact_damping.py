"""Contact damping: linear in the rate, or clipped so that contact never pulls.

Takes values as they are read; gives breaches.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from gearrattle.model.quantity import Choice
from gearrattle.model.table import Breach

ContactDamping = Annotated[Literal["kelvin-voigt", "clipped"], Choice(("kelvin-voigt", "clipped"))]


def clipping_rules(gaps: Sequence[float | None], carrying: Sequence[float | None], remedy: str) -> Iterator[Breach]:
    """Yield a breach of clipped contact damping where there is no free gap.

    Parameters
    ----------
    gaps
        as read, none of which may be zero; None: refused by its field.
    carrying
        slopes and dampings of the gaps as read, all of which must be zero; None: refused by its field.
    remedy
        what to write.
    """
    if 0.0 in gaps or any(carrying):
        yield Breach(("contact_damping",), "clipped", "clipped contact damping needs a gap free of torque", remedy)
