"""Figures for print show the chart's own data, with words that stand apart, at the width asked for."""

from __future__ import annotations

import re
import zlib
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Annotation, Text

from gearrattle.errors import ModelError
from gearrattle.report.plots.chart import Band, Bars, Cells, Chart, Heat, Key, Label, Line, Panel, Rule
from gearrattle.report.plots.palette import CENTRE, COAST, DRIVE, MUTED, SHADES
from gearrattle.report.plots.run_figures import charts
from gearrattle.report.plots.svg_axes import limits
from gearrattle.report.plots.typeset import FORMATS, Style, matplotlib_figure, save_figure
from gearrattle.report.plots.typeset.marks import pooled
from gearrattle.report.plots.typeset.overlap_removal import shown_words
from gearrattle.report.plots.typeset.print_axes import broken, label_of
from gearrattle.report.plots.typeset.print_files import known_formats, saved
from gearrattle.report.plots.typeset.row_names import rows_of
from gearrattle.report.plots.typeset.styles_by_colour import looks_of
from tests import synthetic

pytestmark = pytest.mark.slow

TIME = np.linspace(0.0, 4.0, 401)
NOISE = np.random.default_rng(5).normal(size=(30, 40))
NAMES = ("torque.0.harmonics.0.amplitude", "inertia.output_gear.drag_torque", "mesh.gear.backlash")


def everything() -> Chart:
    """A chart with every kind of mark."""
    rows = np.arange(3.0)
    return Chart(
        "everything",
        "Title",
        "Caption.",
        (
            Panel(
                "lines and a very long title that no narrow column holds",
                "rad/s^2",
                "time / T  [cycles]",
                (
                    Line(TIME, np.sin(TIME), "sine", DRIVE, legend=True),
                    Line(TIME, np.cos(TIME), "cosine", COAST),
                    Line(TIME[::40], np.sin(TIME[::40]), "dots", DRIVE, "points", 4.0, 0.5),
                    Line(np.array([0.0, 1.0, 2.0]), np.array([0.5, np.nan, 0.2]), "broken", MUTED),
                ),
                bands=(Band(0.5, None, DRIVE), Band(1.0, 2.0, COAST, along="x")),
                rules=(Rule(0.5, label="corner"), Rule(1.5, along="x", dashed=False, label="here")),
                labels=(Label(4.0, 0.0, "at the end"), Label(2.0, 0.5, "first"), Label(2.0, 0.5, "second, on it")),
                x_range=(0.0, 4.0),
                y_range=(-1.5, 3.5),
            ),
            Panel(
                "bars",
                "impacts",
                "speed",
                bars=(
                    Bars(np.array([0.0, 1.0, 3.0]), np.array([4.0, 2.0]), "drive", DRIVE),
                    Bars(np.array([0.0, 1.0, 3.0]), np.array([1.0, 3.0]), "coast", COAST, np.array([4.0, 2.0])),
                ),
            ),
            Panel(
                "map",
                "Hz",
                "speed, rpm",
                heat=Heat((0.0, 4.0), (1e3, 3e3), NOISE, -2.0, 2.0, "dB"),
                x_range=(0.0, 4.0),
                y_range=(1e3, 3e3),
            ),
            Panel(
                "decades",
                "W",
                "order",
                (Line(TIME[1:], 10.0 ** (-9.0 * TIME[1:]), "decay"),),
                x_log=True,
                y_log=True,
                x_range=(0.01, 4.0),
                y_range=(1e-36, 1.0),
            ),
            Panel(
                "bars that lie",
                "%",
                "share",
                cells=(Cells(np.zeros(3), rows + 1.0, rows - 0.3, rows + 0.3, "c", COAST),),
                labels=(
                    *(Label(-3.0, at, name) for at, name in zip(rows, NAMES, strict=True)),
                    *(Label(3.2, at, "0 to 1") for at in rows),
                ),
                x_range=(-3.0, 4.0),
                y_range=(-0.6, 2.6),
                y_ticks=((-9.0, ""),),
            ),
            Panel("nothing", note="not supplied by this algorithm"),
        ),
        columns=2,
        share_x=False,
        legend=(Key("drive side", DRIVE), Key("coast side", COAST), Key("limits", MUTED)),
    )


def panel_alone(index: int) -> Chart:
    """One panel of the chart with every kind of mark: as quick to draw as a figure is."""
    return replace(everything(), panels=everything().panels[index : index + 1], columns=1)


CHARTS = [everything(), *charts(synthetic.findings("double-sided"))]


@pytest.fixture(
    scope="module",
    params=[
        *((chart, 85.0) for chart in CHARTS if chart.key != "rattle_metrics"),
        *(pytest.param((chart, 85.0), marks=pytest.mark.long) for chart in CHARTS if chart.key == "rattle_metrics"),
        *(pytest.param((chart, 175.0), marks=pytest.mark.long) for chart in CHARTS),
    ],
    ids=lambda entry: f"{entry[0].key}-{entry[1]:g}",
)
def drawn(request: pytest.FixtureRequest) -> tuple[Chart, Figure]:
    chart, width = request.param
    return chart, matplotlib_figure(chart, Style(width))


def panels_of(chart: Chart, figure: Figure) -> list[tuple[Panel, Axes]]:
    return list(zip(chart.panels, figure.axes[: len(chart.panels)], strict=True))


def test_figure_has_the_chart_s_panels_labels_and_limits(drawn: tuple[Chart, Figure]) -> None:
    chart, figure = drawn
    scales = len({(p.heat.low, p.heat.high, p.heat.name) for p in chart.panels if p.heat})
    assert len(figure.axes) == len(chart.panels) + scales
    for index, (panel, axes) in enumerate(panels_of(chart, figure)):
        rows = rows_of(panel)
        x, y = limits(rows.panel)
        assert axes.get_xlim() == pytest.approx(x)
        assert axes.get_ylim() == pytest.approx(y)
        assert (axes.get_xscale(), axes.get_yscale()) == tuple(
            "log" if v else "linear" for v in (panel.x_log, panel.y_log)
        )
        upright, title = axes.get_ylabel(), _one_line(axes.get_title(loc="left"))
        assert (_one_line(upright), title) == (
            ("", f"{panel.title} [{panel.unit}]") if rows.wordy and panel.unit else (label_of(panel.unit), panel.title)
        )
        if not chart.share_x or index == len(chart.panels) - 1:
            assert _one_line(axes.get_xlabel()) == label_of(panel.x_title)


def test_lines_bars_and_maps_are_the_chart_s_data(drawn: tuple[Chart, Figure]) -> None:
    chart, figure = drawn
    for panel, axes in panels_of(chart, figure):
        lines = [line for line in axes.lines if line.get_zorder() >= 2.0]
        assert len(lines) == len(panel.lines)
        for line, artist in zip(panel.lines, lines, strict=True):
            assert np.array_equal(artist.get_xdata(), line.x, equal_nan=True)
            assert np.array_equal(artist.get_ydata(), line.y, equal_nan=True)
            assert to_hex(artist.get_color()) == line.colour
            assert artist.get_alpha() == (None if line.opacity == 1.0 else line.opacity)
        heights = [bar.get_height() for bars in axes.containers for bar in bars]
        assert heights == [value for bars in panel.bars for value in bars.heights]
        boxes = [path for c in axes.collections if isinstance(c, PolyCollection) for path in c.get_paths()]
        assert len(boxes) == sum(len(cells.left) for cells in panel.cells)
        if panel.heat is not None:
            (image,) = axes.images
            assert np.array_equal(np.asarray(image.get_array()), panel.heat.values)
            assert tuple(image.get_extent()) == (*panel.heat.x_range, *panel.heat.y_range)
            assert image.get_clim() == (panel.heat.low, panel.heat.high)
            assert to_hex(image.cmap(0.0)) == SHADES[0]


def _one_line(text: str) -> str:
    return re.sub(r"(?<=[._])\n", "", text).replace("\n", " ").replace("\u00a0", " ")


def words_of(figure: Figure) -> list[Text]:
    """All words outside the panels, and those inside that are shown."""
    actual: list[Text] = []
    for axes in figure.axes:
        if axes.axison:
            actual += [*shown_words(axes.xaxis), *shown_words(axes.yaxis), axes.xaxis.label, axes.yaxis.label]
        actual += [text for text in axes.texts if text.get_visible()]
        actual += [
            title for title in axes.findobj(Text) if title.get_text() and title.get_text() == axes.get_title(loc="left")
        ]
    for legend in figure.legends:
        actual += legend.get_texts()
    unique = {id(text): text for text in actual if text.get_text()}
    return [text for text in unique.values() if not (isinstance(text, Annotation) and not text.get_visible())]


def test_words_stand_apart_and_on_the_paper(drawn: tuple[Chart, Figure]) -> None:
    _, figure = drawn
    figure.draw_without_rendering()
    boxes = [(text.get_text(), text.get_window_extent()) for text in words_of(figure)]
    assert len(boxes) >= 6
    for words, box in boxes:
        assert box.x0 >= -0.5, words
        assert box.y0 >= -0.5, words
        assert box.x1 <= figure.bbox.x1 + 0.5, words
        assert box.y1 <= figure.bbox.y1 + 0.5, words
    pixel = figure.dpi / 72.0
    for (first, a), (second, b) in combinations(boxes, 2):
        assert not a.padded(-0.4 * pixel).overlaps(b.padded(-0.4 * pixel)), f"{first!r} on {second!r}"


def test_letters_keep_their_size_and_panels_are_not_squeezed(drawn: tuple[Chart, Figure]) -> None:
    chart, figure = drawn
    assert {text.get_fontsize() for text in words_of(figure)} <= {7.0, 8.0}
    for _, axes in panels_of(chart, figure):
        box = axes.get_window_extent()
        assert box.width / figure.dpi * 25.4 > 20.0
        assert box.height / figure.dpi * 25.4 > 15.0


def test_a_check_of_overlaps_can_fail() -> None:
    figure = matplotlib_figure(CHARTS[1], Style(85.0))
    axes = figure.axes[-1]
    axes.text(0.5, -0.05, "on the ticks, wherever they are, as it is as long as the axis", transform=axes.transAxes)
    with pytest.raises(AssertionError):
        test_words_stand_apart_and_on_the_paper((CHARTS[1], figure))


@pytest.mark.parametrize("width", ["single", *(pytest.param(w, marks=pytest.mark.long) for w in ("3.5 inch", 120.0))])
def test_pdf_is_as_wide_as_asked_and_carries_its_fonts(tmp_path: Path, width: float | str) -> None:
    actual = matplotlib_figure(panel_alone(0), Style(width))
    raw = save_figure(actual, tmp_path / "a.pdf").read_bytes()
    wanted = {"single": 85.0, "double": 175.0, "3.5 inch": 88.9}.get(str(width), width)
    assert raw.startswith(b"%PDF-")
    (box,) = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", raw)
    assert float(box[0]) * 25.4 / 72.0 == pytest.approx(wanted, abs=0.1)
    inside = raw + b"".join(_streams(raw))
    assert b"/FontFile2" in inside  # TrueType, whole or in part; type 3 has none
    assert b"/Type3" not in inside
    assert b"CreationDate" not in inside


def _streams(raw: bytes) -> list[bytes]:
    actual = []
    for part in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", raw, re.DOTALL):
        try:
            actual.append(zlib.decompress(part))
        except zlib.error:
            continue
    return actual


def test_the_same_chart_gives_the_same_bytes_whatever_the_session_has_set() -> None:
    chart = panel_alone(0)
    ours = matplotlib_figure(chart, Style("single"))
    first = [saved(ours, kind, title="t", subject="s") for kind in FORMATS]
    theirs = {
        "font.size": 20.0,
        "font.family": ["serif"],
        "lines.linewidth": 5.0,
        "axes.grid": True,
        "pdf.fonttype": 3,
        "xtick.labelsize": 3.0,
        "savefig.dpi": 30.0,
        "text.color": "red",
        "svg.hashsalt": None,
        "figure.facecolor": "yellow",
        "savefig.bbox": "tight",
        "axes.spines.top": True,
        "legend.frameon": True,
    }
    with mpl.rc_context(theirs):  # type: ignore[arg-type]
        before = dict(mpl.rcParams)  # type: ignore[call-overload]
        figure = matplotlib_figure(chart, Style("single"))
        second = [saved(figure, kind, title="t", subject="s") for kind in FORMATS]
        third = [saved(figure, kind, title="t", subject="s") for kind in FORMATS[:2]]
        assert dict(mpl.rcParams) == before  # type: ignore[call-overload]
    assert first == second
    assert first[:2] == third, "a figure saved again"


def test_a_style_of_the_reader_s_own_is_laid_over_ours(tmp_path: Path) -> None:
    file = tmp_path / "mine.mplstyle"
    file.write_text("font.size: 11\nxtick.labelsize: 10\naxes.linewidth: 2\n")
    axes = matplotlib_figure(panel_alone(1), Style(rc=file)).axes[0]
    assert axes.xaxis.get_ticklabels()[0].get_fontsize() == 10.0
    assert axes.spines["left"].get_linewidth() == 2.0
    assert matplotlib_figure(panel_alone(1), Style(rc="grayscale"))


def test_every_colour_of_curves_has_dashes_and_of_points_a_marker() -> None:
    looks = looks_of(everything())
    assert looks.dashes[DRIVE] == (0.0, None)
    assert len({looks.dashes[colour] for colour in (DRIVE, COAST, MUTED)}) == 3
    cuts = Chart(
        "k",
        "t",
        "c",
        (
            Panel(
                "p",
                lines=tuple(
                    Line(TIME, TIME, c, c, mark)
                    for c in (DRIVE, COAST, "#009e73", "#cc79a7")
                    for mark in ("line", "points")
                ),
            ),
        ),
    )  # type: ignore[arg-type]
    assert len(set(looks_of(cuts).dashes.values())) == len(set(looks_of(cuts).markers.values())) == 4
    context = looks_of(replace(everything(), legend=()))
    assert context.dashes[MUTED] == (0.0, None)


def test_areas_of_like_grey_are_hatched() -> None:
    ends = np.zeros(1), np.ones(1), np.zeros(1), np.ones(1)
    chart = Chart("k", "t", "c", (Panel("p", cells=tuple(Cells(*ends, c, c) for c in ("#111111", CENTRE, "#151515"))),))
    assert looks_of(chart).hatches["#111111"] == looks_of(chart).hatches[CENTRE] == ""
    assert looks_of(chart).hatches["#151515"] != ""


def test_a_map_finer_than_print_keeps_its_largest_cells() -> None:
    values = np.zeros((1000, 3))
    values[517, 1] = 9.0
    values[:, 2] = np.nan
    actual = pooled(values, 100)
    assert actual.shape == (100, 3)
    assert actual[51, 1] == 9.0
    assert actual[:, 1].sum() == 9.0
    assert np.isnan(actual[:, 2]).all()
    assert pooled(values, 1000) is values


def test_a_curve_finer_than_print_keeps_its_spike() -> None:
    x = np.arange(200_000.0)
    y = np.sin(x / 5e3)
    y[123_456] = 40.0
    axes = matplotlib_figure(Chart("k", "t", "c", (Panel("p", lines=(Line(x, y, "n"),)),)), Style(85.0)).axes[0]
    (line,) = [line for line in axes.lines if line.get_zorder() >= 2.0]
    assert len(line.get_xdata()) <= 4 * 85.0 / 25.4 * 600.0
    assert 40.0 in line.get_ydata()


def test_names_of_rows_stand_beside_their_panel() -> None:
    rows = rows_of(everything().panels[4])
    assert [word for _, word in rows.panel.y_ticks] == list(NAMES)
    assert [label.words for label in rows.right] == ["0 to 1"] * 3
    assert not rows.panel.labels
    low, high = limits(rows.panel)[0]
    assert -0.2 < low < 0.0
    assert high == 3.2
    other = everything().panels[0]
    assert rows_of(other).panel is other


def test_long_words_are_broken_but_not_before_a_unit() -> None:
    assert broken(NAMES[0], 22) == "torque.0.harmonics.0.\namplitude"
    assert broken("largest impulse, N s", 16).replace("\u00a0", " ") == "largest\nimpulse, N s"
    assert broken("simulated scatter: 2.4 %", 22).replace("\u00a0", " ") == "simulated scatter:\n2.4 %"


def test_eps_shows_what_is_translucent_as_it_looks() -> None:
    figure = matplotlib_figure(panel_alone(0), Style("single"))
    dots = next(line for line in figure.axes[0].lines if line.get_alpha() == 0.5)
    raw = saved(figure, "eps")
    assert dots.get_alpha() == 0.5  # as before
    red, green, blue = (0.5 + 0.5 * int(DRIVE[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    actual = re.findall(rb"([\d.]+) ([\d.]+) ([\d.]+) setrgbcolor", raw)
    assert any(np.allclose([float(v) for v in entry], (red, green, blue), atol=0.004) for entry in actual)


def test_shadings_go_on_where_limits_are_moved() -> None:
    axes = matplotlib_figure(panel_alone(0), Style("single")).axes[0]
    tops = [patch.get_y() + patch.get_height() for patch in axes.patches if isinstance(patch, Rectangle)]
    assert max(tops) > 20.0


@pytest.mark.parametrize(
    ("values", "position", "message"),
    [
        ({"width": "85"}, "width", "60 to 500 mm"),
        ({"width": "85 N"}, "width", '"85 N"'),
        ({"width": 10.0}, "width", "60 to 500 mm"),
        ({"width": "broad"}, "width", '"single"'),
        ({"font": "No Such Family"}, "font", '"serif"'),
        ({"size": 99.0}, "size", "5 to 14 pt"),
        ({"rc": "no-such-file.mplstyle"}, "style", "style file"),
    ],
)
def test_what_cannot_be_drawn_is_refused(values: dict[str, object], position: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        Style(**values)  # type: ignore[arg-type]
    (problem,) = caught.value.problems
    assert problem.place == position
    assert message in str(problem)


def test_formats_are_read_and_refused() -> None:
    assert known_formats("pdf, .PNG,pdf") == ["pdf", "png"]
    for wrong in ("", "bmp", "pdf,docx"):
        with pytest.raises(ModelError, match="must be pdf, eps, svg, png or tiff"):
            known_formats(wrong)
    with pytest.raises(ModelError, match="LaTeX"):
        known_formats("pgf")
