"""gearrattle's own ``exact`` through its public call: model assembly, equilibrium, event log and all."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

import gearrattle as gr
from benchmarks.peers.base import Outcome, Peer, Prepared
from benchmarks.peers.plant import Plant, half_gaps, load
from gearrattle.assembly import assemble


def build(plant: Plant) -> Prepared:
    """Make a case ready. Whole cycles take one sample a cycle; a fraction p/q of one is sampled q times a cycle."""
    model = load(plant.name)
    gap = half_gaps(assemble(model).system)[list(plant.clearances)]

    def run(cycles: float | Fraction) -> Outcome:
        end = Fraction(cycles)
        whole, samples = -(-end.numerator // end.denominator), end.denominator
        done = gr.simulate(
            model, "exact", cycles=whole, discard=0, samples_per_cycle=samples, initial="static", audit=False
        )
        motion = done.trajectory  # arrays; the tables of `data` and `events` are made only when asked for
        until = motion.time[end.numerator]
        return Outcome(motion.deflection[end.numerator] / gap, int(np.sum(motion.events.time <= until)))

    return Prepared(run)


EXACT = Peer("exact", "gearrattle", "this package, `gr.simulate(model)`", (("default", {}),), build)
