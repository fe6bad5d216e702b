"""The compiled stages against the same formulas in NumPy, LAPACK and extended precision (``numpy_regions``)."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import replace

import mpmath
import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.kernels._llvm import lapack_address
from gearrattle.engine.system.flow import flow_of
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.region import Region, build_region
from gearrattle.engine.system.region_arrays import RegionBuilder
from tests.dense.families import seeded
from tests.engine.solvers.tasks import oscillator
from tests.engine.system.drivelines import clearance, inputs, linear, random_chain, random_pieces
from tests.engine.system.numpy_regions import built_with_numpy
from tests.oracles.dressed import dressed_problem

FAMILIES = ("chain", "loop", "error", "everything")


def apart(one: np.ndarray, other: np.ndarray, size: np.ndarray | None = None) -> float:
    """Largest difference, of the size of the terms that made it; of the largest entry by default."""
    assert one.shape == other.shape
    size = np.abs(other) if size is None else size
    return float(np.abs(one - other).max(initial=0.0) / max(size.max(initial=0.0), 1e-300))


def meet(matrix: np.ndarray) -> bool:
    """Whether two eigenvalues are so near that which blocks they fall into is a matter of rounding."""
    values = np.linalg.eigvals(matrix)
    distance = np.abs(values[:, None] - values[None, :]) + np.diag(np.full(len(values), np.inf))
    return bool(distance.min() <= 1e-3 * np.abs(values).max())


def check(system: PiecewiseSystem, pieces: tuple[int, ...], seed: int = 0) -> Region:
    """Compare every number; bounds through what they say of states, for their rows have any order and phase."""
    flow = flow_of(system)
    made, want = build_region(flow, pieces), built_with_numpy(flow, pieces)
    n = flow.states
    particular = np.abs(want.split.particular)
    worst = 1e-12
    assert np.array_equal(made.split.kept, want.split.kept)
    assert made.fine == want.fine
    assert apart(made.generator, want.generator) <= 1e-14
    assert apart(made.carried, want.carried) <= 1e-14
    for j, w in enumerate([0.0, *flow.frequency]):
        columns = [j] if j == 0 else [j, j + flow.frequency.size]
        condition = np.linalg.cond(1j * w * np.eye(n) - flow.generator(pieces)[:n, :n])
        allowed = 1e-12 + np.finfo(float).eps * condition  # the matrices themselves differ in their last bit
        worst = max(worst, allowed if made.split.particular[:, columns].any() else 0.0)
        assert apart(made.split.particular[:, columns], want.split.particular[:, columns]) <= allowed
    for rows, one, other in (
        (flow.probe_rows(pieces)[0], made.forced, want.forced),
        (flow.carried_rows(pieces), made.drift[:, None], want.drift[:, None]),
        (flow.carried_rows(pieces), made.carried_particular, want.carried_particular),
    ):
        allowed = worst * (np.abs(rows[:, n:]).max(initial=0.0) + (np.abs(rows[:, :n]) @ particular).max(initial=0.0))
        assert np.abs(one - other).max(initial=0.0) <= allowed + 1e-20
    assert np.array_equal(made.lower, want.lower)
    assert np.array_equal(made.upper, want.upper)
    for level in range(made.fine + 1):
        assert apart(made.tables[level], want.tables[level]) <= 1e-12
    for derivative in range(4):
        assert apart(made.watched[derivative], want.watched[derivative]) <= 1e-13
        assert apart(made.calm[derivative], want.calm[derivative], np.abs(want.watched[derivative])) <= 1e-9
    rng, agreement = np.random.default_rng(seed), 2.0 if meet(want.generator) else 1.0 + 1e-6
    for _ in range(5):
        y = rng.normal(size=len(made.generator))
        here, there = made.bound.bound(y, np.zeros(0)), want.bound.bound(y, np.zeros(0))
        floor = 1e-9 * there.max(axis=1, keepdims=True, initial=1e-9)
        assert np.all(here <= agreement * there + floor)
        assert np.all(there <= agreement * here + floor)
    return made


@pytest.mark.parametrize("seed", range(60))
def test_random_chains(seed: int) -> None:
    system = random_chain(seed)
    for more in range(3):
        check(system, random_pieces(system, seed + 1000 * more), seed)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(15))
def test_random_drivelines(family: str, seed: int) -> None:
    system = seeded(family, seed).task().system
    check(system, random_pieces(system, seed), seed)


def train(size: int, stiffness: float, damping: float, **values: np.ndarray) -> PiecewiseSystem:
    """Return equal inertias on equal springs, in a row."""
    rows = np.eye(size - 1, size) - np.eye(size - 1, size, 1)
    laws = tuple(clearance(stiffness, damping, 0.5) for _ in range(size - 1))
    return PiecewiseSystem(np.ones(size), np.zeros(size), rows, laws, inputs(size, size - 1, **values))


def degenerate() -> Iterator[tuple[str, PiecewiseSystem, tuple[int, ...]]]:
    """Yield what makes eigenvalues meet."""
    force = {"cycles": np.array([1.0, 3.0]), "mean": np.array([1.0, 0.0, 0.0, 0.5])}
    force["torque_sine"] = np.array([[1.0, 0.5], [0.0, 0.0], [0.0, 0.1], [0.0, 0.0]])
    for name, pieces in (("free", (1, 1, 1)), ("held", (2, 2, 2)), ("mixed", (1, 0, 1)), ("tail", (2, 2, 1))):
        for damping in (0.0, 0.3):
            yield f"{name} {damping}", train(4, 40.0, damping, **force), pieces
    yield "resonance", oscillator(linear(4.0), force=1.0, turns=2 / (2 * np.pi)), (0,)
    near = replace(oscillator(linear(4.0), force=1.0, turns=2 / (2 * np.pi)), drag=np.array([1e-9]))
    yield "near resonance", near, (0,)
    yield "critical", oscillator(linear(4.0, 4.0), force=1.0), (0,)
    yield "nearly critical", oscillator(linear(4.0, 4.0 * (1 + 1e-12)), force=1.0), (0,)
    yield "free mass", oscillator(clearance(4.0, 0.1, 0.5), force=1.0, mean=0.3), (1,)
    yield "weak spring", oscillator(clearance(4.0, 0.0, 0.5, alpha=1e-9), drag=1.0, mean=1.0), (1,)
    twins = train(4, 40.0, 0.3, **force)  # the same oscillator twice, joined by a gap
    yield "twins", twins, (2, 1, 2)
    yield "no clearance", oscillator(linear(4.0, 0.1), force=1.0), (0,)
    yield "twenty inertias", train(20, 900.0, 0.2, cycles=np.array([2.0]), torque_cosine=np.ones((20, 1))), 19 * (2,)


@pytest.mark.parametrize(("name", "system", "pieces"), [pytest.param(*case, id=case[0]) for case in degenerate()])
def test_meeting_eigenvalues(name: str, system: PiecewiseSystem, pieces: tuple[int, ...]) -> None:
    check(system, pieces)


@pytest.mark.parametrize("seed", range(12))
def test_a_particular_solution_is_right_to_its_last_digits(seed: int) -> None:
    """Against the same system of equations solved in 50 digits."""
    system = random_chain(seed)
    flow = flow_of(system)
    builder = RegionBuilder(flow)
    builder.build(random_pieces(system, seed))
    n = flow.states
    count = flow.frequency.size
    region = builder.workspace.region
    matrix, particular = region.matrix, region.particular
    for j in range(1, 1 + count):
        if region.kept[j]:
            continue
        with mpmath.workdps(50):
            left = mpmath.mpc(0, float(flow.frequency[j - 1])) * mpmath.eye(n) - mpmath.matrix(matrix[:, :n].tolist())
            force = [mpmath.mpc(a, -b) for a, b in zip(matrix[:, n + j], matrix[:, n + j + count], strict=True)]
            exact = mpmath.lu_solve(left, mpmath.matrix(force))
            want = np.array([complex(x) for x in exact])
        actual = particular[:, j] - 1j * particular[:, j + count]
        assert np.abs(actual - want).max() <= 4e-16 * np.abs(want).max()


def test_a_region_that_is_not_finite_is_refused() -> None:
    system = oscillator(linear(4.0))
    broken = replace(system, inertia=np.array([1e-320]))
    with pytest.raises(FloatingPointError, match="not finite"):
        build_region(flow_of(broken), (0,))


def holds_schur_form(system: PiecewiseSystem, builder: RegionBuilder, pieces: tuple[int, ...]) -> None:
    """A = basis schur basis^H, schur a triangle."""
    builder.build(pieces)
    schur, basis = builder.workspace.modes.schur.T, builder.workspace.modes.basis.T
    n = len(schur)
    matrix = flow_of(system).generator(pieces)[:n, :n]
    assert np.abs(np.tril(schur, -1)).max() == 0.0
    assert apart(basis @ schur @ basis.conj().T, matrix.astype(complex)) <= 1e-13


def test_a_matrix_for_which_lapack_s_iteration_does_not_end() -> None:
    """zgees gives up on this region of 13 states; in another order of them it does not (4 regions of 192 000)."""
    system = assemble(gr.loads(dressed_problem("everything", 32).model.toml())).system
    holds_schur_form(system, RegionBuilder(flow_of(system)), (1, 3, 2, 1, 0, 1, 2, 0, 3, 0, 0, 0, 0))


@pytest.mark.parametrize("refusals", [1, 3])
def test_a_schur_form_of_other_orders_of_the_states(refusals: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A = basis schur basis^H in whatever order of the states it is found; where there is none, that is said."""
    system = random_chain(5)
    builder = RegionBuilder(flow_of(system))
    pieces = random_pieces(system, 5)
    count = 0
    integers = builder.workspace.lapack.integers
    kind = ctypes.CFUNCTYPE(None, *15 * [ctypes.c_void_p])
    zgees = kind(lapack_address("zgees"))

    @kind
    def refusing(*arguments: int) -> None:
        nonlocal count
        count += 1
        zgees(*arguments)
        if count <= refusals:
            integers[4] = 7

    monkeypatch.setattr(builder, "_zgees", ctypes.cast(refusing, ctypes.c_void_p).value)
    holds_schur_form(system, builder, pieces)
    assert count == refusals + 1
    refusals, count = len(builder.workspace.modes.schur), 0
    with pytest.raises(FloatingPointError, match="its eigenvalues are not found"):
        builder.build(pieces)
