"""A result as slides for PowerPoint: the answer with its first table, further tables of the answer, a slide a figure.

Tables are tables of PowerPoint, which can be changed; figures are pictures, drawn as for print.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.errors import check_installed
from gearrattle.report.plots.palette import ACCENT, INK, MUTED
from gearrattle.report.plots.typeset.style import check_matplotlib
from gearrattle.report.provenance import versions
from gearrattle.report.tables import cell_text
from gearrattle.wording import counted

if TYPE_CHECKING:
    from gearrattle.report.plots.chart import Chart
    from gearrattle.report.presentation import Presentation
    from gearrattle.report.tables import Table

WIDTH = 13.333
HEIGHT = 7.5
"""Of a slide [inch]: 16 to 9."""
_MARGIN = 0.6  # inch
_TOP = 1.35  # inch, below the title
_ROW = 0.32  # inch, height of a table's row
_MOST_ROWS = 14  # rows of a table on one slide
_MOST_SLIDES = 3  # slides of one table
_FIGURE_WIDTH = 250.0  # mm, of a figure as it is drawn
_DPI = 150.0
_BLANK = 6  # index of the layout without placeholders


def check(option: str, value: str) -> None:
    """Refuse slides without python-pptx, or without matplotlib for their figures (NotInstalled)."""
    check_installed("pptx", "office", option, value, "slides need python-pptx, which is not installed")
    check_matplotlib(option, value)


def write(presentation: Presentation[Any], path: Path) -> None:
    """Write the slides of a result."""
    import pptx
    from pptx.util import Inches

    deck = pptx.Presentation()
    deck.slide_width = Inches(WIDTH)
    deck.slide_height = Inches(HEIGHT)
    deck.core_properties.title = presentation.title
    deck.core_properties.author = "gearrattle"
    # the answer
    tables = [part for table in presentation.answer() if table.rows for part in _parts(table)]
    slide = _slide(deck, presentation.title)
    sentences = "\n".join((presentation.sentence, *presentation.further))
    below = _text(slide, sentences, _TOP, size=16)
    if tables and below + _height(tables[0]) < HEIGHT - _MARGIN:
        _table(slide, tables.pop(0), below)
    origin = f"{presentation.kind}; gearrattle {versions().get('gearrattle', '')}, {presentation.created}"
    _text(slide, origin, HEIGHT - 0.5, size=10, colour=MUTED)
    # its other tables, the figures, the notes
    for table in tables:
        _table(_slide(deck, table.title or "Table"), table, _TOP)
    for chart in presentation.charts():
        _figure(_slide(deck, f"{chart.title}: {chart.tab}" if chart.tab else chart.title), chart)
    if presentation.notes:
        _text(_slide(deck, "Notes"), "\n".join(presentation.notes), _TOP, size=14)
    deck.save(str(path))


def _parts(table: Table) -> Iterator[Table]:
    """Yield a table in parts that fit a slide; rows beyond the last part are counted in its note."""
    count = -(-len(table.rows) // _MOST_ROWS)
    shown = min(count, _MOST_SLIDES)
    for number in range(shown):
        rows = table.rows[number * _MOST_ROWS : (number + 1) * _MOST_ROWS]
        of = f" ({number + 1} of {shown})" if shown > 1 else ""
        left = len(table.rows) - shown * _MOST_ROWS
        more = f"{counted(left, 'row')} more on the page" if left > 0 and number == shown - 1 else ""
        note = "; ".join(text for text in (table.note, more) if text)
        yield replace(table, rows=rows, title=f"{table.title or 'Table'}{of}", note=note)


def _slide(deck: Any, title: str) -> Any:
    """Return a new slide with its title."""
    slide = deck.slides.add_slide(deck.slide_layouts[_BLANK])
    _text(slide, title, 0.4, size=24, is_bold=True)
    return slide


def _text(slide: Any, text: str, top: float, *, size: int, is_bold: bool = False, colour: str = INK) -> float:
    """Put a text on a slide, over its whole width; return where it ends [inch]."""
    from pptx.dml.color import RGBColor
    from pptx.util import Inches, Pt

    # characters of a line: six tenths of an em each, in any font
    a_line = int((WIDTH - 2 * _MARGIN) * 72 / (0.6 * size))
    lines = sum(max(1, -(-len(part) // a_line)) for part in text.splitlines() or [""])
    height = lines * size * 1.25 / 72 + 0.1
    box = slide.shapes.add_textbox(Inches(_MARGIN), Inches(top), Inches(WIDTH - 2 * _MARGIN), Inches(height))
    box.text_frame.word_wrap = True
    for number, part in enumerate(text.splitlines() or [""]):
        paragraph = box.text_frame.paragraphs[0] if number == 0 else box.text_frame.add_paragraph()
        run = paragraph.add_run()
        run.text = part
        run.font.size = Pt(size)
        run.font.bold = is_bold
        run.font.color.rgb = RGBColor.from_string(colour.removeprefix("#").upper())
    return top + height + 0.1


def _height(table: Table) -> float:
    """Return the height of a table [inch], its note included."""
    return _ROW * (len(table.rows) + 1) + (0.35 if table.note else 0.0)


def _table(slide: Any, table: Table, top: float) -> None:
    """Put a table on a slide: words to the left, numbers to the right."""
    from pptx.dml.color import RGBColor
    from pptx.enum.text import PP_ALIGN
    from pptx.util import Inches, Pt

    # columns as wide as their longest entries
    rows = [[cell_text(cell) for cell in row] for row in (table.head, *table.rows)]
    width = WIDTH - 2 * _MARGIN
    longest = [max(len(row[index]) for row in rows) + 2 for index in range(len(table.head))]
    height = Inches(_ROW * len(rows))
    frame = slide.shapes.add_table(len(rows), len(table.head), Inches(_MARGIN), Inches(top), Inches(width), height)
    size = Pt(12 if sum(longest) < 110 else 9)
    for index, count in enumerate(longest):
        frame.table.columns[index].width = Inches(width * count / sum(longest))
    # cells
    for number, row in enumerate(rows):
        frame.table.rows[number].height = Inches(_ROW)
        for index, entry in enumerate(row):
            cell = frame.table.cell(number, index)
            cell.margin_top = Inches(0.03)
            cell.margin_bottom = Inches(0.03)
            paragraph = cell.text_frame.paragraphs[0]
            paragraph.text = entry
            paragraph.alignment = PP_ALIGN.LEFT if index in table.words else PP_ALIGN.RIGHT
            paragraph.font.size = size
            if number == 0:
                cell.fill.solid()
                cell.fill.fore_color.rgb = RGBColor.from_string(ACCENT.removeprefix("#").upper())
    if table.note:
        _text(slide, table.note, top + _ROW * len(rows) + 0.05, size=11, colour=MUTED)


def _figure(slide: Any, chart: Chart) -> None:
    """Put a figure on a slide, as large as it may be, its caption below."""
    from pptx.util import Inches

    from gearrattle.report.plots.typeset import Style, matplotlib_figure
    from gearrattle.report.plots.typeset.print_files import saved

    figure = matplotlib_figure(chart, Style(width=_FIGURE_WIDTH, size=10.0))
    wide, high = (float(length) for length in figure.get_size_inches())
    room = HEIGHT - _TOP - 1.0
    scale = min((WIDTH - 2 * _MARGIN) / wide, room / high)
    picture = BytesIO(saved(figure, "png", dpi=_DPI))
    left = (WIDTH - scale * wide) / 2.0
    slide.shapes.add_picture(picture, Inches(left), Inches(_TOP), Inches(scale * wide), Inches(scale * high))
    _text(slide, chart.caption, HEIGHT - 0.9, size=11, colour=MUTED)
