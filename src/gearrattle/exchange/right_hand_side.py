"""The equations of motion of a driveline as named formulas, from which source texts of several languages are written.

    J_i theta_i'' = T_i(t) - D_i theta_i' - sum_k w_ki F_k(delta_k, delta_k'),     delta_k = sum_i w_ki theta_i - e_k(t)

In piece r of element k, F = K_r delta + C_r delta' + F_r. Clipped contact damping is limited to the elastic force.
T_i and e_k are Fourier series of OMEGA. A surface is a corner of an element: its function is zero there, rising
outward on the drive side. The piece of an element changes there, and nothing else does.

The formulas are infix text that C, Julia and Python read alike; terms are added in the same order in all of them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gearrattle.assembly import assemble, coordinate_names, free_names, period_of, unsteady_problems
from gearrattle.engine.system.law import PiecewiseLaw
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import Problem
from gearrattle.model import DEFAULTS, Element, Model
from gearrattle.simulation.initial_state import start_of


class Number(NamedTuple):
    """A named constant and what it is."""

    name: str
    value: float
    meaning: str


class Formula(NamedTuple):
    """A named value and its formula; without a name, a comment."""

    name: str
    text: str


class Piecewise(NamedTuple):
    """A law with corners: where it is looked up.

    Attributes
    ----------
    name
        of the element, as an identifier.
    clearance
        its index.
    corners, stiffness, damping, offset
        of its pieces, lowest deflection first.
    labels
        region labels of the pieces.
    """

    name: str
    clearance: int
    corners: list[float]
    stiffness: list[float]
    damping: list[float]
    offset: list[float]
    labels: list[int]


class Surface(NamedTuple):
    """A corner: identifier of the element, index of its clearance, index of the corner, deflection."""

    name: str
    clearance: int
    corner: int
    at: float


@dataclass(frozen=True)
class Equations:
    """All that the source text of a right-hand side says.

    Attributes
    ----------
    title
        name of the model.
    coordinates
        names of the coordinates, and as identifiers.
    numbers
        constants, by heading.
    laws
        laws with corners.
    before
        formulas of deflections and rates, of (t, y).
    clipped
        identifiers of the elements with clipped contact damping.
    forces
        formulas of forces: for elements with corners the piece is looked up before.
    accelerations
        one formula a coordinate.
    surfaces
        all corners.
    start
        state at t = 0, as the model's settings have it.
    start_pieces
        piece of every clearance there, from 0.
    period
        of the excitation [s].
    is_si
        whether quantities are in SI.
    """

    title: str
    coordinates: tuple[tuple[str, str], ...]
    numbers: tuple[tuple[str, tuple[Number, ...]], ...]
    laws: tuple[Piecewise, ...]
    before: tuple[Formula, ...]
    clipped: frozenset[str]
    forces: tuple[Formula, ...]
    accelerations: tuple[Formula, ...]
    surfaces: tuple[Surface, ...]
    start: tuple[float, ...]
    start_pieces: tuple[int, ...]
    period: float
    is_si: bool


def not_in_equations(model: Model) -> list[Problem]:
    """Return what of a model these equations do not hold."""
    rule = "a plain right-hand side has means and harmonics of one speed"
    problems = unsteady_problems(model, rule, "give harmonics of one speed")
    for element in model.elements:
        if element.rubs:
            words = "friction has states of its own beside angles and speeds"
            problems.append(Problem(element.path, "hysteresis", words))
        if element.alternation is not None:
            problems.append(Problem(element.path, "alternation", "its stiffness changes by the clock"))
    return problems


def identifiers(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return names as parts of identifiers, each once."""
    taken = set[str]()
    made = []
    for name in names:
        word = re.sub(r"\W", "_", name, flags=re.ASCII)
        unique = word
        while unique in taken:
            unique += "_"
        taken.add(unique)
        made.append(unique)
    return tuple(made)


def equations_of(model: Model) -> Equations:
    """Return the equations of a model that ``not_in_equations`` has no objection to; ModelError without a start."""
    driveline = assemble(model)
    system = driveline.system
    elements = model.elements
    names = coordinate_names(model)
    bodies = identifiers(names)
    words = identifiers(tuple(element.name for element in elements))
    numbers = _numbers(model, system, bodies, words)
    if _is_ambiguous(numbers):
        bodies = tuple(f"body{i}" for i in range(len(bodies)))
        words = tuple(f"element{k}" for k in range(len(words)))
        numbers = _numbers(model, system, bodies, words)
    initial = model.simulation.initial or DEFAULTS.initial
    angle, velocity, _ = start_of(initial, driveline)
    clearances = {k: i for i, k in enumerate(system.clearances)}
    laws = tuple(_piecewise(words[k], i, system.laws[k]) for k, i in clearances.items())
    surfaces = [
        Surface(law.name, law.clearance, corner, law.corners[corner])
        for law in laws
        for corner in range(len(law.corners))
    ]
    return Equations(
        title=model.name or "a driveline",
        coordinates=tuple(zip(names, bodies, strict=True)),
        numbers=numbers,
        laws=laws,
        before=_deflections(system, bodies, words),
        clipped=frozenset(
            word for word, element in zip(words, elements, strict=True) if element.contact_damping == "clipped"
        ),
        forces=_forces(system, elements, words),
        accelerations=_accelerations(system, bodies, words),
        surfaces=tuple(surfaces),
        start=(*angle.tolist(), *velocity.tolist()),
        start_pieces=_pieces(system, angle, velocity),
        period=period_of(model).period,
        is_si=model.units == "SI",
    )


def _is_ambiguous(numbers: tuple[tuple[str, tuple[Number, ...]], ...]) -> bool:
    """Whether two constants have one name, as of the bodies "a" and "a_mean"."""
    names = [number.name for _, of_heading in numbers for number in of_heading]
    return len(set(names)) < len(names)


def _piecewise(name: str, index: int, law: PiecewiseLaw) -> Piecewise:
    labels = list(range(law.first_label, law.first_label + law.pieces))
    return Piecewise(
        name,
        index,
        corners=law.corners.tolist(),
        stiffness=law.stiffness.tolist(),
        damping=law.damping.tolist(),
        offset=law.offset.tolist(),
        labels=labels,
    )


def _pieces(system: PiecewiseSystem, angle: np.ndarray, velocity: np.ndarray) -> tuple[int, ...]:
    """Pieces at the start; on a corner the rate decides, or without one the inner piece."""
    inputs = system.inputs
    omega = 2.0 * np.pi * inputs.cycles / inputs.period
    deflection = system.rows @ angle - inputs.error_cosine.sum(axis=1)
    rate = system.rows @ velocity - inputs.error_sine @ omega
    pieces = []
    for k in system.clearances:
        law = system.laws[k]
        piece = law.piece_at(float(deflection[k]))
        for corner, at in enumerate(law.corners):
            if deflection[k] == at:
                outward = corner + (rate[k] > 0.0)
                piece = outward if rate[k] else law.inner(corner, corner + 1)
        pieces.append(int(piece))
    return tuple(pieces)


def _numbers(
    model: Model, system: PiecewiseSystem, bodies: tuple[str, ...], words: tuple[str, ...]
) -> tuple[tuple[str, tuple[Number, ...]], ...]:
    """Constants: speed, bodies, loads, arms of elements, laws without a corner, errors."""
    inputs = system.inputs
    is_si = model.units == "SI"
    turning = len(free_names(model))

    def unit(angular: str, along: str, is_angular: bool) -> str:
        return (angular if is_angular else along) if is_si else "1"

    speed = Number("OMEGA", model.excitation.omega, "rad/s" if is_si else "1")
    of_bodies = []
    loads = []
    for i, body in enumerate(bodies):
        is_angle = i < turning
        of_bodies.append(Number(f"J_{body}", float(system.inertia[i]), unit("kg m^2", "kg", is_angle)))
        of_bodies.append(Number(f"D_{body}", float(system.drag[i]), unit("N m s/rad", "N s/m", is_angle)))
        torque = unit("N m", "N", is_angle)
        loads.append(Number(f"T_{body}_mean", float(inputs.mean[i]), torque))
        for j, (sine, cosine) in enumerate(_terms(inputs.torque_sine[i], inputs.torque_cosine[i])):
            if sine or cosine:
                loads += [Number(f"T_{body}_sin_{j}", sine, torque), Number(f"T_{body}_cos_{j}", cosine, torque)]
    orders = [
        Number(f"ORDER_{j}", float(cycles * 2.0 * np.pi / inputs.period / model.excitation.omega), "times OMEGA")
        for j, cycles in enumerate(inputs.cycles)
    ]
    of_elements = []
    for k, (word, element, law) in enumerate(zip(words, model.elements, system.laws, strict=True)):
        is_angle = not element.along_line
        arms = ["m" if element.along_line and i < turning and is_si else "1" for i in range(system.size)]
        own = np.flatnonzero(system.rows[k])
        of_elements += [Number(f"W_{word}_{bodies[i]}", float(system.rows[k, i]), arms[i]) for i in own]
        if not law.corners.size:
            of_elements.append(Number(f"K_{word}", float(law.stiffness[0]), unit("N m/rad", "N/m", is_angle)))
            of_elements.append(Number(f"C_{word}", float(law.damping[0]), unit("N m s/rad", "N s/m", is_angle)))
            of_elements.append(Number(f"F_{word}", float(law.offset[0]), unit("N m", "N", is_angle)))
        length = unit("rad", "m", is_angle)
        for j, (sine, cosine) in enumerate(_terms(inputs.error_sine[k], inputs.error_cosine[k])):
            if sine or cosine:
                of_elements += [Number(f"E_{word}_sin_{j}", sine, length), Number(f"E_{word}_cos_{j}", cosine, length)]
    headings = (
        ("reference speed, and orders of the excitation", (speed, *orders)),
        ("inertias, and drag to ground", tuple(of_bodies)),
        ("torques: means, and Fourier coefficients", tuple(loads)),
        ("elements: arms w of their deflections, laws without a corner, errors", tuple(of_elements)),
    )
    return tuple((heading, numbers) for heading, numbers in headings if numbers)


def _terms(sine: np.ndarray, cosine: np.ndarray) -> list[tuple[float, float]]:
    return list(zip(sine.tolist(), cosine.tolist(), strict=True))


def _series(prefix: str, sine: np.ndarray, cosine: np.ndarray, *, rate: bool = False) -> list[str]:
    """Terms of a Fourier series, or of its rate."""
    texts = []
    for j, (s, c) in enumerate(_terms(sine, cosine)):
        if not (s or c):
            continue
        phase = f"ORDER_{j} * OMEGA * t"
        if rate:
            slope = f"ORDER_{j} * OMEGA"
            texts.append(f"{slope} * ({prefix}_sin_{j} * cos({phase}) - {prefix}_cos_{j} * sin({phase}))")
        else:
            texts.append(f"{prefix}_sin_{j} * sin({phase}) + {prefix}_cos_{j} * cos({phase})")
    return texts


def _deflections(system: PiecewiseSystem, bodies: tuple[str, ...], words: tuple[str, ...]) -> tuple[Formula, ...]:
    """Formulas of every element's deflection and rate."""
    inputs = system.inputs
    formulas = []
    for k, word in enumerate(words):
        own = np.flatnonzero(system.rows[k])
        error = _series(f"E_{word}", inputs.error_sine[k], inputs.error_cosine[k])
        slope = _series(f"E_{word}", inputs.error_sine[k], inputs.error_cosine[k], rate=True)
        for name, state, less in (("delta", "theta", error), ("rate", "omega", slope)):
            seen = " + ".join(f"W_{word}_{bodies[i]} * {state}_{bodies[i]}" for i in own) or "0.0"
            formulas.append(Formula(f"{name}_{word}", f"{seen} - ({' + '.join(less)})" if less else seen))
    return tuple(formulas)


def _forces(system: PiecewiseSystem, elements: tuple[Element, ...], words: tuple[str, ...]) -> tuple[Formula, ...]:
    """Formulas of every element's force."""
    formulas = []
    for word, law, element in zip(words, system.laws, elements, strict=True):
        if not law.corners.size:
            text = f"K_{word} * delta_{word} + C_{word} * rate_{word} + F_{word}"
        else:
            call = "clipped_force" if element.contact_damping == "clipped" else "force"
            text = f"{call}(piece_{word}, delta_{word}, rate_{word}, K_{word}, C_{word}, F_{word})"
        formulas.append(Formula(f"force_{word}", text))
    return tuple(formulas)


def _accelerations(system: PiecewiseSystem, bodies: tuple[str, ...], words: tuple[str, ...]) -> tuple[Formula, ...]:
    """Formulas of every coordinate's acceleration."""
    inputs = system.inputs
    formulas = []
    for i, body in enumerate(bodies):
        torque = [f"T_{body}_mean", *_series(f"T_{body}", inputs.torque_sine[i], inputs.torque_cosine[i])]
        acting = [f"W_{words[k]}_{body} * force_{words[k]}" for k in np.flatnonzero(system.rows[:, i])]
        taken = "".join(f" - {text}" for text in acting)
        formulas.append(Formula(body, f"({' + '.join(torque)} - D_{body} * omega_{body}{taken}) / J_{body}"))
    return tuple(formulas)
