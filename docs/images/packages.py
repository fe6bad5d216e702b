"""Draw how the packages import each other: layers from pyproject.toml, arrows from the import statements of the source.

An arrow that others imply (a imports b, b imports c, a imports c) is left out. ``make images`` writes packages.svg.
"""

from __future__ import annotations

import ast
import tomllib
from itertools import product
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SOURCE = ROOT / "src" / "gearrattle"
WIDTH, ROW, BOX = 940, 66, 30
WORDS, LINE, FILL, PALE = "#17212b", "#64748b", "#e9eef3", "#f6f8fa"


def layers() -> list[list[str]]:
    """Return the packages of every layer, the highest first."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    rows = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    return [[name.strip() for name in row.split("|")] for row in rows]


def imports() -> set[tuple[str, str]]:
    """Return the pairs of packages of which the first imports the second, types for annotations apart."""
    pairs = set()
    for path in SOURCE.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        own = path.relative_to(SOURCE).parts[0].removesuffix(".py")
        blocks = [
            node for node in ast.walk(tree) if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
        ]
        for_types = {id(node) for block in blocks for node in ast.walk(block)}
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and id(node) not in for_types:
                parts = (node.module or "").split(".")
                if parts[0] == "gearrattle" and len(parts) > 1 and parts[1] != own:
                    pairs.add((own, parts[1]))
    return pairs


def reduced(pairs: set[tuple[str, str]]) -> set[tuple[str, str]]:
    """Return the pairs that no chain of others implies."""
    names = {name for pair in pairs for name in pair}
    reach = set(pairs)
    for middle, first, last in product(sorted(names), sorted(names), sorted(names)):
        if (first, middle) in reach and (middle, last) in reach:
            reach.add((first, last))
    return {(a, b) for a, b in pairs if not any((a, c) in reach and (c, b) in reach for c in names - {a, b})}


def drawing() -> str:
    """Return the SVG."""
    rows = layers()
    upper, lowest = rows[:-3], [name for row in rows[-3:] for name in row]
    middles: dict[str, tuple[float, float]] = {}
    boxes = []
    for i, row in enumerate(upper):
        widths = [8.2 * len(name) + 22 for name in row]
        left = 0.5 * (WIDTH - sum(widths) - 26 * (len(row) - 1))
        for name, width in zip(row, widths, strict=True):
            top = 10 + i * ROW
            middles[name] = (left + 0.5 * width, top)
            boxes.append(
                f'<rect x="{left:.1f}" y="{top}" width="{width:.1f}" height="{BOX}" rx="5" fill="{FILL}" '
                f'stroke="{LINE}"/>'
                f'<text x="{left + 0.5 * width:.1f}" y="{top + 20}">{name}</text>'
            )
            left += width + 26
    height = 10 + len(upper) * ROW + 62
    words = f"below all: {', '.join(sorted(lowest))}"
    cut = words.rfind(" ", 0, len(words) // 2 + 8)
    foot = height - 56
    boxes.append(f'<rect x="10" y="{foot}" width="{WIDTH - 20}" height="48" rx="5" fill="{PALE}" stroke="{LINE}"/>')
    boxes += [
        f'<text x="{WIDTH / 2}" y="{foot + 20 + 18 * i}" font-size="13">{part.strip()}</text>'
        for i, part in enumerate((words[:cut], words[cut:]))
    ]
    arrows = []
    for a, b in sorted(reduced({(a, b) for a, b in imports() if a in middles and b in middles})):
        (x, y), (u, v) = middles[a], middles[b]
        y += BOX
        bend = 0.5 * (v - y)
        arrows.append(
            f'<path d="M{x:.1f} {y} C{x:.1f} {y + bend:.1f} {u:.1f} {v - bend:.1f} {u:.1f} {v - 5}" '
            'marker-end="url(#end)"/>'
        )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" '
        f'font-size="14" fill="{WORDS}" text-anchor="middle" role="img" '
        'aria-label="Packages of gearrattle in layers, and what imports what">'
        '<defs><marker id="end" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="6" markerHeight="6" orient="auto">'
        f'<path d="M0 0 L8 4 L0 8 z" fill="{LINE}"/></marker></defs>'
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>'
        f'<g fill="none" stroke="{LINE}" stroke-width="1.1">{"".join(arrows)}</g>{"".join(boxes)}</svg>\n'
    )


if __name__ == "__main__":
    (HERE / "packages.svg").write_text(drawing(), encoding="utf-8")
