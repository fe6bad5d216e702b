"""States at the samples. The march only notes what it passes them with; here the notes are worked out.

Kept out of the march's loop, for what is written into that loop is compiled once more with every caller.
"""

from __future__ import annotations

import numpy as np

from gearrattle.kernels._jit import inlined, kernel
from gearrattle.kernels.oscillators import inputs_at
from gearrattle.kernels.packed import NOTED
from gearrattle.kernels.window import advance, leave, move_within


@inlined
def note(notes, counts, row, slot, y, carried, ahead, elapsed):
    """Note a sample that lies ``ahead`` of a state and ``elapsed`` behind the entry of its region."""
    n = counts[NOTED]
    for i in range(y.size):
        notes.y[n, i] = y[i]
    for i in range(carried.size):
        notes.carried[n, i] = carried[i]
    notes.row[n], notes.slot[n], notes.ahead[n], notes.elapsed[n] = row, slot, ahead, elapsed
    counts[NOTED] = n + 1


@inlined
def _inputs_of(inputs, samples, row, u):
    """Write the inputs at a sample: turned to in every period alike, or worked out."""
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


@kernel
def work_out(regions, inputs, notes, samples, counts):
    """Store the samples that were noted, and forget the notes."""
    longest, behind, states = notes.y.shape[1], notes.carried.shape[1], regions.states
    y, carried, u = np.zeros(longest), np.zeros(behind), np.zeros(1 + 2 * inputs.frequency.size)
    out, terms, total = np.zeros(behind + longest), np.zeros(3 * (behind + longest)), np.zeros(longest)
    for n in range(counts[NOTED]):
        row, slot, h = notes.row[n], notes.slot[n], notes.ahead[n]
        for i in range(y.size):
            y[i] = notes.y[n, i]
        for i in range(carried.size):
            carried[i] = notes.carried[n, i]
        width, done, fine = regions.width[slot], 0.0, regions.fine[slot]
        for level in range(fine + 1):
            length = inputs.steps[level]
            while h - done >= length:
                advance(regions.tables, regions.first_table[slot] + level, width, 0, y, carried, out)
                done += length
        if h > done:
            x = (h - done) / inputs.steps[fine]
            chained = regions.chain, inputs.links, inputs.pace * inputs.steps[fine]
            move_within(regions.powers, slot, width, chained, x, y, carried, out, terms, total)
        _inputs_of(inputs, samples, row, u)
        leave(regions.particular, regions.drift, states, slot, u, notes.elapsed[n], y, carried, out)
        for j in range(samples.states.shape[1]):
            samples.states[row, j] = y[j] if j < states else carried[j - states]
        for k in range(samples.pieces.shape[1]):
            samples.pieces[row, k] = regions.piece[slot, k]
    counts[NOTED] = 0
