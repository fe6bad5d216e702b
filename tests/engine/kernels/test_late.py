"""Kernels that are made late: numba knows those that Python calls, the cache gives machine code alone, bits are one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.architecture.places import ROOT

pytestmark = pytest.mark.compiled

KERNELS = """
from gearrattle.engine.kernels._jit import strict, strict_entry

@strict
def inner(x):
    return 2.0 * x

@strict_entry
def first(x):
    return inner(x) + 1.0

@strict_entry
def second(x):
    return inner(x) + 3.0
"""
COUNTED = """
import sys
import llvmlite.binding as llvm
read = []
parse = llvm.parse_bitcode
llvm.parse_bitcode = lambda text, *more: read.append(text) or parse(text, *more)
import some_kernels
from gearrattle.compilation import COMPILATION
print(some_kernels.{entry}(5.0), sum(b'inner' in text for text in read), type(some_kernels.inner).__name__)
"""
BITS = """
import sys
import gearrattle as gr
from gearrattle.model.examples import example_files

def rests():
    for name in example_files():
        rest = gr.equilibrium(gr.example(name))
        yield "numba" in sys.modules, rest.angle.tobytes(), rest.acceleration.tobytes(), rest.region, rest.deflection

plain = [rest for rest in rests() if not rest[0]]
import numba
compiled = list(rests())
known = {rest[1:3] for rest in compiled}
print(len(plain), all(rest[1:3] in known for rest in plain))
"""


def _python(code: str, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
        env={**os.environ, **environment},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_text_of_a_kernel_is_read_where_another_is_compiled(tmp_path: Path) -> None:
    (tmp_path / "some_kernels.py").write_text(KERNELS, encoding="utf-8")
    path = f"{tmp_path}{':' if sys.platform != 'win32' else ';'}{ROOT / 'src'}"
    environment = {"PYTHONPATH": path, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    (tmp_path / "cache").mkdir(mode=0o700)
    begun = _python(COUNTED.format(entry="first"), **environment).split()
    kept = _python(COUNTED.format(entry="first"), **environment).split()
    linked = _python(COUNTED.format(entry="second"), **environment).split()
    assert begun[0] == kept[0] == "11.0"
    assert kept[1:] == ["0", "Late"]  # neither the text of a kernel, nor what numba knows of one that it calls
    assert linked[0] == "13.0"
    assert int(linked[1]) > 0  # the machine code of ``inner`` is kept: its text is needed


def test_an_equilibrium_in_plain_python_has_the_bits_of_the_compiled_one() -> None:
    count, same = _python(BITS).split()
    assert int(count) > 8
    assert same == "True"


@pytest.mark.slow
def test_a_simulation_makes_only_the_kernels_that_python_calls() -> None:
    """Of 240; the machine code of the others lies in theirs."""
    code = (
        "import gearrattle as gr\ngr.simulate(gr.example('case3'), cycles=4)\n"
        "from gearrattle.engine.kernels._late import _FILES, _LATE, Late\n"
        "every = {id(value) for names in _FILES.values() for value in names.values() if isinstance(value, Late)}\n"
        "print(len(_LATE), len(every))"
    )
    _python(code)  # whatever must be compiled is kept now
    made, every = map(int, _python(code).split())
    assert every > 200
    assert made < every / 4
