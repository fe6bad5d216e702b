"""The arrays in which many variants of one driveline lie, and what they have in common.

Variants of one *structure* differ in numbers alone: the same elements in the same places, as many pieces to each law,
the same orders. What their structure says is a ``Frame``, their numbers are ``Coefficients`` with a leading axis of
variants. Laws lie end to end: P pieces of all m elements, and P - m corners between them.

n inertias, H orders, r deflections that are states, K clearances, R reference angles, E elements with stiffness.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class Coefficients(NamedTuple):
    """Numbers of one driveline; of V variants with a leading axis (V, ...)."""

    inertia: Any  # (n,)
    drag: Any  # (n,)
    stiffness: Any  # (P,) slope of every piece
    damping: Any  # (P,)
    offset: Any  # (P,)
    corners: Any  # (P - m,)
    mean: Any  # (n,) mean torques
    torque_sine: Any  # (n, H)
    torque_cosine: Any  # (n, H)
    error_sine: Any  # (m, H)
    error_cosine: Any  # (m, H)
    period: Any  # (1,)


class Frame(NamedTuple):
    """What variants of one structure share."""

    rows: Any  # (m, n) W
    first: Any  # (m + 1,) where an element's pieces begin; its corners begin at first[k] - k
    label: Any  # (m,) label of its lowest piece
    clearances: Any  # (K,) elements with corners
    cycles: Any  # (H,) oscillations a period
    basis: Any  # (r, n) X
    combination: Any  # (m, r) B
    elements: Any  # (r,) the element of each row of X
    references: Any  # (R,) inertias whose angle is carried


class Scales(NamedTuple):
    """The scales of one variant, see ``system.scaling``."""

    deflection: Any  # (r,)
    velocity: Any  # (n,)
    inputs: Any  # (1 + H,)
    corner: Any  # (K,)


class Statics(NamedTuple):
    """What the search for the equilibrium needs to know: coordinates of the elements with stiffness alone."""

    elastic: Any  # (E,) these elements
    at: Any  # (r,) which of them each deflection that is sought belongs to
    combination: Any  # (E, r) B
    angle_from_basis: Any  # (n, r)
    motion: Any  # (n, R) free motion of the trains


def one(coefficients: Coefficients, index: int) -> Coefficients:
    """The numbers of one variant."""
    return Coefficients(*(array[index] for array in coefficients))
