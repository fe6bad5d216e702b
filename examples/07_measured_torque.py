"""A rig's record drives a model: pulses of a toothed wheel and a torque in volts, through a mapping.

The record is made here, so that what is read can be checked: a shaft at 1500 rpm with an order 2 of 2 % on it seen by a
wheel of 60 teeth, and 20 N m a volt. The driveline is the paper's, its flywheel driven by what was measured.
"""

import tempfile
from pathlib import Path

import numpy as np
from scipy.io import savemat

import gearrattle as gr

folder = Path(tempfile.mkdtemp())

t = np.arange(0.0, 2.0, 1.0 / 51_200.0)
turn = 2.0 * np.pi * 25.0 * t
angle = turn + 0.01 * np.sin(2.0 * turn)
savemat(folder / "rig.mat", {"t": t, "wheel": 2.5 + 2.5 * np.sin(60.0 * angle), "U": 0.5 + 0.2 * np.sin(2.0 * turn)})

(folder / "measurement.toml").write_text("""
schema = 1
file = "rig.mat"
rate = "4 kHz"

[[channel]]
name = "n_engine"
source = "wheel"
quantity = "velocity"
measured = "pulses"
of = "flywheel"
tacho = { pulses_per_turn = 60, threshold = 2.5, hysteresis = 1.0 }
filter = { kind = "lowpass", cutoff = "300 Hz", order = 4 }

[[channel]]
name = "T_shaft"
source = "U"
quantity = "torque"
of = "flywheel"
unit = "N*m"
scale = 20.0
""")

record = gr.read(folder / "measurement.toml")
for note in record.notes:
    print(note)
speed = record["n_engine"].values
swing = np.ptp(speed[400:-400]) / 2.0
print(f"mean {speed.mean() * 30.0 / np.pi:.2f} rpm, order 2 {swing:.4f} rad/s of {0.02 * 50.0 * np.pi:.4f} rad/s")
assert abs(swing / (0.02 * 50.0 * np.pi) - 1.0) < 5e-3

gr.write(record, folder / "record.h5")
model = gr.example("case3")
driven = gr.measured.drive(model, gr.read(folder / "record.h5"), "n_engine")
print(gr.criteria(gr.simulate(driven, cycles=20, discard=10)).verdict)
