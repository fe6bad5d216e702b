"""Motions that repeat: those that coexist at one frequency, and the jumps between them.

In contact the backlash oscillator is linear, so its flanks first part at the frequency w where the swing of the linear
motion is the static deflection F = 0.1,

    0.05 w^2 / sqrt((1 - w^2)^2 + (0.1 w)^2) = 0.1,   (1 - w^2)^2 + 0.01 w^2 = w^4 / 4,

a quadratic equation for w^2: the grazing that is located along the branch.
"""

from pathlib import Path

import numpy as np

import gearrattle as gr

model = gr.load(Path(__file__).parent / "backlash_oscillator.toml")

for number, orbit in enumerate(gr.periodic(model, every=True), 1):
    swing = float(np.ptp(orbit.run.trajectory.deflection))
    stability = "stable" if orbit.stable else "unstable"
    print(f"motion {number}: {stability:8}  swing {swing:.4f}  largest multiplier {abs(orbit.multipliers[0]):.4f}")

branch = gr.continuation(model, "excitation.speed", (0.3, 1.6))
print(branch.sentence)
print(branch.events.drop(columns=["branch", "point"]).to_string(index=False))

expected = np.sqrt(np.roots([0.75, -1.99, 1.0]).real)
grazings = branch.events.loc[branch.events["kind"] == "grazing", "value"].to_numpy()
print(f"grazings differ from the closed form by {np.abs(np.sort(grazings) - np.sort(expected)).max():.1e}")
assert np.allclose(np.sort(grazings), np.sort(expected), rtol=0.0, atol=1e-11)
