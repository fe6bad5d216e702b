"""The few colours of all figures and of the report's style sheet, and their meaning.

There is one accent for ordinary lines, one colour for every side of a clearance, and grey for context. The two sides
have the blue and the vermilion of M. Okabe and K. Ito, "Color Universal Design" (2008), which people with the common
forms of colour blindness can distinguish; their lightness differs too, for black-and-white printers.
"""

from __future__ import annotations

INK = "#17212b"
"""Text and axes."""
MUTED = "#5d6b7a"
"""Secondary text, tick labels."""
FAINT = "#dfe4ea"
"""Grid lines and rules."""
PAPER = "#ffffff"
"""Background."""
ACCENT = "#0b5c8f"
"""The one accent: ordinary lines, links, bars without a side."""
DRIVE = "#0072b2"
"""Drive side of a clearance (delta > 0), Okabe-Ito blue."""
COAST = "#d55e00"
"""Coast side of a clearance (delta < 0), Okabe-Ito vermilion."""
CENTRE = "#9aa5b1"
"""The centre of a clearance: inside the gap or the first stage."""

NO_VALUE = "#6f7a86"
"""Cells of a map without a value: hatching of this colour on the background, never an area of it."""

REGIMES = {"quiet": MUTED, "single-sided": "#a35f00", "double-sided": "#a8123e"}
"""Colour of each regime: slate, amber, crimson; ever darker, always shown with its word."""
STATES = {
    "quiet": MUTED,
    "touches": "#a35f00",
    "single-sided": "#a35f00",
    "double-sided": "#a8123e",
    "rattles": "#a8123e",
}
"""Colours of regimes and severities, the mildest first; both are never shown together."""

COLOURS = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#e69f00",
    "#56b4e9",
    "#8c6bb1",
    "#7a5c3e",
    "#a6761d",
    "#666666",
    "#c51b7d",
    "#1b7837",
)
"""Colours of curves: six of M. Okabe and K. Ito (2008), then others for long legends."""

SHADES = (
    "#00224e",
    "#123570",
    "#3b496c",
    "#575d6d",
    "#707173",
    "#8a8678",
    "#a59c74",
    "#c3b369",
    "#e1cc55",
    "#fee838",
)
"""Equal steps of a map from its lowest to its highest number: cividis, whose lightness rises evenly for every form of
colour vision (J. R. Nunez, C. R. Anderton, R. S. Renslow 2018, PLoS ONE 13, e0199239)."""


def shade(share: float) -> str:
    """Return the colour of a share from 0 to 1 of a map's range, straight between ``SHADES``."""
    position = min(max(share, 0.0), 1.0) * (len(SHADES) - 1)
    first = min(int(position), len(SHADES) - 2)
    part = position - first
    pairs = ((int(SHADES[first][k : k + 2], 16), int(SHADES[first + 1][k : k + 2], 16)) for k in (1, 3, 5))
    return "#" + "".join(f"{round(a + part * (b - a)):02x}" for a, b in pairs)


def tint(colour: str, opacity: float) -> str:
    """Return a colour ``"#rrggbb"`` as a CSS ``rgba`` of the given opacity between 0 and 1."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity:g})"
