"""Measured modes and frequency responses in SI, each with the state the driveline was in.

A *state* says which slope applies to every element (contact ratios, regions) and which elements are taken as rigid.
Natural frequencies published for a lumped model are data of the full model with some elements rigid. ``data_file``
reads the data, ``modal_problem`` compares them with a model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

QUANTITIES = ("angle", "velocity", "acceleration")
"""What a response measures, per torque; the index is the order of the time derivative."""


@dataclass(frozen=True)
class State:
    """The state a driveline was in.

    Attributes
    ----------
    contact_ratio
        factor on the slope of the last drive stage, by element.
    region
        region by element; an element named in neither is in its last drive stage.
    rigid
        elements that may not deflect.
    """

    contact_ratio: tuple[tuple[str, float], ...] = ()
    region: tuple[tuple[str, int], ...] = ()
    rigid: tuple[str, ...] = ()


@dataclass(frozen=True)
class MeasuredMode:
    """One mode: its frequency, its shape, or both.

    Attributes
    ----------
    number
        mode number from 1 in ascending order, rigid-body modes included; None: identified by its shape.
    omega
        natural frequency [rad/s]; None if not measured.
    omega_error
        its standard error [rad/s].
    inertias
        names of the inertias in the shape; empty if it was not measured.
    shape
        (s,) amplitudes at these inertias; scale and sign are arbitrary.
    shape_error
        (s,) standard errors, in the unit of ``shape``.
    """

    label: str
    number: int | None
    omega: float | None
    omega_error: float
    inertias: tuple[str, ...]
    shape: Array
    shape_error: Array
    state: State


@dataclass(frozen=True)
class MeasuredResponse:
    """One frequency response: the motion of an inertia per torque on an inertia.

    Attributes
    ----------
    at
        inertia that moves.
    torque_on
        inertia on which the torque acts.
    derivatives
        0 angle, 1 velocity, 2 acceleration.
    omega
        (F,) angular frequencies [rad/s].
    value
        (F,) complex, in rad, rad/s or rad/s^2 per N m, for exp(+i omega t).
    error
        (F,) standard error of the real and of the imaginary part.
    """

    label: str
    at: str
    torque_on: str
    derivatives: int
    omega: Array
    value: ComplexArray
    error: Array
    state: State


@dataclass(frozen=True)
class Measurements:
    """All data of one fit.

    ``assumed`` has, in words, the data without a standard error of their own; if there are any, the covariance is
    scaled by the residuals.
    """

    modes: tuple[MeasuredMode, ...]
    responses: tuple[MeasuredResponse, ...]
    assumed: tuple[str, ...] = ()
