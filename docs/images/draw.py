"""Draw the picture of the README and the manual's first page: the rattling mesh of case 3 inside its backlash.

Text stays text and the curve is thinned to what can be seen, so the SVG stays small. ``make images`` runs this.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

import gearrattle as gr

HERE = Path(__file__).resolve().parent
FIRST, LAST, DISCARD = 40, 43, 20
INK, ACCENT, QUIET = "#23303b", "#c2410c", "#64748b"


def main() -> None:
    """Simulate case 3 and write case3.svg."""
    model = gr.load(HERE.parents[1] / "examples" / "paper" / "case3.toml")
    run = gr.simulate(model, cycles=60, discard=DISCARD)
    period, half_gap = run.data.attrs["period"], model.meshes[0].backlash / 2
    gear = run.data.sel(clearance="gear")
    cycles = gear.time.to_numpy() / period
    shown = (cycles >= FIRST) & (cycles <= LAST)
    events = run.events[run.events.clearance == "gear"]
    hits = events[(events.from_region == 0) & events.time.between(FIRST * period, LAST * period)]
    part = next(part for part in gr.criteria(run).parts if part.name == "gear")

    mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "gearrattle", "font.family": "sans-serif"})
    mpl.rcParams.update({"text.color": INK, "axes.labelcolor": INK, "xtick.color": QUIET, "ytick.color": QUIET})
    figure, axes = plt.subplots(figsize=(9, 3.4), layout="constrained")
    axes.axhspan(-1, 1, color="#f1f5f9", lw=0)
    for side, name in ((1, "drive flank"), (-1, "coast flank")):
        axes.axhline(side, color=QUIET, lw=0.8)
        axes.text(FIRST + 0.02, 1.17 * side, name, va="center", color=QUIET, fontsize=9)
    axes.plot(cycles[shown], gear.deflection.to_numpy()[shown] / half_gap, color=INK, lw=1.0)
    speed = np.abs(hits.velocity.to_numpy())
    axes.scatter(
        hits.time / period, np.sign(hits.to_region), s=10 + 60 * speed / speed.max(), color=ACCENT, lw=0, zorder=3
    )
    axes.set(xlim=(FIRST, LAST), ylim=(-1.35, 1.35), xlabel="cycles", ylabel="mesh deflection / half backlash")
    axes.set_xticks(range(FIRST, LAST + 1))
    axes.spines[["top", "right"]].set_visible(False)
    title = f"Loose gear of case 3: {part.regime} rattle, {part.impacts_per_cycle:.0f} impacts per cycle"
    axes.set_title(title, loc="left", fontsize=12, fontweight="bold")
    figure.savefig(HERE / "case3.svg", metadata={"Date": None, "Creator": None})


if __name__ == "__main__":
    main()
