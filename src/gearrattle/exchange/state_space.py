"""Matrices of a driveline in one region: M q'' + C q' + K q + f = H u, and its state-space form.

    x' = A x + B u + a,      y = G x + P u + b,      x = (q, q'),   u = (T, e, e')

T are the torques on the coordinates, e the errors of the elements and e' their rates; y are the coordinates, their
rates and accelerations, the deflections and the forces of the elements. f, a and b are constant: a piece with a corner
does not pass through zero. With ``corners`` and the tables of the pieces every other region can be made.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.statics import slopes
from gearrattle.assembly import assemble, coordinate_names
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.formats import format_name
from gearrattle.model import Model

Array = NDArray[np.float64]


def state_space(model: Model, region: Mapping[str, int] | None) -> dict[str, Array]:
    """Return matrices, tables and names by name; ModelError as ``slopes``.

    ``region``: label by element name; others are in their last drive stage.
    """
    driveline = assemble(model)
    system = driveline.system
    stiffness, damping = slopes(driveline, None, region)
    labels = {name: law.first_label + law.pieces - 1 for name, law in zip(_names(model), system.laws, strict=True)}
    labels |= dict(region or {})
    offset = np.array(
        [law.offset[label - law.first_label] for law, label in zip(system.laws, labels.values(), strict=True)]
    )
    n, m = system.size, len(system.laws)
    W = system.rows.reshape(m, n)
    # second order: M q'' + C q' + K q + W^T offset = T + W^T (K_e e + C_e e')
    mass = np.diag(system.inertia)
    damping_matrix = (W.T * damping) @ W + np.diag(system.drag)
    stiffness_matrix = (W.T * stiffness) @ W
    inputs = np.hstack([np.eye(n), W.T * stiffness, W.T * damping])
    # first order
    over = 1.0 / system.inertia[:, None]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-over * stiffness_matrix, -over * damping_matrix]])
    B = np.vstack([np.zeros((n, n + 2 * m)), over * inputs])
    constant = np.concatenate([np.zeros(n), -(W.T @ offset) / system.inertia])
    # outputs: q, q', q'', delta, F
    forces = np.hstack([stiffness[:, None] * W, damping[:, None] * W])
    G = np.vstack([np.eye(2 * n), A[n:], np.hstack([W, np.zeros((m, n))]), forces])
    P = np.zeros((3 * n + 2 * m, n + 2 * m))
    P[2 * n : 3 * n] = B[n:]
    P[3 * n : 3 * n + m, n : n + m] = -np.eye(m)
    P[3 * n + m :, n : n + m] = -np.diag(stiffness)
    P[3 * n + m :, n + m :] = -np.diag(damping)
    constant_output = np.concatenate([np.zeros(2 * n), constant[n:], np.zeros(m), offset])
    return {
        "M": mass,
        "C": damping_matrix,
        "K": stiffness_matrix,
        "H": inputs,
        "f": W.T @ offset,
        "W": W,
        "A": A,
        "B": B,
        "a": constant,
        "G": G,
        "P": P,
        "b": constant_output,
        "region": np.array(list(labels.values()), dtype=float),
        **_pieces(system),
        **_inputs(model, system),
    }


def _names(model: Model) -> list[str]:
    return [element.name for element in model.elements]


def _pieces(system: PiecewiseSystem) -> dict[str, Array]:
    """Tables of all pieces, one row each: element (from 0), region label, bounds, stiffness, damping, offset."""
    rows = [
        (k, law.first_label + p, *law.bounds(p), law.stiffness[p], law.damping[p], law.offset[p])
        for k, law in enumerate(system.laws)
        for p in range(law.pieces)
    ]
    return {"pieces": np.array(rows, dtype=float).reshape(-1, 7)}


def _inputs(model: Model, system: PiecewiseSystem) -> dict[str, Array]:
    """Fourier coefficients of u: means, and sines and cosines of every angular frequency."""
    inputs = system.inputs
    m = len(system.laws)
    omega = 2.0 * np.pi * inputs.cycles / inputs.period
    rate_sine = -inputs.error_cosine * omega
    rate_cosine = inputs.error_sine * omega
    return {
        "u_mean": np.concatenate([inputs.mean, np.zeros(2 * m)]),
        "u_omega": omega,
        "u_sine": np.vstack([inputs.torque_sine, inputs.error_sine, rate_sine]),
        "u_cosine": np.vstack([inputs.torque_cosine, inputs.error_cosine, rate_cosine]),
        "period": np.array([inputs.period]),
        "speed": np.array([model.excitation.omega]),
    }


def matrices_file(model: Model, ending: str, region: Mapping[str, int] | None) -> bytes:
    """Return the matrices and the names of coordinates and elements as the bytes of an .npz or a .mat file."""
    arrays: dict[str, Any] = dict(state_space(model, region))
    names = {
        "format": [format_name("state space")],
        "coordinates": list(coordinate_names(model)),
        "elements": _names(model),
    }
    stream = io.BytesIO()
    if ending == ".npz":
        arrays |= {key: np.array(texts, dtype=np.str_) for key, texts in names.items()}
        np.savez(stream, **arrays)
        return stream.getvalue()
    from scipy.io import savemat

    cells = {key: np.array(texts, dtype=object) for key, texts in names.items()}
    savemat(stream, {**arrays, **cells}, oned_as="column")
    return stream.getvalue()
