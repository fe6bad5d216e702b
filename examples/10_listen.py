"""Two backlashes as sound, at one gain: which is louder, and by how much.

The path from the mesh to an ear is assumed (see the manual), so only the difference means something.
"""

import tempfile
from pathlib import Path

import numpy as np
from scipy.io import wavfile

import gearrattle as gr

model = gr.load(Path(__file__).resolve().parent / "paper" / "case3.toml")
narrow = model.with_({"mesh.gear.backlash": "0.05 mm"})
sound = gr.listen({name: gr.simulate(m, cycles=40, discard=10) for name, m in (("wide", model), ("narrow", narrow))})

difference = sound.levels["wide"] - sound.levels["narrow"]
print(f"0.1 mm against 0.05 mm of backlash: {difference:+.1f} dB")

with tempfile.TemporaryDirectory() as folder:
    sound.save(folder)
    one, other = (wavfile.read(Path(folder) / f"{name}.wav")[1].astype(float) for name in ("wide", "narrow"))
in_files = 10.0 * np.log10(np.mean(one**2) / np.mean(other**2))
print(f"in the files: {in_files:+.1f} dB, gain {sound.gain:.4g} of full scale per pascal for both")
assert abs(in_files - difference) < 1e-5
