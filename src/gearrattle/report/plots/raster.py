"""Maps of numbers as one picture inside an SVG; rows of spectra are collected into equal cells.

A map of thousands of rows and bins has more cells than a page has pixels. A pixel shows the *largest* of the cells that
it covers, so that a line of one bin does not disappear. A pixel smaller than a cell shows the value of this cell. The
picture is a PNG with 256 shades.
"""

from __future__ import annotations

import struct
import zlib
from base64 import b64encode

import numpy as np

from gearrattle.report.plots.chart import Heat
from gearrattle.report.plots.palette import shade
from gearrattle.report.plots.svg_axes import Axis
from gearrattle.trajectory import Array

_SHADES = 255


def raster(heat: Heat, x: Axis, y: Axis) -> str:
    """Return an image element that fills the map's place."""
    (left, right) = x.at(np.array(heat.x_range)).tolist()
    (bottom, top) = y.at(np.array(heat.y_range)).tolist()
    address = "data:image/png;base64," + b64encode(_png(heat)).decode("ascii")
    geometry = f'x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}" height="{bottom - top:.1f}"'
    return f'<image {geometry} preserveAspectRatio="none" image-rendering="pixelated" href="{address}"/>'


def _png(heat: Heat) -> bytes:
    """Return a picture with one point a cell, the first row lowest; shade 0 is transparent.

    Format: W3C, "Portable Network Graphics (PNG) Specification (Third Edition)", 2025: 8 bits a point, colours from a
    palette, rows without a filter.
    """
    # shade of every cell
    with np.errstate(invalid="ignore"):
        share = np.clip((heat.values - heat.low) / (heat.high - heat.low), 0.0, 1.0)
        codes = np.where(np.isfinite(heat.values), 1.0 + np.rint(share * (_SHADES - 1)), 0.0).astype(np.uint8)
    # chunks of the file: header, palette, transparency of shade 0, points
    height, width = codes.shape
    colours = ["#ffffff", *(shade(k / (_SHADES - 1)) for k in range(_SHADES))]
    rows = np.pad(codes[::-1], ((0, 0), (1, 0)))  # each row begins with its filter, 0
    chunks = {
        b"IHDR": struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0),
        b"PLTE": bytes.fromhex("".join(colour[1:] for colour in colours)),
        b"tRNS": b"\0",
        b"IDAT": zlib.compress(rows.tobytes(), 9),
        b"IEND": b"",
    }
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(name, content) for name, content in chunks.items())


def _chunk(name: bytes, content: bytes) -> bytes:
    """Return a chunk of a PNG file: length, name, content, checksum."""
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def largest_along(values: Array, places: Array, edges: Array) -> Array:
    """Gather rows of values into equal cells by where they are, keeping the largest.

    Parameters
    ----------
    values
        (n, m).
    places
        (n,) ascending.
    edges
        (c + 1,) ascending, equally far apart.

    Returns
    -------
    Array
        (c, m); a cell without a row has the values of the row nearest to its middle, if the distance is at most half
        the larger gap between this row and its neighbours; otherwise NaN.
    """
    cell = np.clip(np.searchsorted(edges, places, side="right") - 1, 0, edges.size - 2)
    inside = (places >= edges[0]) & (places <= edges[-1])
    largest = np.full((edges.size - 1, values.shape[1]), -np.inf)
    np.maximum.at(largest, cell[inside], np.where(np.isnan(values), -np.inf, values)[inside])
    middle = 0.5 * (edges[1:] + edges[:-1])
    after = np.clip(np.searchsorted(places, middle), 1, max(places.size - 1, 1))
    before = after - 1
    after = np.minimum(after, places.size - 1)
    nearest = np.where(np.abs(places[after] - middle) < np.abs(middle - places[before]), after, before)
    empty = ~np.isin(np.arange(edges.size - 1), cell[inside])
    gaps = np.diff(places) if places.size > 1 else np.full(1, edges[-1] - edges[0])
    reach = 0.5 * np.maximum(np.append(gaps, gaps[-1]), np.insert(gaps, 0, gaps[0]))[: places.size]
    near = empty & (np.abs(places[nearest] - middle) <= reach[nearest] * (1.0 + 1e-9))
    largest[near] = values[nearest[near]]
    return np.where(np.isfinite(largest), largest, np.nan)
