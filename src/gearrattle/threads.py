"""Linear algebra on one thread, where the user asks for no other number.

Matrices of a driveline are small: a second thread of BLAS costs more than it brings, and on a machine with other work
it waits, spinning, for a core. An exponential of nine by nine numbers takes 72 us on one thread, and there, on two,
11 ms. BLAS reads the variables when NumPy is first imported.
"""

from __future__ import annotations

import os

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables: how many threads a library of linear algebra uses."""


def one_thread() -> None:
    """Let linear algebra of this process, and of those that it starts, run on one thread; what is set stays."""
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
