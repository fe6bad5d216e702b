"""Sounds of several designs as a result: a WAV file of every design next to the page, and the levels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gearrattle.report.numbers import Arrays
from gearrattle.report.plots.chart import Chart
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import stacked, texts
from gearrattle.report.sound.charts import sound_charts
from gearrattle.report.sound.listen import Sound
from gearrattle.report.tables import Table
from gearrattle.wording import counted

_UNITS = {
    "level": "dB",
    "loudness": "sone",
    "loudness_5": "sone",
    "sharpness": "acum",
    "roughness": "asper",
    "prominence": "1",
    "adjustment": "dB",
}


class SoundPage(Presentation[Sound]):
    """Presentation of the sounds of several designs, all with one transfer path and one gain."""

    kind = "sound"

    def __init__(self, result: Sound, *, with_quality: bool = False) -> None:
        """Present sounds; with quality, ``Sound.quality`` of each is computed too (extra ``sound``)."""
        super().__init__(result)
        qualities = result.quality() if with_quality else {}
        self.designs = {
            name: {"level": level, **(qualities[name]._asdict() if with_quality else {})}
            for name, level in result.levels.items()
        }

    @property
    def title(self) -> str:
        return ", ".join(self.result.names)

    @property
    def sentence(self) -> str:
        sound = self.result
        designs = counted(len(sound.names), "design")
        return f"{designs} at {sound.rate} Hz; gain {sound.gain:.6g} of full scale per Pa, the same for all."

    def answer(self) -> tuple[Table, ...]:
        head = ("design", *(f"{key} [{_UNITS[key]}]" for key in next(iter(self.designs.values()))))
        rows = tuple((name, *(f"{value:.4g}" for value in design.values())) for name, design in self.designs.items())
        return (Table(head, rows),)

    def figures(self) -> list[Chart]:
        return sound_charts(self.result)

    def content(self) -> dict[str, Any]:
        sound = self.result
        return {"designs": self.designs, "gain": sound.gain, "rate": sound.rate, "path": sound.path.source}

    def numbers(self) -> Arrays:
        sound = self.result
        qualities = next(iter(self.designs.values()))
        levels = {
            name: ("design", [values[name] for values in self.designs.values()], {"units": _UNITS[name]})
            for name in qualities
        }
        pressure = ("design", "sample"), stacked(sound.pressure), {"units": "Pa"}
        attributes = {"rate": sound.rate, "gain": sound.gain, "path": sound.path.source}
        return Arrays({**levels, "pressure": pressure}, {"design": texts(sound.names)}, attributes)

    def accompany(self, folder: Path) -> None:
        """Write the WAV file of every design."""
        for name in self.result.names:
            (folder / f"{name}.wav").write_bytes(self.result.wav(name, self.result.bits))
