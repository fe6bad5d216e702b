"""Imports of the process from which computing processes are forked: a process is warm once it has them."""

from __future__ import annotations

import gc

from gearrattle.processes import becoming_warm
from gearrattle.threads import one_thread

with becoming_warm():
    one_thread()
    from gearrattle.workbench.jobs.worker import warm_up

    warm_up()
    gc.collect()
    gc.freeze()  # pages that no collection touches stay shared with the processes that are forked
