"""Linear algebra of the command line runs on one thread, unless the user sets another number."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from gearrattle.threads import ONE_THREAD

COMMAND = """
import os, sys
from gearrattle.cli import main
from gearrattle.threads import ONE_THREAD
assert "numpy" not in sys.modules  # it reads the variables when it is imported
sys.argv[1:] = ["--version"]
main()
print(*(os.environ[name] for name in ONE_THREAD))
"""


@pytest.mark.parametrize(("asked", "threads"), [({}, "1 1 1"), ({"OMP_NUM_THREADS": "3"}, "3 1 1")])
def test_a_command_uses_one_thread_unless_told(asked: dict[str, str], threads: str) -> None:
    environment = {name: value for name, value in os.environ.items() if name not in ONE_THREAD} | asked
    done = subprocess.run([sys.executable, "-c", COMMAND], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == threads
