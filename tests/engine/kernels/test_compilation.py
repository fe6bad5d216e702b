"""Compilation: its time is known, and a tracer does not follow it."""

from __future__ import annotations

import threading
from types import FrameType
from typing import Any

import numba
import pytest

from gearrattle.compilation import COMPILATION
from gearrattle.engine.kernels._jit import compact, kernel, strict_entry

pytestmark = pytest.mark.compiled


def test_compilation_is_timed_once_and_not_traced() -> None:
    files: list[str] = []

    def tracer(frame: FrameType, *_: object) -> None:
        files.append(frame.f_code.co_filename)

    before = COMPILATION.seconds
    twice = kernel(lambda x: 2.0 * x)
    tracing = threading.gettrace()
    threading.settrace(tracer)  # of threads that begin from now on
    try:
        assert twice(1.5) == 3.0
    finally:
        threading.settrace(tracing)
    after = COMPILATION.seconds
    assert after > before
    assert COMPILATION.current == 0.0
    assert not [name for name in files if "numba/core/typeinfer" in name.replace("\\", "/")]
    assert twice(2.5) == 5.0
    assert COMPILATION.seconds == after


@pytest.mark.compiled
def test_only_strict_kernels_are_optimised_little() -> None:
    with pytest.raises(ValueError, match="not strict"):
        compact(kernel(_doubled))
    assert compact(strict_entry(_doubled))(1.5) == 3.0


@pytest.mark.compiled
def test_settings_of_a_compilation_are_put_back() -> None:
    settings: Any = numba.config
    before = settings.OPT, settings.LOOP_VECTORIZE, settings.SLP_VECTORIZE
    compact(strict_entry(_doubled))(2.5)
    assert before == (settings.OPT, settings.LOOP_VECTORIZE, settings.SLP_VECTORIZE)


def _doubled(x: float) -> float:
    return 2.0 * x
