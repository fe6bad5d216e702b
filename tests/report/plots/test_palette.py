"""Colours stay apart for everybody, and text stays legible."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from gearrattle.report.plots.palette import ACCENT, COAST, DRIVE, INK, MUTED, PAPER, REGIMES, tint
from gearrattle.report.plots.screening_figure import SHADES, UNSURE

# Protanopia and deuteranopia in linear RGB: G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, IEEE TVCG 15 (2009).
BLINDNESS = {
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "none": np.eye(3).tolist(),
}
# sRGB to CIE XYZ (D65), IEC 61966-2-1.
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def linear(colour: str) -> np.ndarray:
    rgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    x = (XYZ @ np.clip(rgb, 0.0, 1.0)) / np.array([0.9505, 1.0, 1.089])
    f = np.where(x > 216 / 24389, np.cbrt(x), (24389 / 27 * x + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(a: str, b: str) -> float:
    """WCAG 2 contrast ratio."""
    light, dark = sorted((float(XYZ[1] @ linear(c)) for c in (a, b)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("kind", BLINDNESS)
@pytest.mark.parametrize(("a", "b"), [(DRIVE, COAST), *combinations(REGIMES.values(), 2)])
def test_colours_that_carry_meaning_stay_apart(kind: str, a: str, b: str) -> None:
    seen = [lab(np.array(BLINDNESS[kind]) @ linear(colour)) for colour in (a, b)]
    assert np.linalg.norm(seen[0] - seen[1]) > 15.0


@pytest.mark.parametrize("kind", BLINDNESS)
@pytest.mark.parametrize(("a", "b"), [*combinations((*SHADES, UNSURE), 2)])
def test_shades_of_a_screening_stay_apart(kind: str, a: str, b: str) -> None:
    seen = [lab(np.array(BLINDNESS[kind]) @ linear(colour)) for colour in (a, b)]
    assert np.linalg.norm(seen[0] - seen[1]) > 10.0


@pytest.mark.parametrize("colour", [INK, MUTED, ACCENT, *REGIMES.values()])
def test_text_meets_wcag_aa(colour: str) -> None:
    assert contrast(colour, PAPER) >= 4.5


def test_tint() -> None:
    assert tint("#0072b2", 0.25) == "rgba(0,114,178,0.25)"
