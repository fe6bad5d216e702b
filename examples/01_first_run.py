"""A model file, a run, a verdict: the four-inertia transmission of case 3 with a loose output gear.

The loose-gear test foretells the rattle from the driver's acceleration alone; the impacts confirm it.
"""

from pathlib import Path

import gearrattle as gr

model = gr.load(Path(__file__).parent / "paper" / "case3.toml")
run = gr.simulate(model, cycles=40, discard=20)
verdict = gr.criteria(run)

print(verdict)
for part in verdict.parts:
    print(f"{part.name:10} {part.regime:13} {part.impacts_per_cycle:7.2f} impacts per cycle")

gear = next(part for part in verdict.parts if part.name == "gear")
assert verdict.verdict == "double-sided"
assert gear.margin_db is not None
assert gear.margin_db > 0  # the drag cannot hold the gear against its flank
