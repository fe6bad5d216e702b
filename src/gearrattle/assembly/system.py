"""Assembly of the piecewise system of a model, with the names of its coordinates.

Elements are in the order of ``Model.elements``. An inertia with prescribed motion has no column; harmonics of its angle
are errors of the elements at this inertia. A drag torque is a mean torque of the opposite sign; a harmonic
a sin(order Omega t + phase) is split into its sine and cosine parts. Along a sweep of the speed, all harmonics are
signals.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from gearrattle.assembly.alternation_clock import alternating, clock_of, pairs_name
from gearrattle.assembly.drag_torques import drag_torques, viscous_drags
from gearrattle.assembly.elements import inertia_of, law_of, rows_of, system_inertia
from gearrattle.assembly.friction_sliders import Named, auxiliaries_of
from gearrattle.assembly.input_signals import signals_of
from gearrattle.assembly.means import mean_loads
from gearrattle.assembly.negligible_thresholds import negligible_of
from gearrattle.assembly.period import period_of
from gearrattle.assembly.prescribed_motion import columns_of, free_of, motion_errors
from gearrattle.assembly.ripple import load_ripples
from gearrattle.assembly.sideways import (
    bearing_names,
    bearing_rows,
    beside_directions,
    casing_rows,
    directions_of,
    mass_of,
)
from gearrattle.assembly.sines import ramp_of
from gearrattle.derived_values import kept
from gearrattle.engine.system.clock import Clock
from gearrattle.engine.system.piecewise import Harmonics, PiecewiseSystem
from gearrattle.model import GROUND, Harmonic, Model
from gearrattle.model.drag_points import reference_of
from gearrattle.model.over_speed import AtSpeed
from gearrattle.trajectory import Layout


@kept
def auxiliaries(model: Model) -> tuple[Named, ...]:
    """Auxiliaries of a model, for friction, clipped damping and alternating stiffness, in element order."""
    period = period_of(model).period
    auxiliaries = list[Named]()
    for k, element in enumerate(model.elements):
        auxiliaries += auxiliaries_of(k, element, law_of(element), period)
        if element.alternation is not None:
            auxiliaries.append(alternating(k, element, element.alternation, law_of(element)))
    return tuple(auxiliaries)


def _clock(model: Model) -> Clock | None:
    """Times at which the stiffness of meshes alternates."""
    names = [named.name for named in auxiliaries(model)]
    places = [(names.index(pairs_name(e)), e, e.alternation) for e in model.elements if e.alternation is not None]
    return clock_of(model, places)


@dataclass(frozen=True, eq=False)
class Driveline:
    """A model with its piecewise system, and the layout by which its trajectories are judged.

    The system is J q'' + D q' + W^T F = T, piecewise linear [SI, or the model's own dimensionless units].
    """

    model: Model
    system: PiecewiseSystem
    layout: Layout


@kept
def assemble(model: Model) -> Driveline:
    """Write the model as one piecewise-linear system, which is kept on the model."""
    system = _system(model)
    return Driveline(model, system, _layout(model, system))


def _system(model: Model) -> PiecewiseSystem:
    elements = model.elements
    names = [inertia.name for inertia in model.inertias]
    common = period_of(model)
    swept = model.excitation.sweep is not None
    size = len(names) + len(directions_of(model))
    count = len(elements)
    column = {} if swept else {order: j for j, order in enumerate(common.orders)}
    # sine and cosine parts of errors: transmission errors, then prescribed motions
    free = free_of(model)
    error = np.zeros((2, count, len(column)))
    for k, element in enumerate(elements):
        for harmonic in () if swept else element.errors:
            _add(error[:, k, column[harmonic.order]], harmonic)
    for k, factor, harmonic, _ in () if swept else motion_errors(model):
        _add(error[:, k, column[harmonic.order]], harmonic, factor)
    # sine and cosine parts of torques, and of joints on their driving shafts
    torque = np.zeros((2, size, len(column)))
    sources = [(table.on, table.harmonics) for table in model.torques]
    for on, harmonics in () if swept else (*sources, *load_ripples(model).items()):
        for harmonic in harmonics:
            _add(torque[:, names.index(on), column[harmonic.order]], harmonic)
    # system of the free inertias and of all directions
    columns = columns_of(model)
    mean = mean_loads(model)
    return PiecewiseSystem(
        inertia=system_inertia(model, free),
        drag=beside_directions(model, np.array(viscous_drags(model)))[columns],
        rows=rows_of(model)[:, columns],
        laws=tuple(law_of(element) for element in elements),
        inputs=Harmonics(common.period, common.cycles[: len(column)], mean[columns], *torque[:, columns], *error),
        auxiliaries=tuple(named.auxiliary for named in auxiliaries(model)),
        signals=signals_of(model),
        clock=_clock(model),
    )


def _add(sine_cosine: np.ndarray[tuple[int], np.dtype[np.float64]], harmonic: Harmonic, factor: float = 1.0) -> None:
    sine = harmonic.amplitude * cos(harmonic.phase)
    cosine = harmonic.amplitude * sin(harmonic.phase)
    sine_cosine += (factor * sine, factor * cosine)


def _layout(model: Model, system: PiecewiseSystem) -> Layout:
    elements = model.elements
    names = [inertia.name for inertia in model.inertias]
    rows = rows_of(model)
    # indices of bodies, and orders of the excitation
    clearances = list(system.clearances)
    index = {**{name: i for i, name in enumerate(names)}, GROUND: -1}
    common = period_of(model)
    drags = drag_torques(model)
    # names and constants of bodies, elements and clearances
    return Layout(
        inertia_names=tuple(names),
        inertia=inertia_of(model),
        drag_torque=np.array(drags),
        stiffness=np.array([law.stiffness.max() for law in system.laws]),
        element_names=tuple(element.name for element in elements),
        is_mesh=np.array([element.along_line for element in elements], dtype=np.bool_),
        between=np.array([[index[end] for end in e.between] for e in elements], dtype=np.int64).reshape(-1, 2),
        radii=np.array([e.radii for e in elements], dtype=float).reshape(-1, 2),
        rows=rows[:, : len(names)],
        clearance=np.array(clearances, dtype=np.int64),
        corners=tuple(system.laws[k].corners for k in clearances),
        region_of_first_piece=np.array([system.laws[k].first_label for k in clearances], dtype=np.int64),
        stiffness_of_piece=tuple(system.laws[k].stiffness for k in clearances),
        damping_of_piece=tuple(system.laws[k].damping for k in clearances),
        omega=model.excitation.omega,
        period=common.period,
        orders=common.orders,
        reference=reference_of(model),
        auxiliary_names=tuple(named.name for named in auxiliaries(model)),
        auxiliary_words=tuple(named.words for named in auxiliaries(model)),
        prescribed=tuple(names.index(motion.on) for motion in model.motions),
        ramp=ramp_of(model),
        drag_tables={
            i: (np.array(drag.speeds), np.array(drag.values))
            for i, drag in enumerate(drags)
            if isinstance(drag, AtSpeed)
        },
        negligible=negligible_of(model),
        component_paths=tuple(element.path for element in elements),
        direction_names=tuple(direction.name for direction in directions_of(model)),
        direction_mass=mass_of(model),
        direction_rows=rows[:, len(names) :],
        bearing_names=bearing_names(model),
        bearing_rows=bearing_rows(model),
        casing_rows=casing_rows(model),
    )
