"""States at the samples, worked out from the notes that the march makes of steps with samples in them.

A note stands for the samples of one step; a sample at the start of a period begins another note. The first sample of a
note is reached from the state at the step's start, every other from the one before it. As runs go on at starts of
periods, where one ends and the next goes on changes no bit of the samples.

It is a kernel of its own: code in the march's loop would be compiled again with every caller.
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
    """Note samples, the first of which lies ``ahead`` of a state and ``elapsed`` behind the entry of its region."""
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
    """Write the inputs at a sample: those of any period where all periods are alike, else computed."""
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
    """Store the samples that were noted, and forget the notes."""
    # room for the work
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
        # each note: the state before some samples of one region
        slot = notes.slot[n]
        fine = regions.fine[notes.slot[n]]
        chained = regions.chain, inputs.links, inputs.pace * inputs.steps[fine]
        for i in range(notes.samples[n]):
            # each sample: from the note, or on from the sample before
            h = spacing
            done = 0.0
            row = notes.row[n] + i
            if i == 0 or regions.chain > 0:  # a move within a finest step leaves chains behind
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
            # what is left, by the Taylor polynomial
            if h > done:
                part = (h - done) / inputs.steps[fine]
                move_within(regions.powers, slot, regions.width[slot], chained, part, y, carried, scratch)
            # back to the motion with the inputs: x = w + P u, and what is carried
            _inputs_of(inputs, samples, row, u)
            copy(y, longest, x)
            copy(carried, behind, totals)
            elapsed = notes.elapsed[n] + i * spacing
            leave(regions.particular, regions.drift, states, slot, u, elapsed, x, totals, scratch[0])
            # store it
            for j in range(samples.states.shape[1]):
                samples.states[row, j] = x[j] if j < states else totals[j - states]
            for k in range(samples.pieces.shape[1]):
                samples.pieces[row, k] = regions.piece[slot, k]
    counts[NOTED] = 0
