"""Impacts, read from the log of corner crossings.

An impact is a crossing into contact, from the centre or outward (|to| > |from|). Its *approach velocity* v is the
deflection rate at the crossing; its *contact* lasts until the next crossing of the same corner, which can only be the
return, at the rate v'. With the reduced inertia m_eff of the element (``bodies``) its *momentum* is m_eff |v|, its
*energy* m_eff v^2 / 2. The *exchanged momentum* is m_eff (|v| + |v'|): the integral over the contact of the force F
above the quasi-static load F_0, the force with which the two bodies would stay together (delta'' = 0) under all other
forces Q and the error e,

    m_eff delta'' = F_0 - F,    F_0 = m_eff (w M^-1 Q - e''),    integral of (F - F_0) dt = m_eff (v - v').

The *contact impulse*, the integral of F itself, has the static load in it and grows with the length of the contact. A
contact still closed when the motion ends is *censored*: its contact impulse and duration count up to the end, and v' is
taken as 0, as there is no rebound yet. In a staged clutch damper every stage that is entered from within is such a
contact. (Where delta = 0 is a corner and just one of the two pieces that meet there is a gap, passing from the gap into
the other is an impact as well.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.signals.driveline_constants import reduced_inertias
from gearrattle.signals.regions import in_contact
from gearrattle.signals.windows import Window
from gearrattle.trajectory import Array, EventLog, IntArray, Trajectory


@dataclass(frozen=True)
class Impacts:
    """A table of impacts in the order of their start.

    Attributes
    ----------
    time
        (I,) start of the contact [s].
    clearance
        (I,) index into ``Layout.clearance``.
    region
        (I,) label of the region entered.
    velocity
        (I,) signed approach velocity [rad/s or m/s]: positive on the drive side.
    departure
        (I,) signed deflection rate at its end [rad/s or m/s]: negative on the drive side; NaN if censored.
    duration
        (I,) length of the contact [s].
    impulse
        (I,) contact impulse: integral of the element's force over the contact [N m s or N s], positive for a
        drive-side push; NaN where the solver supplies no force integral.
    censored
        (I,) whether the motion ended before the contact did.
    row
        (I,) position of the crossing in the log.
    mass
        (I,) m_eff of the element [kg m^2 or kg]; infinite if no end of it is free.
    """

    time: Array
    clearance: IntArray
    region: IntArray
    velocity: Array
    departure: Array
    duration: Array
    impulse: Array
    censored: NDArray[np.bool_]
    row: NDArray[np.intp]
    mass: Array

    @property
    def energy(self) -> Array:
        """Return (I,) m_eff v^2 / 2 [J]."""
        return np.asarray(0.5 * self.mass * self.velocity**2)

    @property
    def exchanged(self) -> Array:
        """Return (I,) exchanged momentum m_eff (v - v') [N m s or N s], positive on the drive side."""
        return np.asarray(self.mass * (self.velocity - np.where(self.censored, 0.0, self.departure)))

    def __len__(self) -> int:
        """Return the number of impacts."""
        return int(self.time.size)

    def of(self, clearance: int) -> Impacts:
        """Return the impacts of one clearance (an index into ``Layout.clearance``)."""
        return self.where(self.clearance == clearance)

    def within(self, window: Window) -> Impacts:
        """Return the impacts that begin in the window, its bounds included."""
        return self.where(window.contains(self.time))

    @property
    def drive(self) -> NDArray[np.bool_]:
        """Return (I,) whether impacts are on the drive side, met with growing deflection."""
        return np.asarray(self.region >= 0, dtype=np.bool_)

    def where(self, chosen: NDArray[np.bool_]) -> Impacts:
        """Return the impacts of a mask (I,)."""
        return Impacts(
            time=self.time[chosen],
            clearance=self.clearance[chosen],
            region=self.region[chosen],
            velocity=self.velocity[chosen],
            departure=self.departure[chosen],
            duration=self.duration[chosen],
            impulse=self.impulse[chosen],
            censored=self.censored[chosen],
            row=self.row[chosen],
            mass=self.mass[chosen],
        )


def _is_impact(trajectory: Trajectory) -> NDArray[np.bool_]:
    events = trajectory.events
    begins = np.zeros(len(events), dtype=np.bool_)
    for k in range(trajectory.layout.clearance.size):
        mine = events.clearance == k
        to = events.to_region[mine]
        origin = events.from_region[mine]
        closed_before, closed_after = (in_contact(trajectory.layout, k, region) for region in (origin, to))
        begins[mine] = closed_after & (~closed_before | (np.abs(to) > np.abs(origin)))
    return begins


def _returns(events: EventLog) -> NDArray[np.intp]:
    """Return (E,) the position of the next crossing of the same corner; -1 where there is none."""
    corner = np.minimum(events.from_region, events.to_region)
    order = np.lexsort((np.arange(len(events)), corner, events.clearance))
    here = order[:-1]
    after = order[1:]
    same = (events.clearance[here] == events.clearance[after]) & (corner[here] == corner[after])
    following = np.full(len(events), -1, dtype=np.intp)
    following[here[same]] = after[same]
    return following


@kept
def find_impacts(trajectory: Trajectory) -> Impacts:
    """Return every impact of the whole motion; take ``.of(clearance)`` and ``.within(window)`` of it.

    Only contacts whose begin is in the log count: one that is closed at t = 0 is no impact.
    """
    events = trajectory.events
    rows = np.flatnonzero(_is_impact(trajectory))
    ends = _returns(events)[rows]
    censored = ends < 0
    clearance = events.clearance[rows]
    end_time = np.where(censored, trajectory.end, events.time[ends])
    integral = np.where(censored, trajectory.final_force_integral[clearance], events.force_integral[ends])
    return Impacts(
        time=events.time[rows],
        clearance=clearance,
        region=events.to_region[rows],
        velocity=events.velocity[rows],
        departure=np.where(censored, np.nan, events.velocity[ends]),
        duration=end_time - events.time[rows],
        impulse=integral - events.force_integral[rows],
        censored=np.asarray(censored, dtype=np.bool_),
        row=rows,
        mass=reduced_inertias(trajectory.layout, trajectory.layout.clearance.tolist())[clearance],
    )
