"""States at the samples, computed from the notes that the march makes of steps with samples in them.

A *note* holds the state at the start of a step, and the samples in that step; a sample at the start of a period begins
a new note. The state at the first sample of a note is computed from the state at the start of the step, the state at
every other sample from the sample before. A run is continued at the start of a period: so its end changes no bit of the
samples.

This is a separate kernel, because code in the loop of the march would be compiled again with every caller.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels._jit import inlined, kernel
from gearrattle.engine.kernels.march_arrays import NOTED
from gearrattle.engine.kernels.oscillators import inputs_at, shift_chains
from gearrattle.engine.kernels.strip_products import copy
from gearrattle.engine.kernels.taylor_window import advance, leave, move_within, window_scratch


@inlined
def note(notes, counts, rows, slot, y, carried, ahead, elapsed):
    """Write a note of samples; the first is ``ahead`` after the state, ``elapsed`` after the entry into the region."""
    n = counts[NOTED]
    for i in range(y.size):
        notes.y[n, i] = y[i]
    for i in range(carried.size):
        notes.carried[n, i] = carried[i]
    notes.row[n], notes.samples[n] = rows
    notes.slot[n] = slot
    notes.ahead[n] = ahead
    notes.elapsed[n] = elapsed
    counts[NOTED] = n + 1


@inlined
def _inputs_of(inputs, samples, row, u):
    """Write the inputs at a sample: from the table of one period if all periods are equal, else computed."""
    whole = (samples.first + row) // samples.per_cycle
    part = samples.first + row - whole * samples.per_cycle
    if samples.waves.shape[0] == 0:
        inputs_at(inputs, whole, part / samples.per_cycle, u)
        return
    count = inputs.frequency.size
    u[0] = inputs.scale[0]
    for j in range(count):
        u[1 + j] = inputs.scale[1 + j] * samples.waves[part, 1 + j]
        u[1 + count + j] = inputs.scale[1 + j] * samples.waves[part, 1 + count + j]


@inlined
def _take(rows, n, out):
    """out = rows[n]."""
    for i in range(out.size):
        out[i] = rows[n, i]


@kernel
def store_noted_samples(regions, inputs, notes, samples, counts):
    """Compute and store the samples that were noted, and delete the notes."""
    # scratch
    longest = notes.y.shape[1]
    behind = notes.carried.shape[1]
    states = regions.states
    spacing = 1.0 / samples.per_cycle
    y = np.zeros(longest)
    carried = np.zeros(behind)
    u = np.zeros(1 + 2 * inputs.frequency.size)
    x = np.zeros(longest)
    totals = np.zeros(behind)
    scratch = window_scratch(behind, longest)
    for n in range(counts[NOTED]):
        # each note: samples in one region
        slot = notes.slot[n]
        fine = regions.fine[notes.slot[n]]
        chained = regions.chain, inputs.links, inputs.pace * inputs.steps[fine]
        for i in range(notes.samples[n]):
            # each sample: from the state in the note, or from the sample before
            h = spacing
            done = 0.0
            row = notes.row[n] + i
            if i == 0 or regions.chain > 0:  # ``move_within`` does not move chains
                h = notes.ahead[n] + i * spacing
                _take(notes.y, n, y)
                _take(notes.carried, n, carried)
            # dyadic steps, the longest first
            for level in range(fine + 1):
                while h - done >= inputs.steps[level]:
                    index = regions.first_table[slot] + level
                    advance(regions.tables, index, regions.width[slot], regions.chain, y, carried, scratch[0])
                    moved = inputs.pace * inputs.steps[level]
                    shift_chains(y, regions.width[slot] - regions.chain, regions.chain, inputs.links, moved)
                    done += inputs.steps[level]
            # the remainder, by the Taylor polynomial
            if h > done:
                part = (h - done) / inputs.steps[fine]
                move_within(regions.powers, slot, regions.width[slot], chained, part, y, carried, scratch)
            # add the particular solution: x = w + P u, and the carried quantities
            _inputs_of(inputs, samples, row, u)
            copy(y, longest, x)
            copy(carried, behind, totals)
            elapsed = notes.elapsed[n] + i * spacing
            leave(regions.particular, regions.drift, states, slot, u, elapsed, x, totals, scratch[0])
            # store the sample
            for j in range(samples.states.shape[1]):
                samples.states[row, j] = x[j] if j < states else totals[j - states]
            for k in range(samples.pieces.shape[1]):
                samples.pieces[row, k] = regions.piece[slot, k]
    counts[NOTED] = 0
