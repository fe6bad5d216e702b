"""A value with a unit reads the same in the sentence, on the terminal, on the page and in a notebook."""

from __future__ import annotations

import re

import pytest

import gearrattle as gr
from gearrattle.report.verdict_tables import parts_table, tiles, verdict_table
from gearrattle.wording import engineering
from tests.comparison.cases import case


@pytest.fixture(scope="module")
def findings() -> gr.typing.Findings:
    return gr.run(case("case3"), cycles=12, discard=6, initial="static")


def test_speed_and_energy_are_written_alike(findings: gr.typing.Findings) -> None:
    """The sentence, the terminal's table, the page's table and its tiles have the same text for the same number."""
    parts = [part for part in findings.verdict.parts if part.max_impact_energy is not None]
    assert parts
    terminal = {row[0]: row for row in verdict_table(findings.verdict).rows}
    page = {row[0]: row for row in parts_table(findings).rows}
    for part in parts:
        assert part.max_impact_energy is not None
        energy = engineering(part.max_impact_energy, part.energy_unit)
        speed = engineering(part.max_approach_speed, part.speed_unit)
        assert terminal[part.name][4:6] == page[part.name][5:7] == (speed, energy)
        if part.rattles and part in findings.verdict.parts[:3]:
            assert f"approach speed up to {speed}, impact energy up to {energy}" in findings.verdict.sentence
    shown = {tile.label: tile.value for tile in tiles(findings)}
    assert shown["Hardest impact"] in {row[5] for row in terminal.values()}


def test_no_energy_in_a_sentence_needs_a_power_of_ten(findings: gr.typing.Findings) -> None:
    assert re.search(r"energy up to [\d.]+ [mµn]?J", findings.verdict.sentence)


@pytest.mark.parametrize(
    ("value", "text"), [(4e-8, "40 nJ"), (0.00295, "2.95 mJ"), (0.6, "0.6 J"), (3e-6, "3 µJ"), (12.0, "12 J")]
)
def test_energies_take_a_prefix(value: float, text: str) -> None:
    assert engineering(value, "J") == text
