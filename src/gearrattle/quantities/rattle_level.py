"""The rattle level: a sound pressure level from the intensity of impacts, for a calibrated gearbox.

    L = 10 log10( 10^(0.1 L_0) + kappa I )  [dB]

L_0 is the level of the gearbox without rattle, I the mean intensity of the impacts of its meshes [N] (see
``intensity``), and kappa a factor for gearbox and room [1/N]. L_0 and kappa must be measured; no model contains them.
Without calibration (L_0 = 0 dB, kappa = 1/N) the level only compares motions of the same gearbox.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearrattle.quantities.metric_inputs import LOG, Inputs
from gearrattle.quantities.quantity import Quantity, Row
from gearrattle.signals import is_gap, reduced_inertia

ALL = "all meshes"


@dataclass(frozen=True)
class RattleLevel(Quantity[Inputs]):
    """Sound pressure level from the intensity of impacts.

    Attributes
    ----------
    base
        L_0, level without rattle [dB].
    kappa
        factor for gearbox and room [1/N].
    """

    base: float | None = None
    kappa: float | None = None
    name: str = "rattle_level"
    title: str = "Rattle level"
    formula: str = "10 log10( 10^(0.1 L_0) + kappa I ), I = sum of m (1 + e) |v| / time"
    unit: str = "dB"
    source: str = (
        "practice of rattle test stands; Dogan 1999, Tr. J. Eng. Env. Sci. 23, 439-454, compares such levels with "
        "measured ones; form as commonly quoted, constants of one gearbox"
    )
    window: str = LOG
    sampling: str = "none: exact to the events"
    needs: tuple[str, ...] = ("gaps",)
    of_crossings: bool = True
    merging: str = "exact: the sums of momenta add up; a contact across chunks is one contact"

    def rows(self, inputs: Inputs) -> list[Row]:
        """Return the level of every single mesh with backlash, and of all meshes together."""
        layout = inputs.known_layout
        intensities = {}
        for k, name in enumerate(layout.clearance_names):
            element = int(layout.clearance[k])
            if layout.is_mesh[element] and not layout.is_bearing[element] and is_gap(layout, k):
                intensities[name] = reduced_inertia(layout, element) * inputs.contacts(k).speeds / inputs.duration
        if not intensities:
            return []
        intensities[ALL] = sum(intensities.values())
        note = "" if self.calibrated else "rattle level: not calibrated (L_0 = 0 dB, kappa = 1/N), compare only"
        return [self.row(name, _quantity(name), self.level(i), "dB", note) for name, i in intensities.items()]

    @property
    def calibrated(self) -> bool:
        """Whether both constants are known."""
        return self.base is not None and self.kappa is not None

    def level(self, intensity: float) -> float:
        """Return the level [dB] for an intensity [N]."""
        base = 0.0 if self.base is None else self.base
        kappa = 1.0 if self.kappa is None else self.kappa
        return 10.0 * math.log10(10.0 ** (0.1 * base) + kappa * intensity)


def _quantity(name: str) -> str:
    return "rattle level of all meshes" if name == ALL else "rattle level"
