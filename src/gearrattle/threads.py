"""Linear algebra on one thread, unless the user sets another number of threads.

Matrices of a driveline are small, so a second thread of BLAS makes them slower; on a busy machine this thread waits for
a core in a spin loop. There, a matrix exponential of size 9 x 9 takes 72 us on one thread and 11 ms on two. BLAS reads
the environment variables when NumPy is first imported.
"""

from __future__ import annotations

import os

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables with the number of threads of a library of linear algebra."""


def one_thread() -> None:
    """Set linear algebra of this process and its child processes to one thread; keep variables that are already set."""
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
