"""A loaded gear against ground behind a gap: where it begins to separate is known in closed form.

The mean torque T presses the gear into its spring by T / k; the harmonic A at omega swings it by
A / |k - J omega^2 + i c omega| about that. It leaves its flank where the swing is as large as the static depth:

    A* = T |k - J omega^2 + i c omega| / k.

Below resonance, with this damping, no other motion coexists near A*.
"""

from __future__ import annotations

import gearrattle as gr

J, K, C, T, SPEED = 2e-3, 4000.0, 1.2, 6.0, 400.0
LIMIT = T * abs(K - J * SPEED**2 + 1j * C * SPEED) / K
"""Amplitude A* at which the gear separates [N m]."""


def loaded_gear(amplitude: float = 2.0 * LIMIT) -> gr.Model:
    """The gear with an amplitude [N m]."""
    return gr.loads(
        f"""
        schema = 1
        [[inertia]]
        name = "gear"
        J = {J}
        [[coupling]]
        name = "flank"
        between = ["gear", "ground"]
        stiffness = {K}
        damping = {C}
        clearance = "0.1 deg"
        [excitation]
        speed = {SPEED}
        [[torque]]
        on = "gear"
        mean = {T}
        harmonics = [ {{ order = 1, amplitude = {amplitude} }} ]
        [criteria]
        negligible = {{ impact_energy = 0 }}
        [simulation]
        cycles = 60
        discard = 40
        """
    )
