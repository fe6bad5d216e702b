"""The report says what was found, needs nothing else, and appears whole."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.quantities.evaluation import judge
from gearrattle.report.model_tables import cost_table, model_tables
from gearrattle.report.plots.run_figures import FIGURES, charts
from gearrattle.report.plots.sketch import sketch
from gearrattle.report.reliability import trust
from gearrattle.report.summary import findings_content
from gearrattle.report.verdict_tables import criteria_tables, parts_table, tiles, verdict_table
from gearrattle.trajectory import NegligibleImpacts
from gearrattle.workbench.views import plain, verdict_numbers
from tests import synthetic


class Page(HTMLParser):
    """Collects tags, attributes, text and the content of scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.scripts: list[tuple[dict[str, str | None], str]] = []
        self._inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._inside = tag

    def handle_endtag(self, tag: str) -> None:
        self._inside = self._inside if tag == "br" else ""

    def handle_data(self, data: str) -> None:
        if self._inside == "script":
            self.scripts.append((self.tags[-1][1], data))
        elif self._inside != "style":
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("report") / "out"
    assert synthetic.findings("double-sided").save(target) == target / "report.html"
    return target


@pytest.fixture(scope="module")
def page(folder: Path) -> Page:
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def test_every_file_is_there(folder: Path) -> None:
    names = {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}
    keys = {chart.key for chart in charts(synthetic.findings("double-sided"))}
    ink = {f"figures/{key}.svg" for key in keys}
    assert names == {"report.html", "summary.json", "results.nc", "figures/charts.npz", *ink}
    for figure in (folder / "figures").glob("*.svg"):
        ElementTree.parse(figure)


def test_the_verdict_comes_first(page: Page) -> None:
    verdict = synthetic.findings("double-sided").verdict
    first = next(i for i, (tag, attrs) in enumerate(page.tags) if tag == "section")
    assert page.tags[first][1]["id"] == "verdict"
    assert "Double-sided rattle" in page.text
    for words in (verdict.sentence, verdict.rule, *verdict.notes, *synthetic.trajectory().notes):
        assert " ".join(words.split()) in page.text


def test_every_section_and_every_figure_is_there(page: Page) -> None:
    ids = [attrs["id"] for _, attrs in page.tags if attrs.get("id")]
    assert [name for name, count in Counter(ids).items() if count > 1] == []
    assert {
        "verdict",
        "driveline",
        "clearances",
        "histories",
        "impacts",
        "phase_plane",
        "spectrum",
        "linear",
        "criteria",
        "model",
        "computation",
    } <= set(ids)
    links = {attrs["href"] for tag, attrs in page.tags if tag == "a"}
    assert links <= {f"#{name}" for name in ids}
    assert (
        sum(tag == "figure" for tag, _ in page.tags) == len(FIGURES) - 6
    )  # no friction, no run-up, no sideways motion


def test_nothing_is_loaded_from_elsewhere(folder: Path, page: Page) -> None:
    for tag, attrs in page.tags:
        for name in ("src", "href", "data", "action", "poster", "srcset"):
            assert (attrs.get(name) or "#").startswith(("#", "data:image/svg+xml;base64,")), (tag, name)
        assert tag != "link"
    policy = next(attrs["content"] for tag, attrs in page.tags if attrs.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert not re.search(r"https?:", policy)
    css = (folder / "report.html").read_text(encoding="utf-8").partition("<style>")[2].partition("</style>")[0]
    assert "url(" not in css
    assert "@import" not in css


def test_what_draws_the_figures_is_inlined_once_and_asks_nobody(page: Page) -> None:
    (ours,) = [text for attrs, text in page.scripts if attrs.get("type") == "module"]
    assert ours.count("const plot = (() =>") == 1
    assert not re.search(r"\bimport\b|\bfetch\(|XMLHttpRequest|WebSocket|\beval\(|innerHTML", ours)


def test_every_figure_carries_its_data_and_its_ink(page: Page) -> None:
    data = {attrs["id"]: json.loads(text) for attrs, text in page.scripts if attrs.get("type") == "application/json"}
    keys = [attrs["data-key"] for tag, attrs in page.tags if tag == "figure"]
    assert set(data) == {f"{key}-data" for key in keys}
    assert all(figure["panels"] for figure in data.values())
    images = [attrs for tag, attrs in page.tags if tag == "img"]
    assert len(images) == len(keys)
    assert all(image["alt"] for image in images)


def test_names_cannot_inject_anything(tmp_path: Path) -> None:
    actual = synthetic.findings("double-sided")
    evil = '<script>alert(1)</script> "&'
    model = actual.model.model_copy(update={"name": evil})
    run = replace(actual.motion, model=model)
    replace(actual, model=model, motion=run).save(tmp_path)
    parsed = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert "alert(1)" not in "".join(script for _, script in parsed.scripts)
    assert evil in "".join(parsed.words)


@pytest.mark.parametrize("kind", synthetic.DEFLECTIONS)
def test_every_verdict_has_its_headline(kind: str, tmp_path: Path) -> None:
    synthetic.findings(kind).save(tmp_path)
    headline = {"quiet": "Quiet"}.get(kind, f"{kind.capitalize()} rattle")
    assert f'<h2 class="headline">{headline}</h2>' in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_failing_write_leaves_nothing(tmp_path: Path) -> None:
    actual = synthetic.findings("quiet")

    class Full(synthetic.StandInRun):
        def write(self, path: Path) -> None:
            path.write_bytes(b"half")
            raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        replace(actual, motion=Full(actual.motion.trajectory, actual.model)).save(tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_summary_is_pure_json_and_holds_the_verdict(folder: Path) -> None:
    written = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    actual = synthetic.findings("double-sided")
    verdict = actual.verdict.to_dict()
    assert written["verdict"] == "double-sided"
    assert {key: written[key] for key in verdict if key != "notes"} == {
        k: v for k, v in verdict.items() if k != "notes"
    }
    assert set(written["notes"]) == {*actual.motion.notes, *actual.verdict.notes}
    assert written["cost"]["steps"] == 4321
    assert written["modes_contact"]["frequencies"] == [0.0, 350.0, 5800.0, 37000.0]
    assert written["equilibrium"]["region"] == {"clutch": 0, "spline": 1, "gear": 0}
    assert written["versions"]["gearrattle"]
    json.dumps(findings_content(actual), allow_nan=False)


def test_tiles_show_the_worst_part() -> None:
    shown = {tile.label: (tile.value, tile.detail) for tile in tiles(synthetic.findings("double-sided"))}
    assert shown["Impacts"] == ("47.7 /s", "gear · 2 per cycle")
    assert not any("margin" in label.lower() for label in shown)  # no design target: it stands among the criteria
    quiet = {tile.label: tile.value for tile in tiles(synthetic.findings("quiet"))}
    assert quiet["Impacts"] == "0 /s"
    assert "Hardest impact" not in quiet


def touching() -> gr.typing.Findings:
    """The same motion, all of whose impacts are negligible."""
    actual = synthetic.findings("double-sided")
    return replace(actual, verdict=judge(actual.motion.trajectory, negligible=NegligibleImpacts(energy=1e9)))


def test_touches_are_no_rattle_on_the_page_and_the_regime_stays_in_the_table(tmp_path: Path) -> None:
    actual = touching()
    actual.save(tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<title>Touches, no rattle: " in page
    assert '<h2 class="headline">Touches, no rattle</h2>' in page
    assert '<section id="verdict" class="verdict touches">' in page
    assert '<p class="lead">No gap rattles over the ' in page
    gear = next(row for row in parts_table(actual).rows if row[0] == "gear")
    assert (plain(gear[1]), gear[2]) == ("touches", "double-sided")
    assert next(row for row in verdict_table(actual.verdict).rows if row[0] == "gear")[1:3] == (
        "touches",
        "double-sided",
    )
    numbers = verdict_numbers(actual)
    assert (numbers["verdict"], numbers["severity"], numbers["state"]) == ("double-sided", "touches", "touches")
    assert not any(part["rattles"] for part in numbers["parts"])
    drawn = sketch(actual)
    assert "touches</tspan>" in drawn
    assert "double-sided</tspan>" not in drawn


def test_the_loose_gear_test_says_in_its_table_what_it_is() -> None:
    actual = synthetic.findings("double-sided")
    table = next(table for table in criteria_tables(actual.verdict) if table.title == "Loose-gear test")
    assert "torque ratio in the motion as it is; no design target" in table.note
    assert "margin" not in str(actual.verdict)


def test_parts_stand_worst_first_with_shares_that_fill_the_bar() -> None:
    table = parts_table(synthetic.findings("double-sided"))
    assert [row[0] for row in table.rows] == [part.name for part in synthetic.findings("double-sided").verdict.parts]
    for row in table.rows:
        assert sum(float(width) for width in re.findall(r"width:([\d.]+)%", row[-1])) == pytest.approx(100.0, abs=0.02)


def test_every_entry_of_every_criterion_is_in_a_table() -> None:
    actual = synthetic.findings("double-sided")
    tables = {table.title: table for table in criteria_tables(actual.verdict)}
    cells = sum(cell != "–" for table in tables.values() for row in table.rows for cell in row[1:])
    assert cells == sum(not (isinstance(e.value, float) and np.isnan(e.value)) for e in actual.verdict.entries)
    impacts = tables["Impacts"]
    gear = {row[0]: row[impacts.head.index("gear")] for row in impacts.rows}  # so many quantities stand in rows
    assert gear["impacts per cycle"] == "2"
    assert float(gear["largest impact energy [J]"].split()[0]) > 0.0


def test_model_tables_state_the_model() -> None:
    bodies, elements, excitation = model_tables(synthetic.findings("quiet"))
    assert bodies.rows[1] == ("hub", "4.5 × 10⁻⁴ kg m²", "1.35 × 10⁻⁴ N m s/rad", "0.2 N m")
    assert elements.rows[0][2] == "150 N m/rad to 160 mrad, then 1500 N m/rad"
    assert elements.rows[2][2] == "free to 50 µm, then 7.2 × 10⁸ N/m"
    assert excitation.rows[0][1] == "150 rad/s = 1432 rpm = 23.87 Hz"
    assert ("crossings found", str(len(synthetic.trajectory().events))) in cost_table(synthetic.findings()).rows


def test_trust_counts_both_halves() -> None:
    words = " ".join(trust(synthetic.findings("double-sided")))
    assert "8 of 12 cycles are judged, the first 4 left out" in words
    assert "first and second half of them: 8 and 8" in words
    stepped = synthetic.findings("double-sided")
    cost = replace(stepped.motion.trajectory.cost, algorithm="rk4")
    other = replace(stepped, motion=replace(stepped.motion, trajectory=replace(stepped.motion.trajectory, cost=cost)))
    assert "stepped by rk4" in " ".join(trust(other))
