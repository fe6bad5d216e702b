"""The units of ``exact`` (``system.energy_scaling``): powers of two that balance states and inputs by energy."""

from __future__ import annotations

from math import frexp, inf, ldexp, pi, sqrt

from gearrattle.engine.kernels._jit import strict, strict_entry


@strict
def power_below(value):
    """The largest power of two not above a positive value; infinity and NaN are returned."""
    if not value < inf:
        return value
    return ldexp(1.0, frexp(value)[1] - 1)


@strict
def largest_modulus(values, begin, end):
    """The largest modulus in values[begin:end]."""
    largest = 0.0
    for i in range(begin, end):
        largest = max(largest, abs(values[i]))
    return largest


@strict_entry
def scale(system, frame, scales):
    """Write the scales of the deflections that are states, of the velocities and of the inputs.

    system: ``variant_arrays.Coefficients`` of one driveline.
    scales: ``variant_arrays.Scales``; those of the corners are not changed.
    """
    deflection = scales.deflection
    velocity = scales.velocity
    inputs = scales.inputs
    rows = frame.rows
    elements = frame.elements
    cycles = frame.cycles
    laws = system.laws
    first = system.laws.first
    n = velocity.size
    period = system.period[0]
    # velocities: the square root of the inertia
    for i in range(n):
        velocity[i] = power_below(sqrt(system.inertia[i]))
    for i in range(deflection.size):
        # deflections: the square root of the largest stiffness, at least of the stiffness with 1 rad per period
        k = elements[i]
        mobility = 0.0
        for j in range(n):
            mobility += rows[k, j] * rows[k, j] * (1.0 / system.inertia[j])
        floor = (1.0 / period) * (1.0 / period) / mobility
        deflection[i] = power_below(sqrt(max(largest_modulus(laws.stiffness, first[k], first[k + 1]), floor)))
    for j in range(inputs.size):
        # inputs: the torque on every inertia, including the torque by transmission errors
        squares = 0.0
        for i in range(n):
            if j == 0:
                pushed = abs(system.mean[i])
            else:
                pushed = abs(system.torque_sine[i, j - 1]) + abs(system.torque_cosine[i, j - 1])
            for k in range(rows.shape[0]):
                if j == 0:
                    pushed += abs(rows[k, i]) * largest_modulus(laws.offset, first[k], first[k + 1])
                else:
                    error = abs(system.error_sine[k, j - 1]) + abs(system.error_cosine[k, j - 1])
                    pushed += abs(rows[k, i]) * (largest_modulus(laws.stiffness, first[k], first[k + 1]) * error)
            pushed /= sqrt(system.inertia[i])
            squares += pushed * pushed
        # the velocity by these torques: divided by the angular frequency, at least one turn per period
        turns = 1.0 if j == 0 else max(1.0, cycles[j - 1])
        size = sqrt(squares) * period / (2.0 * pi * turns)
        inputs[j] = power_below(size) if size > 0.0 else 1.0
