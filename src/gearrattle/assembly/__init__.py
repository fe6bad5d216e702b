"""Assembly of a model into a ``Driveline``: its piecewise-linear system and the layout of its trajectories."""

from gearrattle.assembly.deflections import deflection, deflection_acceleration, deflection_rate
from gearrattle.assembly.drag_notes import drag_notes
from gearrattle.assembly.drive_torque import drive_torque
from gearrattle.assembly.elements import component_notes, decay_notes, inertia_of, rows_of
from gearrattle.assembly.friction_sliders import left_out
from gearrattle.assembly.input_histories import record_notes, records_of
from gearrattle.assembly.input_signals import check_length, default_cycles, lasts_as_the_run, signals_of
from gearrattle.assembly.lumped import lumped_model, moving_sideways, must_keep_bodies, must_stay_level
from gearrattle.assembly.means import balancing_means, own_mean
from gearrattle.assembly.negligible_thresholds import negligible_of
from gearrattle.assembly.period import CommonPeriod, common_period, period_of
from gearrattle.assembly.prescribed_motion import (
    carried_along,
    coordinate_names,
    coordinates_of,
    free_names,
    free_of,
    motion_amplitudes,
    prescribed_angles,
    prescribed_indices,
    whole_trajectory,
    with_prescribed,
)
from gearrattle.assembly.sideways import directions_of
from gearrattle.assembly.sines import ramp_of
from gearrattle.assembly.start_tables import StartTable, coordinates_at_start, start_at, start_table
from gearrattle.assembly.steady import (
    is_driven_over_time,
    refuse_but_events,
    refuse_motions,
    refuse_recorded_motions,
    refuse_unsteady,
    steady,
    unsteady_inputs,
    unsteady_problems,
)
from gearrattle.assembly.system import Driveline, assemble

__all__ = [
    "CommonPeriod",
    "Driveline",
    "StartTable",
    "assemble",
    "balancing_means",
    "carried_along",
    "check_length",
    "common_period",
    "component_notes",
    "coordinate_names",
    "coordinates_at_start",
    "coordinates_of",
    "decay_notes",
    "default_cycles",
    "deflection",
    "deflection_acceleration",
    "deflection_rate",
    "directions_of",
    "drag_notes",
    "drive_torque",
    "free_names",
    "free_of",
    "inertia_of",
    "is_driven_over_time",
    "lasts_as_the_run",
    "left_out",
    "lumped_model",
    "motion_amplitudes",
    "moving_sideways",
    "must_keep_bodies",
    "must_stay_level",
    "negligible_of",
    "own_mean",
    "period_of",
    "prescribed_angles",
    "prescribed_indices",
    "ramp_of",
    "record_notes",
    "records_of",
    "refuse_but_events",
    "refuse_motions",
    "refuse_recorded_motions",
    "refuse_unsteady",
    "rows_of",
    "signals_of",
    "start_at",
    "start_table",
    "steady",
    "unsteady_inputs",
    "unsteady_problems",
    "whole_trajectory",
    "with_prescribed",
]
