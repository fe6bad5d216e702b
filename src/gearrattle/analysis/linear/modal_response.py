"""Modal parts of a steady response: the contribution of every damped mode to the accelerations.

In energy coordinates y = (B x, sqrt(J) v) a driveline with one slope an element is dy/dt = A y + b exp(i omega t). With
A V = V diag(lambda) the response is a sum over eigenvalues,

    y = sum_r  v_r (V^-1 b)_r / (i omega - lambda_r),      acceleration = i omega v

A pair lambda, conj(lambda) is a mode of the damped driveline: |lambda| its natural frequency, -Re(lambda)/|lambda| its
damping ratio (D. J. Ewins, Modal Testing, 2nd ed. 2000, sec. 2.7). Real eigenvalues of overdamped motion are parts of
their own. All rigid motions together are one part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.stiffness_ratio import EnergyForm, energy_form
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class ModalPart:
    """Contribution of one mode, or of all rigid motions together, to a response.

    Attributes
    ----------
    acceleration
        complex amplitudes (n,) of all bodies [rad/s^2].
    frequency
        natural frequency, of overdamped motion the rate of its decay [rad/s]; 0 for rigid motion.
    damping_ratio
        at most 1; NaN for rigid motion.
    strain_energy
        (m,) share of every element in the largest strain energy of the mode; zeros for rigid motion.
    """

    acceleration: Complex
    frequency: float
    damping_ratio: float
    strain_energy: Array


@dataclass(frozen=True)
class DampedModes:
    """Eigenvalues and eigenvectors of a driveline with one slope an element.

    Attributes
    ----------
    root
        (n,) square roots of the inertias.
    values, vectors
        lambda, and V in columns.
    """

    form: EnergyForm
    root: Array
    values: Complex
    vectors: Complex

    def parts(self, omega: float, torque: Complex) -> list[ModalPart]:
        """Return the parts of the steady accelerations by torques on the bodies; rigid motion first, if there is any.

        Parameters
        ----------
        omega
            angular frequency, > 0 [rad/s].
        torque
            (n,) complex amplitudes [N m].

        Returns
        -------
        list[ModalPart]
            They add up to the response. Close to critical damping, where two eigenvectors are one, large parts cancel.
        """
        form = self.form
        values = self.values
        force = np.concatenate([np.zeros(form.count), torque / self.root])
        amount = np.linalg.lstsq(self.vectors, force, rcond=None)[0] / (1j * omega - values)
        accelerations = 1j * omega * (self.vectors[form.count :] / self.root[:, None]) * amount

        apart = form.is_rigid(self.vectors)
        none = np.zeros(form.elements)
        parts = [ModalPart(accelerations[:, apart].sum(axis=1), 0.0, float("nan"), none)] if apart.any() else []
        for r in np.flatnonzero(~apart & (values.imag >= 0.0)).tolist():
            value = complex(values[r])
            # real matrices have their complex eigenvalues in pairs, one behind the other, the positive one first
            acceleration = accelerations[:, r] + (accelerations[:, r + 1] if value.imag > 0.0 else 0.0)
            strain = none.copy()
            strain[form.held] = np.abs(form.stored @ self.vectors[: form.count, r]) ** 2
            damping_ratio = -value.real / abs(value)
            parts.append(ModalPart(acceleration, abs(value), damping_ratio, strain / (strain.sum() or 1.0)))
        return parts


def damped_modes(system: PiecewiseSystem, stiffness: Array, damping: Array) -> DampedModes:
    """Return the damped modes with the slope (m,), not negative, and the damping (m,) of every element given."""
    form = energy_form(system, stiffness, damping)
    values, vectors = np.linalg.eig(form.matrix)
    return DampedModes(form, np.sqrt(system.inertia), np.asarray(values, complex), np.asarray(vectors, complex))
