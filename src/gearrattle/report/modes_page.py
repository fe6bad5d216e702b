"""Modes as a result: energies and excitation of every mode, shapes on the driveline."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearrattle.analysis.campbell import Campbell, campbell
from gearrattle.analysis.statics import Modes
from gearrattle.assembly import assemble
from gearrattle.report.campbell_page import crossings_sentence, diagram_section
from gearrattle.report.modes_tables import (
    crossings_table,
    energies_in_words,
    energy_tables,
    frequencies_table,
    modes_in_words,
    rate,
)
from gearrattle.report.numbers import Arrays
from gearrattle.report.page import Picture, Section, notes_section
from gearrattle.report.plots.mode_shapes import mode_sketch
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.summary import modes_dict
from gearrattle.report.tables import Table
from gearrattle.wording import counted

MOST_SHAPES = 24
_KEY = (
    "Stems: how far each inertia turns, the largest angle 1. Elements: the thicker and redder, the larger their share "
    "of the strain energy; shares from 5 % on are written."
)


class ModesPage(Presentation[Modes]):
    """Modes of one contact state, with the Campbell diagram."""

    kind = "modes"

    def __init__(
        self, result: Modes, diagram: Campbell | None = None, setting: str = "", *, lists_crossings: bool = False
    ) -> None:
        """Present modes in one contact state; ``setting`` is this state in words.

        Without ``diagram``, the Campbell diagram with every clearance closed is drawn, from 0 to twice the model's
        speed.
        """
        super().__init__(result)
        self.diagram = campbell(result.model) if diagram is None else diagram
        self.setting = setting
        self.lists_crossings = lists_crossings
        self.si = result.model.units == "SI"

    @property
    def title(self) -> str:
        return self.result.model.name or "driveline"

    @property
    def sentence(self) -> str:
        sentence = _modes_sentence(self.result, self.si)
        return f"{sentence} {crossings_sentence(self.diagram)}" if _elastic(self.result).size else sentence

    @property
    def notes(self) -> tuple[str, ...]:
        groups = [" and ".join(str(mode + 1) for mode in group) for group in self.result.repeated()]
        repeated = (f"modes {g} have one frequency; only sums of their shares mean something" for g in groups)
        return (*repeated, *self.result.notes)

    def sections(self) -> tuple[Section, ...]:
        words = (self.setting,) if self.setting else ()
        table = modes_in_words(self.result, self.diagram.model_speed, si=self.si)
        shapes = self._shapes()
        omitted = len(self.result.frequencies) - len(shapes)
        left_out = (f"{counted(omitted, 'higher mode')} not drawn; summary.json has all shapes.",) if omitted else ()
        return (
            Section("modes", "Modes", self.sentence, words, tables=(table,)),
            diagram_section(self.diagram),
            Section("shapes", "Shapes", words=(_KEY, *left_out), pictures=shapes),
            Section("energies", "Energies", tables=tuple(energy_tables(self.result, si=self.si))),
            *notes_section(self.notes),
        )

    def answer(self) -> tuple[Table, ...]:
        tables = frequencies_table(self.result, si=self.si), energies_in_words(self.result)
        return (*tables, crossings_table(self.diagram, si=self.si)) if self.lists_crossings else tables

    def content(self) -> dict[str, Any]:
        model = self.result.model
        return {
            "model": {"name": model.name, "units": model.units},
            **modes_dict(self.result),
            "campbell": self.diagram.to_dict(),
        }

    def numbers(self) -> Arrays:
        modes = self.result
        unit = "rad/s" if self.si else "1"
        # units: those of displacements beside those of angles
        inertia, participation = ("kg m^2", "1/(kg m^2)") if self.si else ("1", "1")
        if self.si and modes.has_directions:
            inertia += ", or kg where a displacement is largest"
            participation += ", or 1/kg of a direction"
        # variables, then coordinates
        by_inertia = ("inertia", "mode")
        by_element = ("element", "mode")
        return Arrays(
            {
                "frequency": ("mode", modes.frequencies, {"units": unit}),
                "damping_ratio": ("mode", modes.damping_ratios, {"units": "1"}),
                "modal_inertia": ("mode", modes.modal_inertia, {"units": inertia}),
                "shape": (by_inertia, modes.shapes, {"units": "1"}),
                "kinetic_energy": (by_inertia, modes.kinetic_energy, {"units": "1", "long_name": "share"}),
                "participation": (by_inertia, modes.participation, {"units": participation}),
                "strain_energy": (by_element, modes.strain_energy, {"units": "1", "long_name": "share"}),
                "excitation": (("source", "mode"), modes.excitation, {"units": "1", "long_name": "share"}),
            },
            {
                "mode": np.arange(1, len(modes.frequencies) + 1),
                "inertia": list(modes.inertia_names),
                "element": texts(modes.element_names),
                "source": texts(modes.sources),
            },
            {"model": modes.model.name, "setting": self.setting},
        )

    def _shapes(self) -> tuple[Picture, ...]:
        """Draw the lowest modes on the driveline."""
        model = self.result.model
        modes = self.result
        layout = assemble(model).layout
        drawings = []
        for mode, frequency in enumerate(modes.frequencies.tolist()[:MOST_SHAPES]):
            speed = "rigid motion" if frequency == 0.0 else rate(frequency, si=self.si)
            words = f"mode {mode + 1}, {speed}"
            sketch = mode_sketch(layout, modes, mode, words)
            drawings.append(Picture(f"mode-{mode + 1}", words, sketch, is_wide=len(modes.inertia_names) > 12))
        return tuple(drawings)


def _elastic(modes: Modes) -> Any:
    return modes.frequencies[modes.frequencies > 0.0]


def _modes_sentence(modes: Modes, si: bool) -> str:
    """Return a sentence with the number of modes and the range of their frequencies."""
    elastic = _elastic(modes)
    rigid = len(modes.frequencies) - len(elastic)
    if not elastic.size:
        return "Every motion is rigid: there are no natural frequencies above zero."
    ends = rate(float(elastic[0]), si=si), rate(float(elastic[-1]), si=si)
    between = f"from {ends[0]} to {ends[1]}" if elastic.size > 1 else f"at {ends[0]}"
    also = f", and {counted(rigid, 'rigid motion')}" if rigid else ""
    return f"{counted(elastic.size, 'mode')} {between}{also}."
