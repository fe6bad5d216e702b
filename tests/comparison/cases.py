"""The 1995 paper's cases, by name."""

from __future__ import annotations

from pathlib import Path

import gearrattle as gr

PAPER_CASES = Path(__file__).resolve().parents[2] / "examples" / "paper"


def case(name: str) -> gr.Model:
    """Load one."""
    return gr.load(PAPER_CASES / f"{name}.toml")
