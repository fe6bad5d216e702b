"""The few colours of every figure, and what each one means.

One accent for ordinary lines, one colour for each side of a clearance, grey for what is context. The two sides are the
blue and the vermilion of M. Okabe and K. Ito, "Color Universal Design" (2008), chosen so that the common forms of
colour blindness can tell them apart; they also differ in lightness, so they survive a black-and-white printer.

Takes nothing; every figure and the report's style sheet take from here.
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

REGIMES = {"quiet": MUTED, "single-sided": "#a35f00", "double-sided": "#a8123e"}
"""Colour of each regime: slate, amber, crimson; ever darker, always beside its word."""


def tint(colour: str, opacity: float) -> str:
    """Return a colour ``"#rrggbb"`` as a CSS ``rgba`` of the given opacity between 0 and 1."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity:g})"
