"""Compilation: its time is known, and a tracer does not follow it."""

from __future__ import annotations

import threading
from types import FrameType

import pytest

from gearrattle.compilation import COMPILATION
from gearrattle.engine.kernels._jit import kernel

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
