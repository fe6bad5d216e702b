"""Every run of the tests tries the same examples: a failure is found again, a green run means the same each time."""

import gc
import os

import pytest
from hypothesis import settings

from gearrattle.threads import one_thread

one_thread()  # before NumPy is imported

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


def pytest_collection_finish() -> None:
    """Take modules and collected tests, which live to the end, out of what the garbage collector visits."""
    gc.collect()
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what needs compiled kernels where there are none (NUMBA_DISABLE_JIT=1)."""
    if os.environ.get("NUMBA_DISABLE_JIT") == "1":
        for item in items:
            if item.get_closest_marker("compiled"):
                item.add_marker(pytest.mark.skip(reason="needs compiled kernels"))
