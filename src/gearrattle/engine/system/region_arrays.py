"""The arrays in which a driveline's regions are built, with what all its regions share.

The work is done in ``kernels.region_stages``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import region_stages
from gearrattle.engine.kernels._jit import compact, is_compiling
from gearrattle.engine.kernels._llvm import lapack_address
from gearrattle.engine.kernels.march_arrays import DEEPEST, LONGEST, Regions, level_within
from gearrattle.engine.kernels.variant_arrays import Scales
from gearrattle.engine.kernels.variant_common import lay_out
from gearrattle.engine.kernels.workspace import (
    CHAIN_PACE,
    FAST,
    HORIZON,
    LARGEST,
    LARGEST_STATE,
    PERIOD,
    REASONS,
    Common,
    Sizes,
    Workspace,
    workspace_for,
)
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.plain_arrays import coefficients_of, frame_of, laws_of

Array = NDArray[np.float64]

FAST_MODES = 4.0  # times the highest input frequency: those beyond are bounded by their amplitude where they are small
_WIDEST_TURN = 0.5  # of an input over the finest step, radians


class RegionBuilder:
    """Builds a driveline's regions, one at a time.

    words: what kernels take for it, see ``kernels.memory_addresses``; with numba switched off the workspace itself.
    typical: size of the scaled states in an ordinary motion: what fills a clearance, and what the inputs make at most.
    """

    def __init__(self, flow: Flow) -> None:

        self._stages = region_stages.stages()
        self._zgees = lapack_address("zgees")
        self._work_out = compact(region_stages.work_out)
        self._pack = compact(region_stages.pack)
        self.workspace, words = workspace_for(_sizes(flow))
        self.words: Any = words if is_compiling() else self.workspace
        system = flow.system
        _write_limits(flow, self.workspace.common)
        if system.is_plain:
            frame = frame_of(system, flow.coordinates)
            scaling = flow.scaling
            scales = Scales(scaling.deflection, scaling.velocity, scaling.inputs, np.empty(len(system.clearances)))
            compact(lay_out)(self.words, coefficients_of(system), frame, scales)
        else:
            _lay_out(flow, self.workspace)
        self.typical = float(compact(region_stages.limit_states)(self._stages, self.words))
        if flow.chain.size:
            self._settle_chains(flow)

    @property
    def width(self) -> int:
        """Y, the length of y in the region worked out."""
        return int(self.workspace.free.width[0])

    @property
    def bounds(self) -> int:
        """J, the number of rows that bound its fourth derivatives."""
        return int(self.workspace.bounds.used[0])

    @property
    def fine(self) -> int:
        """Level of its finest step."""
        return int(self.workspace.free.fine[0])

    def work_out(self, pieces: Pieces) -> None:
        """Work a region out, up to its tables.

        FloatingPointError where its rates are not finite, or its eigenvalues are not found.
        """
        self.workspace.region.pieces[: len(pieces)] = pieces
        outcome = self._work_out(self._stages, self._zgees, self.words)
        if outcome in REASONS:
            raise FloatingPointError(f"the region {pieces} cannot be built: {REASONS[outcome]}")

    def pack(self, regions: Regions, slot: int, first: int) -> None:
        """Write it into a slot, its tables from ``first`` on."""
        self._pack(self._stages, self.words, regions, slot, first)

    def _settle_chains(self, flow: Flow) -> None:
        """Enlarge the size of an ordinary motion by the motion that signals make."""
        chains = self.workspace.region.matrix[:, flow.states + flow.inputs :]
        pushed = np.abs(chains).max(axis=0, initial=0.0) @ np.abs(flow.chains).max(axis=0)
        self.typical = max(self.typical, float(pushed))
        self.workspace.common.limits[LARGEST_STATE] = LARGEST * self.typical


def _sizes(flow: Flow) -> Sizes:
    """Sizes of the arrays of a flow."""
    system = flow.system
    coordinates = flow.coordinates
    return Sizes(
        elements=len(system.laws),
        inertias=system.size,
        deflections=len(coordinates.elements),
        states=flow.states,
        harmonics=flow.frequency.size,
        chain=flow.chain.size,
        references=len(coordinates.references),
        clearances=len(system.clearances),
        auxiliaries=len(system.auxiliaries),
        pieces=sum(law.pieces for law in system.laws) + sum(auxiliary.pieces for auxiliary in system.auxiliaries),
    )


def _write_limits(flow: Flow, common: Common) -> None:
    """Write which elements are clearances, and the limits that do not depend on an ordinary motion."""
    signals = flow.system.signals
    limits = common.limits
    common.clearances[:] = flow.system.clearances
    common.links[0] = 1 if signals is None else signals.degree + 1
    common.coarsest[0] = level_of_turns(flow.frequency)
    limits[PERIOD] = flow.system.inputs.period
    limits[FAST] = FAST_MODES * flow.frequency.max(initial=2 * np.pi)
    limits[CHAIN_PACE] = flow.pace_of_chains.max(initial=0.0)
    limits[HORIZON] = min(2.0 * LONGEST, float(np.diff(flow.knots).max()))


def _lay_out(flow: Flow, workspace: Workspace) -> None:
    """Write the arrays that all regions share, of a driveline with more than laws and harmonics."""
    system = flow.system
    scaling = flow.scaling
    period = flow.system.inputs.period
    common = workspace.common
    clearances = list(system.clearances)
    unit = 1.0 / flow.corner_scale[: len(clearances), None]
    common.motion[:] = period * scaling.deflection[:, None] * (flow.coordinates.basis @ flow.velocity)
    common.balance[:] = flow.torque - system.drag[:, None] * flow.velocity
    common.rows[:] = system.rows
    common.deflection[:] = flow.deflection
    common.rate[:] = flow.rate
    common.references[:] = period * flow.velocity[list(flow.coordinates.references)]
    common.seen[:] = np.vstack([flow.deflection[clearances] * unit, flow.rate[clearances] * unit * period])
    common.curvature[:] = flow.curvature_of_error[clearances]
    common.inertia[:] = system.inertia
    common.pace[:] = period * scaling.velocity
    common.corner_scale[:] = flow.corner_scale
    common.frequency[:] = flow.frequency
    common.amplitude[:] = scaling.inputs
    common.input_size[:] = flow.input_size
    common.cornered[:] = [np.any(system.laws[k].corners != 0.0) for k in clearances]
    for array, numbers in zip(workspace.laws, laws_of((*system.laws, *system.auxiliaries)), strict=True):
        array[:] = numbers
    workspace.laws.offset[:] *= 1.0 / scaling.inputs[0]
    _write_auxiliaries(flow, workspace)


def _write_auxiliaries(flow: Flow, workspace: Workspace) -> None:
    """Write the data of auxiliaries that are not in the laws."""
    system = flow.system
    auxiliaries = workspace.auxiliaries
    first = workspace.laws.first
    for c, auxiliary in enumerate(system.auxiliaries):
        own = slice(first[len(system.laws) + c], first[len(system.laws) + c + 1])
        auxiliaries.element[c] = auxiliary.element
        auxiliaries.state[c] = -1
        auxiliaries.by_memory[own] = auxiliary.memory
        auxiliaries.moves[own] = auxiliary.moves
        auxiliaries.by_deflection[own], auxiliaries.by_rate[own], auxiliaries.by_itself[own] = auxiliary.watched.T
    for i, c in enumerate(system.memories):
        auxiliaries.state[c] = flow.states - len(system.memories) + i
        auxiliaries.scale[c] = flow.memory[i]


def level_of_turns(frequency: Array) -> int:
    """Smallest level at which every input turns by less than ``_WIDEST_TURN``."""
    fastest = float(frequency.max(initial=0.0))
    return min(DEEPEST, level_within(_WIDEST_TURN / fastest)) if fastest > 0.0 else 0
