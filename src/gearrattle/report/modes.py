"""Modes as one page: what each one works in and what shakes it, the Campbell diagram, shapes on the driveline.

``fill_modes`` writes modes.html, modes.json and figures/ into a folder. The page has no script and loads nothing.

Takes a model, its Modes and a Campbell.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.assembly import assemble, name_plate
from gearrattle.calls.campbell import Campbell, Crossing
from gearrattle.calls.statics import Modes
from gearrattle.json_types import json_value
from gearrattle.model import Model
from gearrattle.plots.mode_shapes import mode_sketch
from gearrattle.report.drawn import charts_of
from gearrattle.report.modes_tables import crossings_table, energy_tables, modes_in_words, percent, rate, turning
from gearrattle.report.page import Page, Picture, Section, fill_page
from gearrattle.report.saved import write_json
from gearrattle.report.summary import modes_dict
from gearrattle.wording import counted

MOST_SHAPES = 24


def modes_content(model: Model, modes: Modes, found: Campbell) -> dict[str, Any]:
    """Return everything for machines: modes, with frequencies in rad/s, and the Campbell diagram."""
    return {
        "model": {"name": model.name, "units": model.units},
        **modes_dict(modes),
        "campbell": json_value(found.to_dict()),
    }


def fill_modes(model: Model, modes: Modes, found: Campbell, setting: str, folder: Path) -> None:
    """Write all files into an existing folder.

    Args:
        model: the driveline.
        modes: its modes in one contact state.
        found: its Campbell diagram, perhaps in several.
        setting: that contact state in words.
        folder: where to.
    """
    si = model.units == "SI"
    title = model.name or "driveline"
    sections = _sections(model, modes, found, setting, si)
    fill_page(Page("modes", title, sections, has_legends=False), folder, "modes.html")
    write_json(modes_content(model, modes, found), folder / "modes.json", "modes summary")


def _sections(model: Model, modes: Modes, found: Campbell, setting: str, si: bool) -> tuple[Section, ...]:
    (chart,) = charts_of(found)
    crossings = crossings_table(found, si=si)
    none = () if crossings.rows else ("No order line meets a natural frequency in this range.",)
    shapes = _shapes(model, modes, si)
    key = (
        "Stems: how far each inertia turns, the largest angle 1. Elements: the thicker and redder, the larger their "
        "share of the strain energy; shares from 5 % on are written."
    )
    omitted = len(modes.frequencies) - len(shapes)
    left_out = (f"{counted(omitted, 'higher mode')} not drawn; modes.json has all shapes.",) if omitted else ()
    table = modes_in_words(modes, found.model_speed, si=si)
    return (
        Section("modes", "Modes", _lead(modes, found, si), (setting,), tables=(table,)),
        Section("campbell", chart.title, words=none, charts=(chart,), tables=(crossings,)),
        Section("shapes", "Shapes", words=(key, *left_out), pictures=shapes),
        Section("energies", "Energies", tables=tuple(energy_tables(modes, si=si))),
    )


def _shapes(model: Model, modes: Modes, si: bool) -> tuple[Picture, ...]:
    """Draw the lowest modes on the driveline."""
    layout = name_plate(model, assemble(model))
    drawings = []
    for mode, frequency in enumerate(modes.frequencies.tolist()[:MOST_SHAPES]):
        told = "rigid motion" if frequency == 0.0 else rate(frequency, si=si)
        words = f"mode {mode + 1}, {told}"
        sketch = mode_sketch(layout, modes, mode, words)
        drawings.append(Picture(f"mode-{mode + 1}", words, sketch, is_wide=len(modes.inertia_names) > 12))
    return tuple(drawings)


def _lead(modes: Modes, found: Campbell, si: bool) -> str:
    """Say in two sentences what there is, and what is nearest to the model's speed."""
    elastic = modes.frequencies[modes.frequencies > 0.0]
    rigid = len(modes.frequencies) - len(elastic)
    if not elastic.size:
        return "Nothing swings: every motion is rigid."
    ends = rate(float(elastic[0]), si=si), rate(float(elastic[-1]), si=si)
    between = f"from {ends[0]} to {ends[1]}" if elastic.size > 1 else f"at {ends[0]}"
    also = f", and {counted(rigid, 'rigid motion')}" if rigid else ""
    words = f"{counted(elastic.size, 'mode')} {between}{also}. "
    near = found.nearest()
    low, high = (turning(speed, si=si) for speed in found.speeds)
    if near is None:
        return words + f"No order meets any of them between {low} and {high}."
    return words + (
        f"{counted(len(found.crossings), 'crossing')} with orders between {low} and {high}; nearest to the model's "
        f"speed of {turning(found.model_speed, si=si)}: {_nearest(found, near, si)}."
    )


def _nearest(found: Campbell, near: Crossing, si: bool) -> str:
    ratio = near.speed / found.model_speed
    away = "at it" if np.isclose(ratio, 1.0, rtol=5e-4) else (
        f"{percent(abs(ratio - 1.0))} {'above' if ratio > 1.0 else 'below'}"
    )  # fmt: skip
    return (
        f"order {near.order:g} meets mode {near.mode + 1} at {turning(near.speed, si=si)}, {away} "
        f"({near.source}, {percent(near.share)} of its energy)"
    )
