"""Sounds of several runs at one gain, as ``gr.listen`` makes them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, shown_problems
from gearrattle.json_types import json_value
from gearrattle.report.sound.listen import Sound, listen
from gearrattle.workbench.kept_results import run_of


def sound_of(folder: Path, elements: Sequence[str] | None, gain: float | None = None) -> Sound:
    """Return the sound of a job's run; elements and gain as of ``listen``."""
    return listen(run_of(folder), elements=elements, gain=gain)


def at_one_gain(folders: Sequence[Path], elements: Sequence[str] | None) -> dict[str, Any]:
    """Return the gain at which the sounds of several runs keep their differences, and what each of them is.

    Returns
    -------
    dict[str, Any]
        ``gain`` [1/Pa], at which the highest peak of all is half of full scale, and None where none makes a sound;
        ``designs``, one per job: its ``level`` [dB re 20 uPa], None for silence, and its ``problems``, empty where it
        can be heard; ``notes``.
    """
    designs: list[dict[str, Any]] = []
    gains: list[float] = []
    notes: dict[str, None] = {}
    for folder in folders:
        try:
            sound = sound_of(folder, elements)
        except ModelError as error:
            problems = [problem.to_dict() for problem in shown_problems(error.problems)]
            designs.append({"level": None, "problems": problems})
            continue
        (level,) = json_value(list(sound.levels.values()))
        designs.append({"level": level, "problems": []})
        gains += [sound.gain] if level is not None else []
        notes |= dict.fromkeys(sound.notes)
    return {"gain": min(gains, default=None), "designs": designs, "notes": list(notes)}
