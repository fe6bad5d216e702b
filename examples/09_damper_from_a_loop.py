"""From a damper's torque-angle loop to a model: stages and friction, with standard errors.

The file is a slow loop of the damper of clutch_friction.toml, sampled with noise; so the answer is known.
"""

from pathlib import Path

import numpy as np

import gearrattle as gr

here = Path(__file__).resolve().parent
fit = gr.identification.fit_loop(here / "measured" / "damper_loop.csv", name="damper", between=("flywheel", "hub"))
print(fit.report)

model = gr.load(here / "clutch_friction.toml")
truth = next(c for c in model.couplings if c.name == "damper")
for fitted_stage, stage in zip(fit.stages, truth.stages, strict=True):
    print(f"{fitted_stage.stiffness:8.1f} N m/rad for {stage.stiffness:8.1f}", end=", ")
    print(f"loop {fitted_stage.hysteresis:5.2f} N m for {stage.hysteresis:5.2f}")

error = abs(fit.stages[1].stiffness / truth.stages[1].stiffness - 1.0)
print(f"slope of the driving stage off by {error:.2%}")
assert error < 0.03
assert abs(np.degrees(fit.stages[0].until) - 4.0) < 0.1

# Its own loop, as a run will use it, over what was measured.
loop = fit.drawn()
print(f"{loop.loss:.1f} J a cycle; residual {fit.residual / fit.full_scale:.2%} of full scale")
