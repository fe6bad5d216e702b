"""Rattle metrics of a run and of a recording of it, and a screening beside the exact motions.

A recording holds what sensors could see: no log of crossings. What can be measured of both comes out alike; the rest is
told. The screening then maps, without simulating, from which load on the loose gears leave their flanks.
"""

from pathlib import Path

import gearrattle as gr
from gearrattle.quantities import recording_of

model = gr.load(Path(__file__).parent / "manual_transmission.toml")
smooth = {f"mesh.{mesh.name}.transmission_error": None for mesh in model.meshes}

run = gr.simulate(model, cycles=60, discard=30)
table = gr.metrics(run, base_level=45.0, kappa=300.0)
values = table.set_index(["quantity", "subject"]).value
for quantity in ("separation margin", "mean impact intensity", "rattle level", "double-sided impacts per cycle"):
    for subject, value in values[quantity].items():
        print(f"{quantity:32}  {subject:12}  {value:8.3f}")

recorded = gr.metrics(recording_of(run.trajectory), model)
for note in recorded[recorded.subject == ""].note:
    print("of the recording:", note)
sampled = recorded[recorded.quantity == "separation ratio"].set_index(["quantity", "subject"]).value
share = sampled / values[sampled.index]
print(f"separation ratios of the recording: {share.min():.3f} to {share.max():.3f} of those of the exact motion")
assert ((share > 0.7) & (share <= 1.0)).all()  # samples miss the peaks, and say no more than the motion

settled = {"simulation.cycles": 60, "simulation.discard": 40, **smooth}
screening = gr.screen(model.with_(settled), ["600 rpm", "1200 rpm", "2400 rpm"], [0.25, 1.0, 4.0], simulate=True)
print("speed [rpm]  load  lift ratio  regime of the second gear")
words = screening.regime.attrs["flag_meanings"].split()
for speed in screening.speed.values:
    for load in screening["load"].values:
        case = screening.sel(speed=speed, load=load, gear="second_mesh")
        print(f"{speed * 9.5493:11.0f}  {load:4.2f}  {float(case.lift_ratio):10.2f}  {words[int(case.regime)]}")
assert ((screening.lift_ratio > 1.0) == (screening.regime > 0)).all()
