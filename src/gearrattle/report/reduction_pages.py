"""Reduced models as results: bodies lumped or modes kept, the reasons, and the errors against the full model."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.formats import format_name
from gearrattle.reductions.condense import Condensed
from gearrattle.reductions.reduction import Reduction, ReductionError, Simulated, frequency_text
from gearrattle.report.numbers import Arrays
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.row_charts import Series, row_chart
from gearrattle.report.presentation import RESULT_ENDINGS, ModelPresentation, Presentation
from gearrattle.report.record_dataset import number_columns, record_columns, texts
from gearrattle.report.tables import Table
from gearrattle.wording import counted


class ReductionPage(ModelPresentation[Reduction]):
    """A reduced model and its record."""

    kind = "reduction"

    @property
    def title(self) -> str:
        return self.result.model.name or "driveline"

    @property
    def sentence(self) -> str:
        reduction = self.result
        units = self.result.model.units
        left = len(reduction.model.inertias)
        before = counted(left + sum(len(members) for members in reduction.groups.values()), "body", "bodies")
        sentence = f"{before} become {left}, for up to {frequency_text(reduction.up_to, units)}."
        return f"{sentence} {_error_sentence(reduction.error, units)}"

    def answer(self) -> tuple[Table, ...]:
        reduction = self.result
        tables = (self._groups(), self._elements(), _frequencies(reduction.error, reduction.model.units))
        return tables if reduction.simulated is None else (*tables, *_simulated(reduction.simulated))

    def figures(self) -> list[Chart]:
        return _frequency_charts(self.result.error, self.result.model.units)

    def content(self) -> dict[str, Any]:
        return self.result.to_dict()

    def numbers(self) -> Arrays:
        reduction = self.result
        unit = "rad/s" if self.result.model.units == "SI" else "1"
        pairs = [(kept, body, ratio) for kept, members in reduction.groups.items() for body, ratio in members.items()]
        return Arrays(
            {
                **record_columns(list(reduction.elements.values()), "element", units={"share": "1", "at": unit}),
                **_error_columns(reduction.error, unit),
                "kept_body": ("merged_body", texts(kept for kept, *_ in pairs)),
                "angle_ratio": ("merged_body", [ratio for *_, ratio in pairs], {"units": "1"}),
                **({} if reduction.simulated is None else _simulated_columns(reduction.simulated)),
            },
            {"element": texts(reduction.elements), "merged_body": texts(body for _, body, _ in pairs)},
            {"model": reduction.model.name, "up_to": reduction.up_to},
        )

    def _groups(self) -> Table:
        rows = [
            (kept, body, f"{ratio:.6g}")
            for kept, members in self.result.groups.items()
            for body, ratio in members.items()
        ]
        note = "Angle: of the merged body over that of the body kept."
        return Table(("body kept", "takes", "angle"), tuple(rows), frozenset({0, 1}), "Bodies", note)

    def _elements(self) -> Table:
        units = self.result.model.units
        rows = []
        for name, fate in self.result.elements.items():
            strain = (
                ("–", "–") if math.isnan(fate.share) else (f"{100 * fate.share:.3g} %", frequency_text(fate.at, units))
            )
            rows.append((name, "merged" if fate.merged else "stays", fate.reason, *strain))
        head = ("element", "now", "because", "largest share of strain energy", "at")
        return Table(head, tuple(rows), frozenset({0, 1, 2}), "Elements")


class CondensedPage(Presentation[Condensed]):
    """Presentation of a model in few coordinates: its matrices and their error."""

    kind = "condensation"
    endings = (*RESULT_ENDINGS, ".npz", ".mat")

    @property
    def title(self) -> str:
        return f"Condensed by {self.result.method}"

    @property
    def sentence(self) -> str:
        condensed = self.result
        bodies = counted(len(condensed.inertia_names), "body", "bodies")
        size = f"{bodies} become {counted(len(condensed.coordinates), 'coordinate')} by {condensed.method}."
        return f"{size} {_error_sentence(condensed.error, condensed.units)}"

    def answer(self) -> tuple[Table, ...]:
        condensed = self.result
        rows = (
            ("coordinates", ", ".join(name or "a shape" for name in condensed.coordinates)),
            ("clearances kept", ", ".join(condensed.clearances) or "none"),
        )
        return Table(("", ""), rows, frozenset({0, 1})), _frequencies(condensed.error, condensed.units)

    def figures(self) -> list[Chart]:
        return _frequency_charts(self.result.error, self.result.units)

    def content(self) -> dict[str, Any]:
        return self.result.to_dict()

    def numbers(self) -> Arrays:
        condensed = self.result
        si = condensed.units == "SI"
        square = ("coordinate", "other_coordinate")
        units = ("kg m^2", "N m s/rad", "N m/rad") if si else ("1", "1", "1")
        numbers = np.arange(1, len(condensed.coordinates) + 1)
        return Arrays(
            {
                "basis": (("inertia", "coordinate"), condensed.basis),
                "rows": (("clearance", "coordinate"), condensed.rows),
                "mass": (square, condensed.mass, {"units": units[0]}),
                "damping": (square, condensed.damping, {"units": units[1]}),
                "stiffness": (square, condensed.stiffness, {"units": units[2]}),
                "coordinate_inertia": ("coordinate", texts(condensed.coordinates), {"long_name": "empty: a shape"}),
                **_error_columns(condensed.error, "rad/s" if si else "1"),
            },
            {
                "inertia": texts(condensed.inertia_names),
                "clearance": texts(condensed.clearances),
                "coordinate": numbers,
                "other_coordinate": numbers,
            },
            {"method": condensed.method},
        )

    def write(self, path: Path) -> None:
        """Write the matrices and the names of their rows and columns as .npz or .mat; or another of the ``endings``."""
        if path.suffix not in (".npz", ".mat"):
            super().write(path)
            return
        names = {key: texts(getattr(self.result, key)) for key in ("inertia_names", "coordinates", "clearances")}
        names["format"] = np.array([format_name("matrices")])
        if path.suffix == ".npz":
            arrays: dict[str, Any] = {**self.result.matrices, **names}
            np.savez(path, **arrays)
            return
        from scipy.io import savemat

        savemat(path, {**self.result.matrices, **{key: value.astype(object) for key, value in names.items()}})


def _error_sentence(error: ReductionError, units: str) -> str:
    """Return a sentence with the errors of frequencies and responses in the band against the full model."""
    if math.isnan(error.at):
        sentences = ["No elastic mode lies in the band."]
    else:
        state = ", ".join(f"{name} at {factor:g} of its last slope" for name, factor in error.state.items())
        sentences = [
            f"Frequencies in the band are at most {100 * error.frequency:.2g} % off over {error.states} contact states "
            f"(allowed {100 * error.limit:g} %), at {frequency_text(error.at, units)}, {state or 'all in contact'}."
        ]
    if not math.isnan(error.response_db):
        sentences.append(
            f"Responses in the band, all in contact, are at most {error.response_db:.2g} dB and "
            f"{100 * error.response_peak:.2g} % of their peak off."
        )
    return " ".join(sentences)


def _frequencies(error: ReductionError, units: str) -> Table:
    pairs = zip(error.frequencies, error.reduced_frequencies, error.mac, strict=True)
    rows = tuple((frequency_text(a, units), frequency_text(b, units), f"{mac:.6f}") for a, b, mac in pairs)
    note = "Elastic modes in the band, all in contact. MAC: modal assurance, mass as weight; 1 is the same shape."
    return Table(("full model", "smaller model", "MAC"), rows, frozenset(), "Frequencies", note)


def _frequency_charts(error: ReductionError, units: str) -> list[Chart]:
    """Draw the errors of the natural frequencies in the band; empty if the band has none."""
    full = np.array(error.frequencies)
    smaller = np.array(error.reduced_frequencies)
    allowed = 100.0 * error.limit
    chart = row_chart(
        "frequencies",
        "Error of the frequencies",
        "How far each natural frequency in the band is from that of the full model, all in contact, between the errors "
        "allowed.",
        [frequency_text(frequency, units) for frequency in full.tolist()],
        [Series("", 100.0 * (smaller - full) / full)],
        level="difference, % of the full model's frequency",
        marks=[-allowed, 0.0, allowed],
    )
    return [] if chart is None else [chart]


def _error_columns(error: ReductionError, unit: str) -> dict[str, Any]:
    mode = "mode_in_band"
    return {
        "frequency": (mode, error.frequencies, {"units": unit}),
        "reduced_frequency": (mode, error.reduced_frequencies, {"units": unit}),
        "mac": (mode, error.mac, {"units": "1"}),
        "frequency_error": ((), error.frequency, {"units": "1"}),
        "frequency_error_at": ((), error.at, {"units": unit}),
        "allowed_frequency_error": ((), error.limit, {"units": "1"}),
        "response_error": ((), error.response_db, {"units": "dB"}),
        "response_error_of_peak": ((), error.response_peak, {"units": "1"}),
    }


def _simulated(simulated: Simulated) -> tuple[Table, ...]:
    """Return both verdicts, and the entries that differ; of entries from spectra only the number."""
    different = simulated.differences()
    listed = [entry for entry in different if entry.criterion != "spectrum"]
    title = f"{len(different)} of {len(simulated.entries)} quantities differ, numbers by more than 1 %"
    spectra = len(different) - len(listed)
    note = f"{spectra} of them in the spectra: summary.json and --json list them." if spectra else ""
    verdicts = (("full model simulated", simulated.full), ("reduced", simulated.reduced))
    rows = tuple(
        (entry.subject, entry.quantity, _shown(entry.full), _shown(entry.reduced), entry.unit, entry.change)
        for entry in listed
    )
    head = ("of", "quantity", "full", "reduced", "unit", "change")
    return (
        Table(
            ("model", "verdict"),
            verdicts,
            frozenset({0, 1}),
            "Both motions",
            "" if rows else f"{title}. {note}".strip(),
        ),
        Table(head, rows, frozenset({0, 1, 4}), title, note),
    )


def _simulated_columns(simulated: Simulated) -> dict[str, Any]:
    """Return every entry of both verdicts: its numbers, NaN for words."""
    names = ("criterion", "subject", "quantity", "unit")
    columns = record_columns(simulated.entries, "entry", names=names)
    for name in ("full", "reduced"):
        values = [getattr(entry, name) for entry in simulated.entries]
        columns |= number_columns(name, f"{name}_word", values, "entry")
    return columns


def _shown(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"
