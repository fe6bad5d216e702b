"""Coherence of two motions' accelerations, inertia by inertia, at the first harmonics of the excitation.

The paper's index of agreement between algorithms (Padmanabhan et al. 1995, secs. 8 and 9), with the bias and the
threshold it leaves out (``signals.coherence``). The samples are the last ones of the steady part.
"""

from __future__ import annotations

import numpy as np

from gearrattle.comparison.pair_checks import cycles_beyond, fundamental_order, same_grid
from gearrattle.signals.coherence import ENSEMBLES, HARMONICS, POINTS, Coherence, Taper, coherence_at_harmonics
from gearrattle.trajectory import Trajectory


def compare_coherence(
    candidate: Trajectory,
    reference: Trajectory,
    start: float | None = None,
    *,
    ensembles: int = ENSEMBLES,
    points: int = POINTS,
    harmonics: int = HARMONICS,
    every: int | None = None,
    anti_alias: bool = True,
    taper: Taper = "hann",
) -> dict[str, Coherence]:
    """Return the coherence of every inertia's acceleration, by name.

    Parameters
    ----------
    start
        no sample before it is used [s]; None: the steady part.

    Raises
    ------
    ModelError
        other driveline, other grid, too few samples, or harmonics outside the band.
    """
    same_grid(candidate, reference)
    layout = reference.layout
    window = cycles_beyond(reference, start)
    mine = window.periodic(candidate.acceleration)
    theirs = window.periodic(reference.acceleration)
    return {
        name: coherence_at_harmonics(
            mine[:, i],
            theirs[:, i],
            reference.samples_per_cycle / layout.period,
            fundamental_order(reference) * layout.omega / (2.0 * np.pi),
            ensembles=ensembles,
            points=points,
            harmonics=harmonics,
            every=every,
            anti_alias=anti_alias,
            taper=taper,
        )
        for i, name in enumerate(layout.inertia_names)
    }
